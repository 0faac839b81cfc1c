"""The page of several cars: each car's verdict with its report, and what they have in common."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

from scm.mismatch.findings import Diagnosis, Estimate
from scm.mismatch.report.advice import advice_of
from scm.mismatch.report.as_json import plain
from scm.mismatch.report.first_screen import card, name_of
from scm.mismatch.report.html_text import around, section, table, tag
from scm.mismatch.report.page import document
from scm.mismatch.report.several_picture import seen_picture
from scm.mismatch.report.summary import summary
from scm.mismatch.report.verdict_text import can_judge, count, verdict_sentence
from scm.mismatch.report.wording import (
    capital,
    interval,
    joined,
    pretty,
    quantities,
    quantity,
    title_of,
)
from scm.mismatch.report.write import PAGE
from scm.mismatch.several.findings import CarSight, Cause, Common, Sight

CARS, POSITION = "cars.json", "position_m"
_SAYS: Mapping[Sight, str] = {
    Sight.SEES: "sees it",
    Sight.ADDS: "too weak alone, adds to the others",
    Sight.CANNOT_TELL: "cannot tell",
    Sight.OTHERWISE: "contradicts it",
}
_LABELS: Mapping[Cause, str] = {
    Cause.CAMERA: "The camera", Cause.TAGS: "Tags and camera", Cause.FLOOR: "The floor",
}  # fmt: skip
_NOTHING = (
    "No car's report names anything that an overhead camera or a floor does to every car, and "
    "their drives taken together show none either."
)


def write_several(
    cars: Mapping[str, Diagnosis],
    recordings: Mapping[str, Sequence[str]],
    common: Sequence[Common],
    runtime_s: float,
    out: Path,
    failed: Sequence[str] = (),
) -> None:
    """Write `report.html` and `cars.json` beside the folders of the cars' own reports.

    Args:
        cars: Diagnoses by name, which is also the report's folder.
        recordings: Titles by the same.
        common: What they share.
        runtime_s: Of all.
        out: Is made where it is missing.
        failed: Why other cars could not be diagnosed, a sentence each.
    """
    out.mkdir(parents=True, exist_ok=True)
    fields = {
        "cars": [
            {
                "name": name,
                "report": f"{name}/{PAGE}",
                "verdict": str(diagnosis.verdict),
                "said": verdict_sentence(diagnosis),
                "effects": [effect.name for effect in diagnosis.effects],
            }
            for name, diagnosis in cars.items()
        ],
        "said": common_sentence(common),
        "conclusions": _conclusions(common),
        "common": [plain(one) for one in common],
        "failed": list(failed),
        "runtime_s": runtime_s,
    }
    text = json.dumps(fields, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    (out / CARS).write_text(text, encoding="utf-8")
    (out / PAGE).write_text(several_html(cars, recordings, common, failed), encoding="utf-8")


def several_html(
    cars: Mapping[str, Diagnosis],
    recordings: Mapping[str, Sequence[str]],
    common: Sequence[Common],
    failed: Sequence[str] = (),
) -> str:
    """Return the page of several cars."""
    titles = list(dict.fromkeys(title for one in recordings.values() for title in one))
    word = "recordings" if len(titles) > 1 else "recording"
    where = f"Cars {joined(list(cars))}, {word} {joined(titles) or 'unnamed'}"
    sentence = common_sentence(common)
    head = tag("p", where, "inputs") + tag("h1", sentence)
    head += "".join(tag("p", conclusion) for conclusion in _conclusions(common))
    head += "".join(tag("p", f"Not diagnosed: {why}") for why in failed)
    kind = "mismatch" if common or any(one.effects for one in cars.values()) else "none"
    body = around("header", around("div", head, "words"), f"verdict {kind}")
    body += around("div", "".join(_car_card(*one) for one in cars.items()), "cards")
    shared = [_common_card(one, cars) for one in common]
    body += around("div", "".join(shared), "cards") if shared else ""
    body += "".join(_seen(one) for one in common)
    return document(f"{joined(list(cars))}: {sentence}", body)


def common_sentence(common: Sequence[Common]) -> str:
    """Return what the cars have in common, in one sentence."""
    shared = [one for one in common if one.shared]
    if shared:
        return f"The cars have in common: {joined([title_of(one.name) for one in shared])}."
    if common:
        own = joined([title_of(one.name) for one in common])
        are = "is" if len(common) == 1 else "are"
        return f"Nothing that the cars have in common was found; {own} {are} not shared."
    return "Nothing that the cars have in common was found."


def _conclusions(common: Sequence[Common]) -> list[str]:
    found = [f"{capital(title_of(one.name))}: {one.conclusion}" for one in common]
    return found or [_NOTHING]


def several_summary(cars: Mapping[str, Diagnosis], common: Sequence[Common], out: Path) -> str:
    """Return the last lines of the command: each car's, then what they share."""
    lines = [line for name, one in cars.items() for line in (f"{name}:", summary(one, out / name))]
    lines.append(common_sentence(common))
    for one in common:
        lines += [f"  {one.name}  {_amounts(one.parameters, '; ')}", f"    {one.conclusion}"]
    return "\n".join([*lines, f"  {out / PAGE}"])


