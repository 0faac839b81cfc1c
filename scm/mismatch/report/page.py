"""The page: one HTML file that loads nothing, and needs no script to be read.

Every text that goes in is escaped by `tag`.
"""

import math
import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.metadata import version
from pathlib import Path

import scm
from scm.data_quality.quality import MOST_NAMED, DataProblem
from scm.mismatch.evidence import RefittedParameter
from scm.mismatch.findings import Diagnosis, Fit, Witness
from scm.mismatch.report.panels import Panel
from scm.mismatch.report.plot import Picture, colours_css
from scm.mismatch.report.record import Report
from scm.mismatch.report.sentences import alike, sensors, spans
from scm.mismatch.report.wording import (
    bicycle_name,
    capital,
    error_name,
    interval,
    joined,
    name_of,
    percent,
    pretty,
    quantities,
    quantity,
    short,
    title_of,
    unit_text,
)
from scm.vehicles.car import Car
from scm.vehicles.describe_effects import all_effects, neutral_of, params_of
from scm.vehicles.param import LogNormal, Normal, Param

_CHAPTERS = {
    "where": "where",
    "when": "when",
    "curves": "the effect",
    "runs": "free runs",
    "numbers": "numbers",
    "tried": "what was tried",
    "data": "the recording",
    "reading": "how to read this",
    "inputs": "inputs",
}
_READING = (
    ("Free run", "The simulator starts from where the car was and then gets only the recorded "
     "commands. The error is how far it deviates."),
    ("Three parts", "The recording is cut into blocks. Some fit the numbers, others choose the "
     "effect, and the rest only confirm: errors there are honest."),
    ("Measurement noise", "How far even a perfect simulator would deviate from the recording, "
     "because poses are measured with noise and a window starts from such a pose."),
    ("90 %", "An interval or area that contains the true value nine times out of ten."),
    ("Nominal parameters", "Mass, stall torque and the like may move within the standard deviation "
     "that the car file states. A number that is a little off is not missing physics, and is never "
     "called so."),
    ("Gain and chance", "How much better an effect explains the recording, and how much the "
     "luckiest of all effects tried would gain by chance alone."),
    ("Undecided", "Two effects explain the recording equally well. More of the same drive does "
     "not help; the drive that is named does."),
)  # fmt: skip
_PART_NAMES = {
    "confirm": "the part that only confirms",
    "choose": "the part that chooses the effect",
    "fit": "the part that fits the numbers",
}
_BICYCLE = {
    "steering_gain_rad": ("wheel angle at full steering", "rad"),
    "steering_offset_rad": ("wheel angle straight ahead", "rad"),
    "steering_delay_s": ("delay of the steering", "s"),
    "understeer_s2_per_m2": ("understeer", "s^2/m^2"),
    "speed_gain_mps": ("speed per throttle beyond the dead-band", "m/s"),
    "dead_band": ("dead-band of the throttle", ""),
    "throttle_delay_s": ("delay of the throttle", "s"),
    "time_constant_s": ("time constant of the speed", "s"),
}
_NEGLIGIBLE = 1e-4  # of a parameter's standard deviation; less is written as zero
_SIDES = (
    '<input type="radio" name="side" id="show-before" checked>'
    '<label for="show-before">Before</label>'
    '<input type="radio" name="side" id="show-after"><label for="show-after">After</label>'
)
_CODE = re.compile(r"`([^`<>]+)`")
_KEY = re.compile(r"\w+\.[\w.*]+")  # such as `body.mass_kg`, which may be parted at its joints
_SCROLLS = ("scroll", "windows", "wide")
_JOINT = re.compile(r"([._])(?=\w)")
_BEFORE_UNIT = re.compile(r"(\d) (?=(?:%|[mcμ]?m|m?s|k?g|N|rad|m/s)\b|%)")


def page_html(report: Report, use: str) -> str:
    """Return the page; `use` says what to do with the files beside it."""
    below = _sections(report)
    body = first_screen(report) + tag("p", use, "use") + _links(below) + below
    return document(f"{report.evidence.vehicle}: {report.sentence}", body)


def document(title: str, body: str) -> str:
    """Return a whole page around HTML that is safe already."""
    style = colours_css() + Path(__file__).with_name("style.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        f"{around('main', body)}\n</body>\n</html>\n"
    )


