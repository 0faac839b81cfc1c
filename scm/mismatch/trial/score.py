"""Judges diagnoses by their labels: names, formulas, parameters; and all of them as one table."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.mismatch.effect_catalogue import identifications, params_of
from scm.mismatch.findings import Diagnosis, Effect, Estimate, Verdict
from scm.mismatch.trial.again import Ratio
from scm.mismatch.trial.labels import CONTROLS, COURSES, Label

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
TOGETHER = (
    {"force_x_n", "force_y_n"}, {"tilt_x", "tilt_y"}, {"x_m", "y_m"}, {"x_mps2", "y_mps2"},
)  # fmt: skip
ANGLES = {"uphill_rad", "toward_rad"}
NORMAL_95 = 1.959964
BARS = {
    "single": "exact 90, among 97", "pair": "among 75", "unlisted": "exact 80", "none": "exact 98",
    "step": "exact 85", "ramp": "exact 80", "intermittent": "exact 80",
    "shuffled": "exact 100", "other_car": "exact 100",
}  # fmt: skip
MOMENT_S = 3.0  # by which a moment may be off
CLEAR = 2.0
NEAR = 1.15
WORSE = 1.02  # of the re-tuned error: a car found is never worse


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
        late_s: By how much each moment of a change is off; empty: none was concealed, or found.
        moments_covered: Whether the interval of each holds the true one.
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
    late_s: tuple[float, ...] = ()
    moments_covered: tuple[bool, ...] = ()


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
    true = [at for at in (label.since_s, label.until_s) if at is not None]
    moments = list(zip(_moments_of(label, diagnosis), true, strict=False))
    if label.kind in COURSES:
        everything &= _has_course(label, diagnosis)
    if true:
        everything &= len(moments) == len(true)
        everything &= all(abs(at.value - t) <= MOMENT_S for at, t in moments)
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
        late_s=tuple(at.value - t for at, t in moments),
        moments_covered=tuple(at.low <= t <= at.high for at, t in moments),
    )


def _moments_of(label: Label, diagnosis: Diagnosis) -> list[Estimate]:
    """Return when a report has a concealed effect change; empty where it gives no moment."""
    named = (
        [at for at in (effect.since_s, effect.until_s) if at is not None]
        for effect in diagnosis.effects
        if effect.name in label.names
    )
    return next((moments for moments in named if moments), [])


def _has_course(label: Label, diagnosis: Diagnosis) -> bool:
    """Return whether the concealed effect was reported to change as it did."""
    return any(
        effect.name in label.names and effect.course == label.kind for effect in diagnosis.effects
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


def indistinguishable_from(name: str) -> set[str]:
    """Return effects that no drive on a level floor, or no stamps, tell from one."""
    known = identifications().get(name)
    like = {known.like} if known and known.like else set[str]()
    return like | ({"clock_offset"} if name == "pose_latency" else set())


def _is_indistinguishable(name: str, label: Label, undecided: set[str]) -> bool:
    """Return whether an effect is another name of what was left undecided."""
    alike = {name for name in label.names if name in undecided}
    return name in undecided and any(name in indistinguishable_from(other) for other in alike)


def _rightly_undecided(label: Label, names: tuple[str, ...], undecided: set[str]) -> bool:
    """Return whether others were rightly left undecided."""
    for name in label.names:
        others = indistinguishable_from(name)
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
    _, neutral = params_of(effect)
    return abs(truth[name] - (neutral.get(name, 0.0) if name != "radius_m" else 0.0))


def wilson(right: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share."""
    if of == 0:
        return 0.0, 1.0
    z2, share = NORMAL_95**2, right / of
    middle = (share + z2 / (2.0 * of)) / (1.0 + z2 / of)
    spread = NORMAL_95 * math.sqrt(share * (1.0 - share) / of + z2 / (4.0 * of * of))
    half = spread / (1.0 + z2 / of)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def lines(outcomes: Sequence[Outcome], ratios: Sequence[Ratio]) -> list[str]:
    """Return the whole table as text."""
    head = f"{'concealed':<26}{'cases':>6}"
    for title in ("exact", "among", "missed", "false names"):
        head += f"{title:>22}"
    head += "   bar [%]"
    found = [head]
    for kind, bar in BARS.items():
        some = [outcome for outcome in outcomes if outcome.label.kind == kind]
        found += _row(kind, some, bar)
        clear = [o for o in some if o.label.strength and min(o.label.strength) >= CLEAR]
        if clear and len(clear) < len(some):
            found += _row(f"  of these, {CLEAR:g} x floor up", clear)
    found += ["", *_parameters(outcomes), *_moments(outcomes), *_again(ratios), *_times(outcomes)]
    found += ["", *_confusions(outcomes)]
    families = _families(outcomes, ratios)
    return [*found, "", *families] if families else found


def _row(title: str, outcomes: Sequence[Outcome], bar: str = "") -> list[str]:
    if not outcomes:
        return []
    tests: tuple[Callable[[Outcome], bool], ...] = (
        lambda o: o.exact, lambda o: o.among, lambda o: o.missed, lambda o: bool(o.false_names),
    )  # fmt: skip
    text = f"{title:<26}{len(outcomes):>6}"
    for test in tests:
        text += f"{_share(sum(map(test, outcomes)), len(outcomes)):>22}"
    return [f"{text}   {bar}".rstrip()]


