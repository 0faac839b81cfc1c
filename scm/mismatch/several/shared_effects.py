"""Which effects several cars have in common: found by one, asked of all, fitted together.

Each car keeps its own numbers, its own other effects and its own noise; only the numbers of the
effect in question are one. Their normal equations, everything else profiled out, add up over the
cars, and Gauss-Newton steps on the sum are checked by refitting every car: no approximation stays.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.mismatch.diagnose import Searched
from scm.mismatch.discovery.decide import is_discovered
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.findings import Equation, Estimate
from scm.mismatch.select.search import price
from scm.mismatch.several.findings import CarSight, Cause, Common, Sight
from scm.mismatch.several.verdict import conclusion
from scm.mismatch.several.witness import LOOSE, Told, Witness, is_same
from scm.mismatch.validate.explain import LAW, NINETY, WIDER, sentence_of

CAUSES: Mapping[str, Cause] = {
    "pose_latency": Cause.CAMERA, "clock_offset": Cause.CAMERA, "clock_drift": Cause.CAMERA,
    "pose_scale": Cause.CAMERA, "camera_tilt": Cause.CAMERA, "pose_point": Cause.TAGS,
    "pose_heading": Cause.TAGS, "grade": Cause.FLOOR, "surface_patch": Cause.FLOOR,
    "wind": Cause.FLOOR,
}  # fmt: skip
"""Effects of what all cars may share, by name; laws against position are the floor's too."""
UNLIKELY = (10.8, 13.8, 16.3, 18.5)  # chi-square that one agreement in a thousand exceeds, by knobs
STEPS, ENOUGH = 3, 0.5
HOPEFUL, MOST_HOPES = 0.4, 2
Notify = Callable[[str], None]


@dataclass(slots=True)
class Shared:
    """An effect that was asked of all cars.

    Attributes:
        taken: By car, the search with the effect at the shared value; where it is adopted.
    """

    common: Common
    taken: dict[str, Searched]


def cause_of(effect: Candidate) -> Cause | None:
    """Return what is shared that an effect may come from; None for a car's own."""
    if is_discovered(effect):
        on_floor = "position" in effect.depends_on and effect.equation is not Equation.SENSOR
        return Cause.FLOOR if on_floor else None
    return CAUSES.get(effect.name)


def compared(
    cars: Mapping[str, Searched], notify: Notify
) -> tuple[list[Common], dict[str, Searched]]:
    """Return every effect of what cars share that one found, or that all find only together.

    Args:
        cars: Searches by the cars' names.
        notify: Is told what is asked of whom.

    Returns:
        The effects, and the searches with the shared ones in their models.
    """
    now, found = dict(cars), list[Common]()
    for effect, start in _found_by_any(cars):
        shared = _asked(now, effect, start, notify, searched_for=False)
        if shared is not None:
            found.append(shared.common)
            now |= shared.taken
    asked = {common.name for common in found}
    for effect, start in _hoped_for(now, asked):
        shared = _asked(now, effect, start, notify, searched_for=True)
        if shared is not None:
            found.append(shared.common)
            now |= shared.taken
    return found, now


def _found_by_any(cars: Mapping[str, Searched]) -> list[tuple[Candidate, Floats]]:
    """Return the effects of shared things that some car found, each once, with its values."""
    found = list[tuple[Candidate, Floats]]()
    for searched in cars.values():
        at = 0
        for effect in searched.best.effects:
            values = searched.best.values[at : at + len(effect.parameters)]
            at += len(effect.parameters)
            new = not any(is_same(effect, other) for other, _ in found)
            if cause_of(effect) is not None and new:
                found.append((effect, values.copy()))
    return found


def _hoped_for(cars: Mapping[str, Searched], asked: set[str]) -> list[tuple[Candidate, Floats]]:
    """Return effects that no car found, and of which all together may gain enough."""
    gains, starts = dict[str, float](), dict[str, tuple[float, Candidate, Floats]]()
    for searched in cars.values():
        for name, (gain, effect, values) in _tried(searched).items():
            gains[name] = gains.get(name, 0.0) + gain
            if gain > starts.get(name, (-math.inf,))[0]:
                starts[name] = gain, effect, values
    listed = max(len(s.search.listed) for s in cars.values())
    asks = {name: price((effect,), listed) for name, (_, effect, _) in starts.items()}
    hopes = [n for n, gain in gains.items() if n not in asked and gain > HOPEFUL * asks[n]]
    hopes.sort(key=lambda name: -gains[name])
    return [starts[name][1:] for name in hopes[:MOST_HOPES]]