def first_screen(report: Report) -> str:
    """Return what, where, how sure, how much better, and what to do."""
    diagnosis, evidence = report.diagnosis, report.evidence
    kind = str(diagnosis.verdict) if report.can_judge else "unable"
    recordings = "recordings" if len(evidence.recordings) > 1 else "recording"
    where = f"Car {evidence.vehicle}, {recordings} {joined(evidence.recordings) or 'unnamed'}"
    head = tag("p", where, "inputs") + tag("h1", report.sentence)
    head += "".join(tag("p", text) for text in (report.named, report.better) if text)
    bars, picture = "", report.pictures.better
    if picture and diagnosis.fit:
        title = f"Position error after {quantity(diagnosis.fit.horizon_s, 's')}, on unseen parts"
        bars = around("div", tag("h2", title) + around("div", picture.svg, "canvas"), "bars")
    other = report.other_problems
    link = '<a href="#data">Details below.</a>'
    return (
        around("header", around("div", head, "words") + bars, f"verdict {kind}")
        + around("div", "".join(map(panel_html, report.panels)), "cards")
        + (around("p", tag("span", other) + link, "corrected") if other else "")
    )


def panel_html(panel: Panel) -> str:
    """Return one card: what it is about, its title, and facts by name; empty ones are left out."""
    facts = "".join(tag("dt", name) + tag("dd", text) for name, text in panel.rows if text)
    head = tag("p", panel.label, "label") + tag("h2", panel.title)
    return around("article", head + around("dl", facts), f"card {panel.kind}")


def _links(below: str) -> str:
    """Return links to the sections that there are."""
    links = [
        f'<a href="#{name}">{words}</a>'
        for name, words in _CHAPTERS.items()
        if f'<section id="{name}">' in below
    ]
    return around("nav", tag("span", "For experts:") + "".join(links))


def _sections(report: Report) -> str:
    """Return what an expert needs to check the verdict."""
    diagnosis, evidence, pictures = report.diagnosis, report.evidence, report.pictures
    return "".join((
        section("where", "Where on the floor", _maps(report)),
        section("when", "When", figure(pictures.time_line)),
        section("curves", "The effect as a curve", _grid(map(figure, pictures.curves))),
        section("runs", "Free runs, before and after",
                _fit_table(diagnosis.fit), _grid(map(figure, pictures.errors)), _windows(report)),
        section("numbers", "Numbers", _parameter_table(diagnosis),
                _beside(figure(pictures.numbers), _refitted_table(evidence.refitted, report.given)),
                "".join(tag("p", pretty(text)) for text in evidence.widened)),
        section("tried", "What was tried, and what ruled alternatives out",
                _beside(figure(pictures.tried), _alternatives_table(diagnosis))),
        section("data", "The recording itself",
                _data_table(diagnosis.data, evidence.recordings)),
        section("reading", "How to read this page",
                around("dl", "".join(tag("dt", a) + tag("dd", b) for a, b in _READING))),
        section("inputs", "Inputs and versions", _inputs(report)),
    ))  # fmt: skip


def _grid(figures: Iterable[str]) -> str:
    inner = "".join(figures)
    return around("div", inner, "grid") if inner else ""


def _beside(picture: str, rows: str) -> str:
    """Return a picture and a table side by side where there is room."""
    return around("div", picture + rows, "grid beside") if picture or rows else ""


def _maps(report: Report) -> str:
    if not report.pictures.maps:
        return ""
    boxes = any(found.where for found in report.diagnosis.located)
    text = (
        "The car's path on the floor, seen from above. Grey and thin: the simulator is right "
        "there, within noise. Blue or orange and wide: something else acts on the car. Where the "
        "car passed several times, the strongest is on top."
        f"{' Boxes: where the error was found.' if boxes else ''}"
    )
    return tag("p", text) + _SIDES + _grid(map(figure, report.pictures.maps))


def _windows(report: Report) -> str:
    windows = report.pictures.windows
    if not windows:
        return ""
    text = (
        "From the window where the simulator was worst to the one where it was best, first those "
        "that the fit did not see: wide grey line the recording, dashed line before, full line "
        "after; the dot is the start. Below each, how the position error grows."
    )
    head = tag("h3", f"{len(windows)} windows on the floor") + tag("p", text)
    strip = "".join(map(figure, windows))
    return head + around("div", strip, "windows")