def _share(right: int, of: int) -> str:
    low, high = wilson(right, of)
    return f"{100 * right / of:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _parameters(outcomes: Iterable[Outcome]) -> list[str]:
    errors = [error for outcome in outcomes for error in outcome.errors]
    covered = [inside for outcome in outcomes for inside in outcome.covered]
    if not covered:
        return ["parameters: none found"]
    text = f"parameters: {len(covered)} found"
    if errors:
        middle, far = np.percentile(errors, (50, 90))
        text += f", error median {100 * middle:.1f} %, 90th percentile {100 * far:.0f} %"
    return [f"{text}; 90 % intervals hold the truth in {_share(sum(covered), len(covered))}"]


def _moments(outcomes: Iterable[Outcome]) -> list[str]:
    found = [pair for o in outcomes for pair in zip(o.late_s, o.moments_covered, strict=True)]
    if not found:
        return []
    late = np.abs([late_s for late_s, _ in found])
    near = _share(int((late <= MOMENT_S).sum()), len(found))
    inside = _share(sum(held for _, held in found), len(found))
    return [
        f"moments of changes: {len(found)} found, off by {np.median(late):.1f} s (median), within "
        f"{MOMENT_S:g} s in {near}; 90 % intervals hold the true one in {inside}"
    ]


def _again(ratios: Sequence[Ratio]) -> list[str]:
    if not ratios:
        return []
    found = [f"another drive: {len(ratios)} cars whose effect shows in free runs; error over"]
    of_nominal = [ratio.found_m / ratio.nominal_m for ratio in ratios]
    text = f"  the nominal car's: median {np.median(of_nominal):.2f} (bar 0.25)"
    least = [r.true_m / r.nominal_m for r in ratios if r.true_m]
    if least:
        text += f"; the true car itself, beside the noise of poses: {np.median(least):.2f}"
    found.append(text)
    of_tuned = [(r.found_m / r.retuned_m, r.case) for r in ratios if r.retuned_m]
    if of_tuned:
        worse = sorted([one for one in of_tuned if one[0] > WORSE], reverse=True)
        cases = ", ".join(f"{case} {ratio:.2f}" for ratio, case in worse) or "none"
        median = np.median([ratio for ratio, _ in of_tuned])
        found.append(f"  the re-tuned car's: median {median:.2f}; above {WORSE:g}: {cases}")
    of_true = [ratio.found_m / ratio.true_m for ratio in ratios if ratio.true_m]
    if of_true:
        near = _share(sum(ratio <= NEAR for ratio in of_true), len(of_true))
        found.append(f"  the true car's: median {np.median(of_true):.2f}, within {NEAR} in {near}")
        beyond = [_beyond(r.found_m, r.true_m) / _beyond(r.nominal_m, r.true_m)
                  for r in ratios if r.true_m and r.nominal_m > r.true_m]  # fmt: skip
        found.append(
            f"  the nominal car's, both beyond the true car's: median {np.median(beyond):.2f}"
        )
    of_discoveries = [r.found_m / r.nominal_m for r in ratios if r.true_m is None]
    if of_discoveries:
        half = _share(sum(ratio <= 0.5 for ratio in of_discoveries), len(of_discoveries))
        found.append(f"  the nominal car's, laws outside the library: at most half in {half}")
    return found


def _beyond(error_m: float, true_m: float) -> float:
    """Return what an error has beside the noise that the true car's has too."""
    return math.sqrt(max(error_m**2 - true_m**2, 0.0))


def _times(outcomes: Iterable[Outcome]) -> list[str]:
    times = [o.runtime_s for o in outcomes if math.isfinite(o.runtime_s)]
    if not times:
        return []
    return [f"time: median {np.median(times):.0f} s a case, longest {max(times):.0f} s"]


def _families(outcomes: Sequence[Outcome], ratios: Iterable[Ratio]) -> list[str]:
    """Return one line per value of each aspect of the families that labels have."""
    groups: dict[tuple[str, str | float], list[Outcome]] = {}
    for outcome in outcomes:
        for pair in outcome.label.family.items():
            groups.setdefault(pair, []).append(outcome)
    if not groups:
        return []
    errors = {ratio.case: ratio.found_m / ratio.nominal_m for ratio in ratios}
    rows = [f"{'family':<32}{'cases':>6}{'exact':>22}{'false names':>22}   error of nominal"]
    order = [aspect for aspect, _ in groups]
    for aspect, value in sorted(groups, key=lambda one: (order.index(one[0]), one[1])):
        some = groups[aspect, value]
        text = f"{f'{aspect} {value}':<32}{len(some):>6}"
        for count in (sum(o.exact for o in some), sum(bool(o.false_names) for o in some)):
            text += f"{_share(count, len(some)):>22}"
        known = [errors[o.label.case] for o in some if o.label.case in errors]
        rows.append(f"{text}   {np.median(known):.2f}" if known else text)
    return rows


def _confusions(outcomes: Iterable[Outcome]) -> list[str]:
    counted = Counter((_true(o.label), _reported(o)) for o in outcomes if not o.exact)
    rows = [f"  {n} x  {true}  ->  {reported}" for (true, reported), n in counted.most_common()]
    return ["not exact: concealed -> reported", *rows] if rows else ["all exact"]


def each(outcomes: Iterable[Outcome]) -> list[str]:
    """Return one line a case."""
    found = []
    for outcome in outcomes:
        label = outcome.label
        sizes = " ".join(f"{strength:.1f}x" for strength in label.strength)
        mark = "exact" if outcome.exact else "among" if outcome.among else "wrong"
        found.append(
            f"{label.case}  {label.car:<8} {mark:<6} {_true(label)} {sizes} -> {_reported(outcome)}"
        )
    return found


def _true(label: Label) -> str:
    nothing = "nothing" if label.kind == "none" else label.kind.replace("_", " ")
    return " + ".join(label.names) or nothing


def _reported(outcome: Outcome) -> str:
    return outcome.failed or " + ".join(outcome.reported) or "nothing"