def _tried(searched: Searched) -> dict[str, tuple[float, Candidate, Floats]]:
    """Return what each effect of a shared thing gained alone in a car's first round, and where."""
    best: dict[str, tuple[float, Candidate, Floats]] = {}
    steps = [] if searched.rough else searched.search.steps[:1]
    for step in steps:
        bare = searched.search.criterion(step.base)
        for rival, criterion in zip(step.rivals, step.criteria, strict=True):
            effect = rival.effects[-1]
            if CAUSES.get(effect.name) is None:
                continue
            paid = searched.search.price((effect,))
            gain = bare + paid - criterion
            if gain > best.get(effect.name, (0.0,))[0]:
                best[effect.name] = gain, effect, rival.values[-len(effect.parameters) :].copy()
    return best


def _asked(
    cars: Mapping[str, Searched],
    effect: Candidate,
    start: Floats,
    notify: Notify,
    *,
    searched_for: bool,
) -> Shared | None:
    """Ask all cars about an effect; None where they were asked in vain.

    Args:
        cars: Searches by name.
        effect: Of a shared thing.
        start: Its values where somebody found it.
        notify: Is told.
        searched_for: Whether no car found it: then the sum must pay for the whole library.
    """
    witnesses = dict[str, Witness]()
    for name, searched in cars.items():
        notify(f"asking {name} about {effect.name.replace('_', ' ')}")
        witnesses[name] = Witness(searched, effect, start)
    notify(f"fitting {effect.name.replace('_', ' ')} to all cars together")
    agreeing = _agreeing(witnesses)
    group = [witnesses[name] for name in agreeing]
    values, precision = _together(group)
    gains = {name: w.gain(w.at(values)) for name, w in witnesses.items()}
    if searched_for:
        listed = max(len(s.search.listed) for s in cars.values())
        if sum(gains[name] for name in agreeing) < price((effect,), listed):
            _leave(witnesses)
            return None
    sights = {
        name: _sight(w, gains[name], agrees=name in agreeing, in_sum=searched_for)
        for name, w in witnesses.items()
    }
    seeing = [name for name, sight in sights.items() if sight in (Sight.SEES, Sight.ADDS)]
    shared = len(seeing) > 1
    taken = dict[str, Searched]()
    for name, witness in witnesses.items():
        if shared and name in seeing and (witness.alone or not is_discovered(effect)):
            taken[name] = witness.taken(witness.at(values))
        else:
            witness.left()
    if not shared:
        values, precision = _of_one(witnesses, values, precision)
        sights = _against_one(witnesses, sights)
        gains = {name: w.gain(w.at(values)) for name, w in witnesses.items()}
    common = _common(effect, witnesses, sights, gains, values, precision, shared=shared)
    return Shared(common, taken) if shared or not searched_for else None


def _leave(witnesses: Mapping[str, Witness]) -> None:
    for witness in witnesses.values():
        witness.left()


def _of_one(
    witnesses: Mapping[str, Witness], values: Floats, precision: Floats
) -> tuple[Floats, Floats]:
    """Return the value of the one car that found an effect, and how sure it is."""
    finders = [w.free for w in witnesses.values() if w.alone]
    best = max(finders, key=lambda t: float(np.trace(t.precision)), default=None)
    return (values, precision) if best is None else (best.values, best.precision)


def _against_one(witnesses: Mapping[str, Witness], sights: Mapping[str, Sight]) -> dict[str, Sight]:
    """Return what each car says of the only one that found an effect."""
    finders = [name for name, w in witnesses.items() if w.alone]
    if len(finders) != 1:
        return dict(sights)
    found = {finders[0]: Sight.SEES}
    for name in witnesses:
        if name not in found:
            far = misses_of(name, finders, witnesses) >= _limit(witnesses[name])
            found[name] = Sight.OTHERWISE if far else Sight.CANNOT_TELL
    return {name: found[name] for name in witnesses}


def _limit(witness: Witness) -> float:
    return UNLIKELY[min(len(witness.effect.parameters), len(UNLIKELY)) - 1]


def _sight(witness: Witness, gain: float, *, agrees: bool, in_sum: bool) -> Sight:
    if not agrees:
        return Sight.OTHERWISE
    if witness.alone or gain >= witness.needed:
        return Sight.SEES
    if in_sum and gain > 0.0:
        return Sight.ADDS
    return Sight.CANNOT_TELL


def _agreeing(witnesses: Mapping[str, Witness]) -> list[str]:
    """Return the cars whose own values agree; those that agree least with the others are left out.

    Where only two are left and disagree, the one that found nothing alone goes.
    """
    group = list(witnesses)
    while len(group) > 1:
        misses = {name: misses_of(name, group, witnesses) for name in group}
        worst = max(group, key=lambda name: (misses[name], _certain_of_none(witnesses[name])))
        if misses[worst] < _limit(witnesses[worst]):
            break
        if len(group) == 2:
            worst = min(group, key=lambda name: witnesses[name].gain(witnesses[name].free))
        group.remove(worst)
    return group


def _certain_of_none(witness: Witness) -> float:
    return -witness.gain(witness.free)


