"""Judges one diagnosis by its label: names, formulas, parameters."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from scm.mismatch.findings import Diagnosis, Effect, Verdict
from scm.mismatch.trial.known import parameters_of
from scm.mismatch.trial.labels import CONTROLS, Label

ALIKE = {
    "time": ("t", "phase in time", "period"),
    "heading": ("yaw", "direction", "direction of travel"),
    "position": ("x", "y", "place", "location", "x_m", "y_m", "map", "distance"),
    "speed": ("v", "vx", "velocity", "wheel speed"),
    "steering": (
        "steering angle", "wheel angle", "steering command", "command", "angle", "steering size",
    ),
    "side": ("steering sign", "steering side", "sign", "sign of steering", "left or right"),
    "phase": ("wheel phase", "wheel turn", "wheel rotation", "wheel position", "wheel revolution"),
    "throttle": ("drive command", "throttle command", "throttle sign"),
    "acceleration": ("accel_x", "along acceleration", "longitudinal acceleration"),
    "lateral acceleration": ("accel_y", "side acceleration"),
    "yaw rate": ("turn rate", "yaw_rate"),
}  # fmt: skip
ONE = {other: name for name, others in ALIKE.items() for other in others}
# No drive on a level floor, or no stamps, tell these apart: left undecided, they are right.
INDISTINGUISHABLE = {
    "payload": {"motor_gain"},
    "motor_gain": {"payload"},
    "grade": {"wind"},
    "wind": {"grade"},
    "pose_latency": {"clock_offset"},
}
TOGETHER = (
    {"force_x_n", "force_y_n"}, {"tilt_x", "tilt_y"}, {"x_m", "y_m"}, {"x_mps2", "y_mps2"},
)  # fmt: skip
ANGLES = {"uphill_rad", "toward_rad"}


def plain(words: Iterable[str]) -> frozenset[str]:
    """Return variables by their first names."""
    clean = (word.strip().lower().replace("_", " ") for word in words)
    return frozenset(ONE.get(word, word) for word in clean)


def same_variables(
    reported: Iterable[str], needs: Iterable[str], allows: Iterable[str] = ()
) -> bool:
    """Return whether all that is needed was reported, and nothing beside that is not allowed."""
    got, needed = plain(reported), plain(needs)
    return needed <= got <= needed | plain(allows)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a diagnosis was worth.

    Attributes:
        reported: Names, effects outside the library by their own.
        exact: The right names and nothing else; of a law outside, right in equation and variables.
        among: All that was concealed is among what it reported or left undecided.
        missed: It reported nothing where something was concealed.
        false_names: Reported, but not concealed.
        errors: Of every parameter found, relative to the size of its effect.
        covered: Whether each parameter's interval holds the true value.
    """

    label: Label
    reported: tuple[str, ...]
    exact: bool
    among: bool
    missed: bool
    false_names: tuple[str, ...]
    errors: tuple[float, ...]
    covered: tuple[bool, ...]
    runtime_s: float
    failed: str = ""


def score(label: Label, diagnosis: Diagnosis) -> Outcome:
    """Judge one diagnosis."""
    names = tuple(effect.name for effect in diagnosis.effects)
    if label.kind in CONTROLS:
        return _control(label, diagnosis, names)
    undecided = {name for group in diagnosis.undecided for name in group.between}
    right = {name for name in label.names if _was_reported(name, label, diagnosis)}
    false_names = tuple(
        e.name for e in diagnosis.effects
        if not _belongs(e, label) and not _is_indistinguishable(e.name, label, undecided)
    )  # fmt: skip
    reported = right | {name for name in label.names if name in undecided}
    nothing = diagnosis.verdict == Verdict.NONE and not names and not right
    pairs = [pair for effect in diagnosis.effects for pair in _compared(effect, label)]
    everything = len(right) == len(label.names) or _rightly_undecided(label, names, undecided)
    return Outcome(
        label=label,
        reported=names,
        exact=everything and not false_names and (bool(label.names) or nothing),
        among=reported == set(label.names),
        missed=bool(label.names) and nothing,
        false_names=false_names or (() if label.names or nothing else (diagnosis.verdict.value,)),
        errors=tuple(error for error, _ in pairs if error is not None),
        covered=tuple(inside for _, inside in pairs),
        runtime_s=diagnosis.runtime_s,
    )


