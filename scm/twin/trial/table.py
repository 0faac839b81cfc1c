"""What live trials were worth, as a table: a row for each kind of change, then what is of all."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from scm.twin.trial.score import BETTER, RAMP_OFF, STEP_OFF_S, WORSE, Judged, Outcome

KINDS = ("car", "tag", "place", "camera", "everywhere")
HEAD = (
    f"{'what changed':<22}{'of cars':>8}{'noticed':>9}{'after [s]':>14}"
    f"{'onset near':>12}{'named':>16}{'whose right/?/wrong':>22}{'adopted, better':>17}"
)


def lines(judged: Judged) -> list[str]:
    """Return the whole table as text."""
    found = [HEAD]
    singles = [one for one in judged.outcomes if len(one.whose) == 1]
    for kind in KINDS:
        for is_over in (False, True):
            some = [one for one in singles if one.whose == (kind,) and one.is_over is is_over]
            found += _row(f"{kind}{', gone again' if is_over else ''}", some)
    found += _row("two at once", [one for one in judged.outcomes if len(one.whose) > 1])
    found += _row("all", judged.outcomes)
    alarms = len(judged.false_alarms)
    per_h = f"{alarms / judged.driven_h:.2f}" if judged.driven_h else "-"
    adopted = sum(alarm.is_adopted for alarm in judged.false_alarms)
    found += [
        "",
        f"false alarms: {alarms} in {judged.driven_h:.2f} h of driving, {per_h} an hour; "
        f"{adopted} of them adopted",
        "wrong adoptions (of nothing, a place or a camera; or worse later): "
        f"{judged.wrong_adoptions}",
        f"contacts: {judged.contacts}",
    ]
    if judged.car_h:
        own_s = (judged.cpu_s - judged.search_cpu_s) / judged.car_h
        found.append(
            f"{judged.car_h:.2f} car-hours in the city; processor time for one: {own_s:.0f} s, "
            f"and {judged.search_cpu_s / judged.car_h:.0f} s of searches; wall time "
            f"{judged.wall_s / judged.car_h:.0f} s"
        )
    return found


def each(judged: Judged) -> list[str]:
    """Return a line for each change of each car, and for each false alarm."""
    found = list[str]()
    for one in judged.outcomes:
        what = " + ".join(one.effects) + (" gone" if one.is_over else "")
        sizes = " ".join(f"{size:.1f}x" for size in one.strength)
        line = f"{one.case} {one.car} {one.at_s:5.0f} s {one.course} {what} {sizes} "
        line += f"({' + '.join(one.whose)}) -> "
        if one.noticed_s is None:
            found.append(f"{line}not noticed")
            continue
        parts = [f"after {one.noticed_s:.0f} s", f"whose {one.cause}"]
        parts += [f"onset {one.onset_off_s:+.1f} s"] if one.onset_off_s is not None else []
        parts += [f"onset {one.onset_off:+.2f} of the ramp"] if one.onset_off is not None else []
        when = "" if one.named_s is None else f" {one.named_s:.0f} s after it began"
        parts += [f"named {one.named}{when}"] if one.named else []
        parts += [f"version {one.version} {one.later}".rstrip()] if one.version else []
        found.append(f"{line}{', '.join(parts)}: {one.text}")
    for alarm in judged.false_alarms:
        found.append(
            f"{alarm.case} {alarm.car} {alarm.at_s:5.0f} s nothing -> {alarm.effect}, score "
            f"{alarm.score:.1f}, {alarm.cause}{', adopted' if alarm.is_adopted else ''}"
        )
    return found


def _row(title: str, some: Sequence[Outcome]) -> list[str]:
    if not some:
        return []
    noticed = [one for one in some if one.noticed_s is not None]
    after_s = [one.noticed_s for one in noticed if one.noticed_s is not None]
    after = "-"
    if after_s:
        after = f"{np.median(after_s):.0f}, {np.percentile(after_s, 95):.0f}"
    named = Counter(one.named for one in noticed)
    causes = Counter(one.cause for one in noticed)
    later = Counter(one.later for one in noticed)
    near, of = sum(map(_is_near, noticed)), len(noticed) - named[None]
    whose = "/".join(str(causes[word]) for word in ("right", "undecided", "wrong"))
    adopted = later[BETTER] + later[WORSE]
    names = f"{named['exact']}+{named['among']} of {of}" if of else "-"
    good = f"{adopted}, {later[BETTER]} better" if adopted else "-"
    text = f"{title:<22}{len(some):>8}{len(noticed):>9}{after:>14}"
    return [f"{text}{f'{near} of {len(noticed)}':>12}{names:>16}{whose:>22}{good:>17}"]


def _is_near(one: Outcome) -> bool:
    if one.onset_off is not None:
        return abs(one.onset_off) <= RAMP_OFF
    return one.onset_off_s is not None and abs(one.onset_off_s) <= STEP_OFF_S