def _fit_table(fit: Fit | None) -> str:
    if fit is None:
        return ""
    rows: list[tuple[str, ...]] = []
    head = ["error", "before", "after", "noise alone"]
    head += ["its own numbers refitted alone"] if fit.retuned else []
    head += [bicycle_name(fit.witness)] if fit.witness else []
    for name, words in _PART_NAMES.items():
        part = getattr(fit, name)
        rows.append((f"{capital(words)}: {part.windows} windows",))
        others = _others(fit) if name == "confirm" else ()
        for key in part.before:
            title, unit = error_name(key)
            sides = (part.before, part.after, part.noise_floor, *others)
            known = [side.get(key, math.nan) for side in sides]
            shown = zip(quantities(known, unit), sides, strict=True)
            values = [value if key in side else "" for value, side in shown]
            rows.append((title, *values, *[""] * (len(head) - 1 - len(values))))
    text = f"Root mean squares at the end of free runs of {quantity(fit.horizon_s, 's')}."
    numbers = tuple(range(1, len(head)))
    return tag("p", text) + table(head, rows, numbers) + _bicycle(fit.witness) if rows else ""


def _others(fit: Fit) -> tuple[Mapping[str, float], ...]:
    """Return the errors on the part that only confirms of models beside the two cars."""
    found = () if fit.retuned is None else (fit.retuned,)
    plain = fit.witness
    return found if plain is None else (
        *found, {"position_m": plain.position_m, "yaw_rad": plain.yaw_rad})  # fmt: skip


def _bicycle(witness: Witness | None) -> str:
    """Return what the plain model is, and its numbers."""
    if witness is None:
        return ""
    numbers = []
    for name, value in witness.numbers.items():
        words, unit = _BICYCLE[name]
        numbers.append(f"{words} {quantity(value, unit) if unit else short(value)}")
    text = (
        f"The {bicycle_name(witness)} knows nothing of the simulator. It is fitted to the first "
        "two parts of the recording, and shows what a plain model reaches on the third: "
    )
    return tag("p", text + joined(numbers) + ".")


def _parameter_table(diagnosis: Diagnosis) -> str:
    rows = []
    for effect in diagnosis.effects:
        known = all_effects().get(effect.name)
        params = {param.reported: param for param in (params_of(known) if known else ())}
        neutral = neutral_of(known) if known else {}
        for name, estimate in effect.parameters.items():
            param = params.get(name)
            without = neutral.get(param.name) if param else None
            rows.append((
                capital(title_of(effect.name)), name_of(name, estimate.unit), interval(estimate),
                "" if without is None else f"{short(without)} {unit_text(estimate.unit)}".rstrip(),
                _prior(param) if param else "",
            ))  # fmt: skip
    head = ("effect", "number", "found, with 90 % interval", "without the effect",
            "before any recording")  # fmt: skip
    return table(head, rows)


def _prior(param: Param) -> str:
    """Return what is assumed of a parameter before any recording."""
    low, high = map(short, param.bounds)
    bounds = f"{low} to {high} {unit_text(param.unit)}".rstrip()
    if isinstance(param.prior, Normal):
        return f"{short(param.prior.mean)} ± {short(param.prior.std)}, within {bounds}"
    if isinstance(param.prior, LogNormal):
        return f"about {short(param.prior.median)}, within {bounds}"
    return bounds


def _refitted_table(refitted: Sequence[RefittedParameter], car: Car) -> str:
    bounds = {param.key: param.bounds for term in car.terms for param in params_of(term)}
    rows = [_refitted_row(one, bounds.get(one.key, (-math.inf, math.inf))) for one in refitted]
    return table(("nominal parameter", "car file", "found (90 %)"), rows, (1, 2))


def _refitted_row(one: RefittedParameter, bounds: tuple[float, float]) -> tuple[str, str, str]:
    """Return a parameter's row; what is far below its own standard deviation is zero."""
    least, most = bounds
    ends = (one.found.value, max(one.found.low, least), min(one.found.high, most))
    value, low, high = (0.0 if abs(v) < _NEGLIGIBLE * one.given_std else v for v in ends)
    given = f"{short(one.given)} ± {short(one.given_std)}"
    return one.key, given, f"{short(value)} ({short(low)} to {short(high)})"