def misses_of(name: str, group: Sequence[str], witnesses: Mapping[str, Witness]) -> float:
    """Return the squared deviation of a car's own value from that of others, in its scatter."""
    others = [witnesses[other].free for other in group if other != name]
    if not others:
        return 0.0
    mine, effect = witnesses[name].free, witnesses[name].effect
    value, precision = _combined(others, effect, mine.values)
    off = _apart(effect, mine.values, value) / _steps(effect)
    spread = _covariance(mine.precision) + _covariance(precision)
    spread = WIDER**2 * spread + np.diag(_unsure(effect, value) ** 2)
    return float(off @ np.linalg.solve(spread, off))


def _unsure(effect: Candidate, values: Floats) -> Floats:
    """Return by how many steps an effect's equation may be off, (knobs,)."""
    if effect.equation is Equation.SENSOR:
        return np.zeros(len(values))
    neutral = np.array([k.neutral for k in effect.parameters])
    return np.asarray(LAW * np.abs(values - neutral) * effect.amounts / _steps(effect))


def _steps(effect: Candidate) -> Floats:
    return np.array([parameter.step for parameter in effect.parameters])


def _apart(effect: Candidate, values: Floats, others: Floats) -> Floats:
    """Return differences; those of directions the short way round."""
    turns = np.array([k.name == "uphill_rad" for k in effect.parameters])
    off = values - others
    return np.where(turns, (off + np.pi) % (2.0 * np.pi) - np.pi, off)


def _covariance(precision: Floats) -> Floats:
    return np.asarray(np.linalg.inv(precision + LOOSE * np.eye(len(precision))))


def _combined(told: Sequence[Told], effect: Candidate, near: Floats) -> tuple[Floats, Floats]:
    """Return the values at which several quadratics together are lowest, and their precision."""
    steps = _steps(effect)
    precision = np.sum([t.precision for t in told], axis=0) + LOOSE * np.eye(len(near))
    moves = [t.precision @ (_apart(effect, t.values, near) / steps) - t.slope for t in told]
    lowest = near + steps * np.linalg.solve(precision, np.sum(moves, axis=0))
    return lowest, np.asarray(precision)


def _together(group: Sequence[Witness]) -> tuple[Floats, Floats]:
    """Return the numbers that suit several cars best, and their precision: Gauss-Newton."""
    effect = group[0].effect
    low = np.max([[k.bounds[0] for k in w.effect.parameters] for w in group], axis=0)
    high = np.min([[k.bounds[1] for k in w.effect.parameters] for w in group], axis=0)
    surest = max(group, key=lambda w: w.gain(w.free))
    start, _ = _combined([w.free for w in group], effect, surest.free.values)
    best = min(
        ([w.at(np.clip(v, low, high)) for w in group] for v in (start, surest.free.values)),
        key=_cost,
    )
    for _ in range(STEPS):
        values, _ = _combined(best, effect, best[0].values)
        moved = [w.at(np.clip(values, low, high)) for w in group]
        if _cost(moved) > _cost(best) - ENOUGH:
            break
        best = moved
    return best[0].values, _combined(best, effect, best[0].values)[1]


def _cost(told: Sequence[Told]) -> float:
    return sum(t.cost for t in told)


def estimates(effect: Candidate, values: Floats, precision: Floats) -> dict[str, Estimate]:
    """Return an effect's numbers with intervals, as those of one car's diagnosis are made."""
    spread = WIDER * np.sqrt(np.maximum(_covariance(precision).diagonal(), 0.0))
    half = NINETY * _steps(effect) * np.hypot(spread, _unsure(effect, values))
    found = dict[str, Estimate]()
    for parameter, value, by in zip(effect.parameters, values, half, strict=True):
        low, high = parameter.bounds if parameter.name != "uphill_rad" else (-math.inf, math.inf)
        found[parameter.name] = Estimate(
            value=float(value), low=max(float(value - by), low), high=min(float(value + by), high),
            unit=parameter.unit,
        )  # fmt: skip
    return found


def _common(
    effect: Candidate,
    witnesses: Mapping[str, Witness],
    sights: Mapping[str, Sight],
    gains: Mapping[str, float],
    values: Floats,
    precision: Floats,
    *,
    shared: bool,
) -> Common:
    cause = cause_of(effect) or Cause.CAMERA
    agreeing = [name for name, sight in sights.items() if sight is not Sight.OTHERWISE]
    cars = tuple(
        CarSight(
            car=name, sight=sights[name], alone=w.alone, gain=gains[name], needed=w.needed,
            misses=misses_of(name, [*agreeing, name], witnesses),
            own=estimates(w.effect, w.free.values, w.free.precision),
        )
        for name, w in witnesses.items()
    )  # fmt: skip
    numbers = estimates(effect, values, precision)
    return Common(
        name=effect.name, cause=cause, shared=shared, parameters=numbers,
        said=sentence_of(effect, numbers),
        conclusion=conclusion(cause, cars, shared=shared), cars=cars,
    )  # fmt: skip
