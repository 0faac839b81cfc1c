"""Below the first screen: what an expert needs to check the verdict."""

import math
import platform
from collections.abc import Iterable
from importlib.metadata import version

from msgspec import structs

import scm
from scm.data_quality.problem import MOST_NAMED, DataProblem
from scm.mismatch.evidence import Evidence, RefittedParameter
from scm.mismatch.findings import Diagnosis, Effect, Fit
from scm.mismatch.report.drawings import Drawings
from scm.mismatch.report.first_screen import name_of
from scm.mismatch.report.html_text import around, figure, section, table, tag
from scm.mismatch.report.places import sensors, spans
from scm.mismatch.report.problems import of_recording
from scm.mismatch.report.wording import (
    capital,
    interval,
    joined,
    percent,
    pretty,
    quantities,
    quantity,
    short,
    title_of,
    unit_text,
)
from scm.vehicles.car import Car
from scm.vehicles.describe_effects import all_effects, params_of
from scm.vehicles.param import LogNormal, Normal, Param

_READING = (
    ("Free run", "The simulator starts from where the car was and then gets nothing but the "
     "recorded commands. How far it strays is the error."),
    ("Three parts", "The recording is cut into blocks. On some the numbers were fitted, by others "
     "the effect was chosen, and the last ones only confirm: errors there are honest."),
    ("Noise of measuring", "How far even a perfect simulator would stray from the recording, "
     "because poses are measured with noise and a window starts from such a pose."),
    ("90 %", "An interval or area that holds the truth nine times out of ten."),
    ("Ordinary numbers", "Mass, stall torque and the like may move within the scatter that the "
     "car file states. A number a little off is no physics left out, and is never called so."),
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
_NOTHING = 1e-4
_ERROR_NAMES = {
    "yaw": "heading",
    "gyro": "yaw rate, gyro",
    "wheel": "distance, wheels",
    "accel_x": "forward acceleration, IMU",
    "accel_y": "sideways acceleration, IMU",
}
_ERROR_UNITS = {"m": "m", "rad": "rad", "mps": "m/s", "s": "s"}


def expert_sections(
    diagnosis: Diagnosis, evidence: Evidence, drawings: Drawings, cars: tuple[Car, Car]
) -> str:
    """Return the sections below the first screen; `cars` are the given one and the patched one."""
    windows = around("div", "".join(map(figure, drawings.windows)), "windows")
    return "".join((
        section("where", "Where on the floor", _maps(diagnosis, drawings)),
        section("when", "When", figure(drawings.time_line)),
        section("curves", "The effect as a curve", _grid(map(figure, drawings.curves))),
        section("runs", "Free runs, before and after",
                _fit_table(diagnosis.fit), _grid(map(figure, drawings.errors)),
                _windows_head(drawings) + windows if drawings.windows else ""),
        section("numbers", "Numbers", _parameter_table(diagnosis),
                _beside(figure(drawings.numbers), _ordinary_table(evidence, cars[0])),
                "".join(tag("p", pretty(said)) for said in evidence.widened)),
        section("tried", "What was tried, and what ruled rivals out",
                _beside(figure(drawings.tried), _rival_table(diagnosis))),
        section("data", "The recording itself", _data_table(diagnosis, evidence)),
        section("reading", "How to read this page", _reading()),
        section("inputs", "Inputs and versions", _inputs(diagnosis, evidence, cars)),
    ))  # fmt: skip


def _grid(figures: Iterable[str]) -> str:
    inner = "".join(figures)
    return around("div", inner, "grid") if inner else ""


def _beside(picture: str, rows: str) -> str:
    """Return a picture and a table side by side where there is room."""
    return around("div", picture + rows, "grid beside") if picture or rows else ""


def _maps(diagnosis: Diagnosis, drawings: Drawings) -> str:
    if not drawings.maps:
        return ""
    boxes = any(found.where for found in diagnosis.located)
    said = (
        "The car's way on the floor, seen from above. Grey and thin: the simulator is right there, "
        "within noise. Blue or orange and wide: something else acts on the car. Where the car came "
        "by several times, the strongest lies on top."
        f"{' Boxes: where the error was found.' if boxes else ''}"
    )
    return tag("p", said) + _grid(map(figure, drawings.maps))


def _windows_head(drawings: Drawings) -> str:
    said = (
        "Windows that the fit did not see, in even steps from the one where the simulator was "
        "worst to the one where it was best: wide grey line the recording, dashed line before, "
        "full line after; the dot is where they start."
    )
    return tag("h3", f"{len(drawings.windows)} windows on the floor") + tag("p", said)


def _fit_table(fit: Fit | None) -> str:
    if fit is None:
        return ""
    rows: list[tuple[str, ...]] = []
    for name, words in _PART_NAMES.items():
        part = getattr(fit, name)
        rows.append((f"{capital(words)}: {part.windows} windows",))
        for key in part.before:
            title, unit = error_name(key)
            sides = (part.before, part.after, part.noise_floor)
            known = [side.get(key, math.nan) for side in sides]
            shown = zip(quantities(known, unit), sides, strict=True)
            values = [text if key in side else "" for text, side in shown]
            rows.append((title, *values))
    head = ("error", "before", "after", "noise alone")
    said = f"Root mean squares at the end of free runs of {quantity(fit.horizon_s, 's')}."
    return tag("p", said) + table(head, rows, (1, 2, 3)) if rows else ""


def error_name(key: str) -> tuple[str, str]:
    """Return the words and the unit of an error such as `position_m`."""
    stem, _, unit = key.rpartition("_")
    if unit not in _ERROR_UNITS:
        return key, "1"
    return _ERROR_NAMES.get(stem, stem.replace("_", " ")), _ERROR_UNITS[unit]


def _parameter_table(diagnosis: Diagnosis) -> str:
    rows = []
    for effect in diagnosis.effects:
        params = _params(effect)
        for name, estimate in effect.parameters.items():
            believed = _believed(params.get(name))
            words = name_of(name, estimate.unit)
            rows.append((capital(title_of(effect.name)), words, interval(estimate), believed))
    head = ("effect", "number", "found, with 90 % interval", "believed before any recording")
    return table(head, rows)


def _params(effect: Effect) -> dict[str, Param]:
    known = all_effects()
    params = params_of(known[effect.name]) if effect.name in known else []
    return {param.reported: param for param in params}


def _believed(param: Param | None) -> str:
    if param is None:
        return ""
    low, high = map(short, param.bounds)
    bounds = f"{low} to {high} {unit_text(param.unit)}".rstrip()
    if isinstance(param.prior, Normal):
        return f"{short(param.prior.mean)} ± {short(param.prior.std)}, within {bounds}"
    if isinstance(param.prior, LogNormal):
        return f"about {short(param.prior.median)}, within {bounds}"
    return bounds


def _ordinary_table(evidence: Evidence, car: Car) -> str:
    bounds = {param.key: param.bounds for term in car.terms for param in params_of(term)}
    rows = [_ordinary_row(o, bounds.get(o.key, (-math.inf, math.inf))) for o in evidence.refitted]
    return table(("ordinary number", "car file", "found (90 %)"), rows, (1, 2))


def _ordinary_row(o: RefittedParameter, bounds: tuple[float, float]) -> tuple[str, str, str]:
    """Return a number's row; what is far below its own scatter is nothing."""
    least, most = bounds
    ends = (o.found.value, max(o.found.low, least), min(o.found.high, most))
    value, low, high = (0.0 if abs(v) < _NOTHING * o.given_std else v for v in ends)
    given = f"{short(o.given)} ± {short(o.given_std)}"
    return o.key, given, f"{short(value)} ({short(low)} to {short(high)})"


def _rival_table(diagnosis: Diagnosis) -> str:
    rows = [
        (
            capital(title_of(effect.name)),
            title_of(rival.name),
            percent(rival.probability),
            rival.ruled_out_by,
        )
        for effect in diagnosis.effects
        for rival in effect.alternatives
    ]
    return table(("found", "rival", "probability", "ruled out by"), rows, (2,))


def _data_table(diagnosis: Diagnosis, evidence: Evidence) -> str:
    head = ("sensor", "problem", "what", "when", "put right", "record instead")
    rows = [_data_row(problem) for problem in _of_recordings(diagnosis.data, evidence)]
    nothing = tag("p", "Sensors were held against each other; nothing wrong was found.")
    return table(head, rows) or nothing


def _of_recordings(problems: Iterable[DataProblem], evidence: Evidence) -> list[DataProblem]:
    """Return problems, one for all recordings of which it says the same."""
    alike = dict[DataProblem, list[str]]()
    for problem in problems:
        recording, said = of_recording(problem.text, evidence)
        alike.setdefault(structs.replace(problem, text=said), []).append(recording)
    found = list[DataProblem]()
    for problem, names in alike.items():
        named = [name for name in dict.fromkeys(names) if name]
        every = joined(named) if len(named) <= MOST_NAMED else f"{len(named)} recordings"
        found.append(
            structs.replace(problem, text=f"{every}: {problem.text}") if named else problem
        )
    return found


def _data_row(problem: DataProblem) -> tuple[str, ...]:
    when = spans(problem.when_s) if problem.when_s else "all the time"
    corrected = problem.corrected or "left as it is"
    name = problem.name.replace("_", " ")
    return (sensors([problem.channel]), name, problem.text, when, corrected, problem.record_instead)


def _reading() -> str:
    return around("dl", "".join(tag("dt", word) + tag("dd", said) for word, said in _READING))


def _inputs(diagnosis: Diagnosis, evidence: Evidence, cars: tuple[Car, Car]) -> str:
    given, patched = cars
    new = [term.name for term in patched.terms if term not in given.terms]
    old = [fault.kind for fault in given.measures]
    new += [f.kind.name for f in patched.measures if f.kind not in old]
    rows = [
        ("recordings", ", ".join(evidence.recordings)),
        ("car file", str(given.path)),
        ("new in car.toml", ", ".join(new) or "nothing"),
        ("runtime", f"{diagnosis.runtime_s:.1f} s"),
        ("scm", scm.__version__),
        ("Python, NumPy, Numba", ", ".join((platform.python_version(), version("numpy"),
                                            version("numba")))),
    ]  # fmt: skip
    return table(("what", "which"), rows)