def _alternatives_table(diagnosis: Diagnosis) -> str:
    rows = [
        (
            capital(title_of(effect.name)),
            title_of(one.name),
            percent(one.probability),
            one.ruled_out_by,
        )
        for effect in diagnosis.effects
        for one in effect.alternatives
    ]
    return table(("found", "alternative", "probability", "ruled out by"), rows, (2,))


def _data_table(problems: Sequence[DataProblem], recordings: Sequence[str]) -> str:
    head = ("sensor", "problem", "what", "when", "corrected", "record instead")
    rows = [
        _data_row(problem, named)
        for problem, _, named in alike(problems, recordings, by_channel=True)
    ]
    nothing = tag("p", "The sensors were compared with each other; no problem was found.")
    return table(head, rows) or nothing


def _data_row(problem: DataProblem, recordings: Sequence[str]) -> tuple[str, ...]:
    every = joined(recordings)
    if len(recordings) > MOST_NAMED:
        every = f"{len(recordings)} recordings"
    when = spans(problem.when_s) if problem.when_s else "all the time"
    return (
        sensors([problem.channel]),
        problem.name.replace("_", " "),
        f"{every}: {problem.text}" if every else problem.text,
        when,
        problem.corrected or "left as it is",
        problem.record_instead,
    )


def _inputs(report: Report) -> str:
    given, patched = report.given, report.patched
    new = [term.name for term in patched.terms if term not in given.terms]
    old = [fault.kind for fault in given.measures]
    new += [f.kind.name for f in patched.measures if f.kind not in old]
    rows = [
        ("recordings", ", ".join(report.evidence.recordings)),
        ("car file", str(given.path)),
        ("new in car.toml", ", ".join(new) or "nothing"),
        ("runtime", f"{report.diagnosis.runtime_s:.1f} s"),
        ("scm", scm.__version__),
        ("Python, NumPy, Numba", ", ".join((platform.python_version(), version("numpy"),
                                            version("numba")))),
    ]  # fmt: skip
    return table(("what", "which"), rows)


def tag(name: str, text: str, kind: str = "") -> str:
    """Return one element around a text; lines stay lines, and `this` is what to type."""
    lines = _BEFORE_UNIT.sub("\\1&nbsp;", escape(text)).replace("\n", "<br>")
    return around(name, _CODE.sub(r"<code>\1</code>", lines), kind)


def around(name: str, inner: str, kind: str = "") -> str:
    """Return one element around HTML that is safe already; what scrolls can get the focus."""
    kinds = f' class="{kind}"' if kind else ""
    kinds += ' tabindex="0"' if kind.partition(" ")[0] in _SCROLLS else ""
    return f"<{name}{kinds}>{inner}</{name}>"


def figure(picture: Picture | None) -> str:
    """Return a picture with its title and what to see; nothing for None."""
    if picture is None:
        return ""
    title = tag("h3", picture.title) if picture.title else ""
    caption = tag("figcaption", picture.caption) if picture.caption else ""
    return around(
        "figure",
        title + around("div", picture.svg, "wide canvas" if picture.wide else "canvas") + caption,
    )


def section(name: str, title: str, *inner: str) -> str:
    """Return a section; nothing where it would be empty."""
    body = "".join(inner)
    if not body:
        return ""
    return f'<section id="{name}">{tag("h2", title)}{body}</section>\n'


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Return a table of texts; a row of one text heads those below it.

    Columns whose index is in `numbers` stand at the right.
    """
    if not rows:
        return ""
    top = "".join(_cell("th", text, i in numbers) for i, text in enumerate(head))
    body = "".join(_row(row, head, numbers) for row in rows)
    inner = around("thead", around("tr", top)) + around("tbody", body)
    return around("div", around("table", inner), "scroll")


def _row(row: Sequence[str], head: Sequence[str], numbers: Sequence[int]) -> str:
    if len(row) == 1 < len(head):
        words = tag("b", row[0])
        return around("tr", f'<td class="heads" colspan="{len(head)}">{words}</td>')
    cells = [_cell("td", text, i in numbers) for i, text in enumerate(row)]
    named = zip(head, cells, strict=True)  # a narrow screen shows cells below each other
    return around("tr", "".join(f'<td data-head="{escape(h)}"{cell[3:]}' for h, cell in named))


def _cell(name: str, text: str, is_number: bool) -> str:
    cell = tag(name, text, "number" if is_number else "")
    return _JOINT.sub("\\1<wbr>", cell) if _KEY.fullmatch(text) else cell