def _car_card(name: str, diagnosis: Diagnosis) -> str:
    """Return a car's verdict with a link to its report."""
    kind = "effect" if diagnosis.effects else "clear"
    kind = "question" if diagnosis.undecided else kind
    kind = kind if can_judge(diagnosis) else "data"
    link = f'<a href="{quote(name)}/{PAGE}">The report of {escape(name)}</a>'
    inner = tag("p", f"Car {name}", "label") + tag("h2", verdict_sentence(diagnosis))
    return around("article", inner + _errors(diagnosis) + around("p", link), f"card {kind}")


def _errors(diagnosis: Diagnosis) -> str:
    """Return how far the simulated car strays before and after, where that was judged."""
    fit = diagnosis.fit
    if fit is None or POSITION not in fit.confirm.before or POSITION not in fit.confirm.after:
        return ""
    sides = fit.confirm.before[POSITION], fit.confirm.after[POSITION]
    before, after = quantities(sides, "m")
    what = f"Position error after {quantity(fit.horizon_s, 's')}, on unseen parts"
    return tag("p", f"{what}: {before} before, {after} after.")


def _common_card(common: Common, cars: Mapping[str, Diagnosis]) -> str:
    effects = [e for one in cars.values() for e in one.effects if e.name == common.name]
    rows = [
        ("What", pretty(common.said)),
        ("How much", _amounts(common.parameters, "\n")),
        ("Whose", common.conclusion),
        ("What to do", advice_of(effects[0]) if effects else ""),
    ]
    label = _LABELS[common.cause] if common.shared else "One car's own"
    label = label if common.shared or _is_told(common) else "Whose is open"
    return card("effect", label, capital(title_of(common.name)), rows)


def _is_told(common: Common) -> bool:
    return any(c.sight is Sight.OTHERWISE for c in common.cars)


def _amounts(parameters: Mapping[str, Estimate], mark: str) -> str:
    return mark.join(f"{name_of(n, e.unit)} {interval(e)}" for n, e in parameters.items())


def _seen(common: Common) -> str:
    """Return what each car's recordings say of an effect, for experts."""
    rows = [_row(one) for one in common.cars]
    head = ("Car", "Its own value", "Says", "Found alone", "Gains", "Needed", "Misses")
    words = (
        "Gains: what the shared value explains of the car's recordings, in squared standard "
        "deviations; needed: what its numbers cost, for nobody searched for them there. Misses: "
        f"squared deviation of the car's own value from the others'; {count(_knobs(common))} "
        "would be usual."
    )
    picture = seen_picture(common)
    title = f"Who sees {title_of(common.name)}"
    body = table(head, rows, (4, 5, 6)) + tag("p", words, "use")
    return section(f"seen-{common.name.replace(' ', '-')}", title, picture, body)


def _row(one: CarSight) -> tuple[str, ...]:
    alone = "yes" if one.alone else "no"
    numbers = (f"{value:.0f}" for value in (one.gain, one.needed))
    own = _amounts(one.own, "\n")
    return one.car, own, _SAYS[one.sight], alone, *numbers, f"{one.misses:.1f}"


def _knobs(common: Common) -> int:
    return len(common.parameters)
