"""The page of several cars: each car's verdict with its report, and what they have in common."""

import json
import math
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

from scm.maps.svg import element
from scm.mismatch.findings import Diagnosis, Estimate
from scm.mismatch.report.page import around, document, figure, panel_html, section, table, tag
from scm.mismatch.report.panels import Panel
from scm.mismatch.report.plot import (
    TEXT_PX,
    Picture,
    frame,
    picture_svg,
    text,
    ticks_across,
    whiskers,
)
from scm.mismatch.report.record import plain
from scm.mismatch.report.sentences import advice_of, can_judge, count, verdict_sentence
from scm.mismatch.report.wording import (
    amounts,
    capital,
    joined,
    name_of,
    pretty,
    quantities,
    quantity,
    title_of,
    unit_text,
)
from scm.mismatch.report.write import PAGE, summary
from scm.mismatch.several.findings import Agreement, CarAgreement, Cause, Common

CARS, POSITION = "cars.json", "position_m"
_ANSWERS: Mapping[Agreement, str] = {
    Agreement.CONFIRMS: "sees it",
    Agreement.SUPPORTS: "too weak alone, adds to the others",
    Agreement.UNDECIDED: "cannot tell",
    Agreement.CONTRADICTS: "contradicts it",
}
_LABELS: Mapping[Cause, str] = {
    Cause.CAMERA: "The camera", Cause.TAGS: "Tags and camera", Cause.FLOOR: "The floor",
}  # fmt: skip
_NOTHING = (
    "No car's report contains an effect that an overhead camera or a floor has on every car, and "
    "their drives together show none either."
)
_WIDTH, _ROW, _MAX_LABEL = 440.0, 25.0, 200.0  # [px]
_MAX_SPREADS = 6.0  # shown of an interval, in spreads of the cars' values


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
    body += around("div", "".join(_car_html(*one) for one in cars.items()), "cards")
    shared = [_shared_effect(one, cars) for one in common]
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
        lines += [f"  {one.name}  {'; '.join(amounts(one.parameters))}", f"    {one.conclusion}"]
    return "\n".join([*lines, f"  {out / PAGE}"])


def _car_html(name: str, diagnosis: Diagnosis) -> str:
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


def _shared_effect(common: Common, cars: Mapping[str, Diagnosis]) -> str:
    effects = [e for one in cars.values() for e in one.effects if e.name == common.name]
    rows = [
        ("What", pretty(common.text)),
        ("How much", "\n".join(amounts(common.parameters))),
        ("Cause", common.conclusion),
        ("What to do", advice_of(effects[0]) if effects else ""),
    ]
    label = _LABELS[common.cause] if common.shared else "One car's own"
    is_contradicted = any(c.agreement is Agreement.CONTRADICTS for c in common.cars)
    label = label if common.shared or is_contradicted else "Cause undecided"
    return panel_html(Panel("effect", label, capital(title_of(common.name)), rows))


def _seen(common: Common) -> str:
    """Return what each car's recordings show of an effect, for experts."""
    rows = [_row(one) for one in common.cars]
    head = ("Car", "Its own value", "Result", "Found alone", "Gains", "Needed", "Misses")
    words = (
        "Gains: what the shared value explains of the car's recordings, in squared standard "
        "deviations; needed: the complexity penalty of its numbers. Misses: "
        "squared deviation of the car's own value from the others'; "
        f"{count(len(common.parameters))} would be usual."
    )
    pictures = "".join(
        figure(_picture(common, name, shared)) for name, shared in common.parameters.items()
    )
    title = f"Who sees {title_of(common.name)}"
    body = table(head, rows, (4, 5, 6)) + tag("p", words, "use")
    return section(
        f"seen-{common.name.replace(' ', '-')}", title, around("div", pictures, "grid"), body
    )


def _row(one: CarAgreement) -> tuple[str, ...]:
    alone = "yes" if one.alone else "no"
    numbers = (f"{value:.0f}" for value in (one.gain, one.needed))
    own = "\n".join(amounts(one.own))
    return one.car, own, _ANSWERS[one.agreement], alone, *numbers, f"{one.misses:.1f}"


def _picture(common: Common, name: str, shared: Estimate) -> Picture | None:
    rows = [(one.car, one.own[name]) for one in common.cars if name in one.own]
    if not all(math.isfinite(v) for _, e in rows for v in (e.value, e.low, e.high)):
        return None
    span = _span([shared, *(e for _, e in rows)])
    left = min(_MAX_LABEL, 14.0 + TEXT_PX * max(len(car) for car, _ in rows))
    height = 30.0 + _ROW * len(rows) + 44.0
    room = frame(span, (0.0, 1.0), (_WIDTH, height), margins=(left, 14, 26, 44))
    begin, end = (room.across.at(min(span[1], max(span[0], v))) for v in (shared.low, shared.high))
    parts = [
        element("rect", x=begin, y=room.top, width=max(end - begin, 1.0),
                height=room.bottom - room.top, class_="prior-core")
    ]  # fmt: skip
    parts += ticks_across(room)
    parts += whiskers(room, [(car, e.low, e.value, e.high) for car, e in rows], 40.0, _ROW)
    unit = f" [{unit_text(shared.unit)}]" if unit_text(shared.unit) else ""
    words = f"{name_of(name, shared.unit)}{unit}"
    parts += [text(room.right, height - 8, words, "end", "title")]
    area = "what the cars share" if common.shared else "what the one car shows that sees it"
    return Picture(
        name=f"{common.name}_{name}", title="",
        caption=f"Dots: each car's own value, with 90 % intervals. Area: {area}.",
        svg=picture_svg(_WIDTH, height, parts, f"{common.name}: {name} by car"),
    )  # fmt: skip


def _span(every: Sequence[Estimate]) -> tuple[float, float]:
    """Return a span that shows all values, and of intervals as much as is worth it."""
    values = [e.value for e in every]
    widths = sorted(e.high - e.low for e in every)
    wide = max(max(values) - min(values), widths[0], 1e-6)
    low = max(min(e.low for e in every), min(values) - _MAX_SPREADS * wide)
    high = min(max(e.high for e in every), max(values) + _MAX_SPREADS * wide)
    margin = 0.08 * (high - low)
    return low - margin, high + margin