def _control(label: Label, diagnosis: Diagnosis, names: tuple[str, ...]) -> Outcome:
    """Judge what was names of data that fits no car: a problem of the data, and no effects."""
    problems = tuple(problem.name for problem in diagnosis.data)
    return Outcome(
        label=label, reported=(*names, *problems), exact=bool(problems) and not names,
        among=bool(problems), missed=not problems and not names, false_names=names,
        errors=(), covered=(), runtime_s=diagnosis.runtime_s,
    )  # fmt: skip


def failed(label: Label, words: str) -> Outcome:
    """Return the outcome of a diagnosis that came to no end."""
    return Outcome(
        label=label, reported=(), exact=False, among=False, missed=bool(label.names),
        false_names=(), errors=(), covered=(), runtime_s=math.nan, failed=words,
    )  # fmt: skip


def is_right_discovery(effect: Effect, label: Label) -> bool:
    """Return whether a law outside the library has the right equation and variables."""
    return (
        not effect.is_known
        and effect.equation.value in label.equations
        and same_variables(effect.depends_on, label.needs, label.allows)
    )


def _was_reported(name: str, label: Label, diagnosis: Diagnosis) -> bool:
    if label.kind == "unlisted":
        return any(is_right_discovery(effect, label) for effect in diagnosis.effects)
    if name == "unit_error" and any(problem.name == "unit" for problem in diagnosis.data):
        return True
    return any(effect.is_known and effect.name == name for effect in diagnosis.effects)


def _belongs(effect: Effect, label: Label) -> bool:
    if label.kind == "unlisted":
        return is_right_discovery(effect, label)
    return effect.is_known and effect.name in label.names


def _is_indistinguishable(name: str, label: Label, undecided: set[str]) -> bool:
    """Return whether an effect is another name of what was left undecided."""
    alike = {name for name in label.names if name in undecided}
    return name in undecided and any(name in INDISTINGUISHABLE.get(other, set()) for other in alike)


def _rightly_undecided(label: Label, names: tuple[str, ...], undecided: set[str]) -> bool:
    """Return whether others were rightly left undecided."""
    for name in label.names:
        others = INDISTINGUISHABLE.get(name, set())
        if name not in names and not (
            others and name in undecided and undecided <= others | {name}
        ):
            return False
    return bool(label.names)


def _compared(effect: Effect, label: Label) -> list[tuple[float | None, bool]]:
    """Return (relative error, inside the interval) of each parameter whose truth is known."""
    if not effect.is_known or effect.name not in label.names:
        return []
    truth = label.parameters[label.names.index(effect.name)]
    found: list[tuple[float | None, bool]] = []
    for name, true in truth.items():
        got = effect.parameters.get(name)
        if got is None:
            continue
        off, low, high = got.value - true, got.low - true, got.high - true
        if name in ANGLES:
            turned = math.remainder(off, 2.0 * math.pi)
            off, low, high = turned, low - off + turned, high - off + turned
        size = _size(effect.name, name, truth)
        error = abs(off) / size if size > 1e-9 else None
        found.append((error, low <= 0.0 <= high))
    return found


def _size(effect: str, name: str, truth: Mapping[str, float]) -> float:
    """Return what an error of a parameter is measured by: how far it is from doing nothing."""
    if name in ANGLES:
        return 1.0
    if "radius_m" in truth and name in {"x_m", "y_m"}:
        return truth["radius_m"]
    for pair in TOGETHER:
        if name in pair:
            return math.hypot(*(truth.get(one, 0.0) for one in pair))
    known = parameters_of(effect).get(name)
    return abs(truth[name] - (known.neutral if known and name != "radius_m" else 0.0))
