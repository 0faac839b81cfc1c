"""Which effects several cars have in common: found in one, tried in all, fitted together.

Each car keeps its own numbers, its own other effects and its own noise; only the numbers of the
effect in question are one. Their normal equations, everything else profiled out, add up over the
cars, and Gauss-Newton steps on the sum are checked by refitting every car: no approximation stays.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.mismatch.discovery.decide import is_discovered
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.findings import Equation, Estimate
from scm.mismatch.select.round import Notify, penalty
from scm.mismatch.select.selected import Selected
from scm.mismatch.several.effect_in_car import LOOSE, EffectInCar, Quadratic, is_same
from scm.mismatch.several.findings import Agreement, CarAgreement, Cause, Common, conclusion
from scm.mismatch.validate.explain import EQUATION_ERROR, NINETY, WIDER, sentence_of

# Chi-square that one agreement in a thousand exceeds, by the number of parameters.
UNLIKELY = (10.8, 13.8, 16.3, 18.5)
STEPS, ENOUGH = 3, 0.5
LIKELY_SHARE, MAX_LIKELY = 0.4, 2


@dataclass(slots=True)
class Shared:
    """An effect that was tried in all cars.

    Attributes:
        adopted: By car, the selection with the effect at the shared value; where it is adopted.
    """

    common: Common
    adopted: dict[str, Selected]


def cause_of(effect: Candidate) -> Cause | None:
    """Return what is shared that an effect may come from; None for a car's own."""
    if is_discovered(effect):
        on_floor = "position" in effect.depends_on and effect.equation is not Equation.SENSOR
        return Cause.FLOOR if on_floor else None
    return Cause(effect.shared) if effect.shared else None


def compared(
    cars: Mapping[str, Selected], notify: Notify
) -> tuple[list[Common], dict[str, Selected]]:
    """Return every effect of what cars share that one found, or that all find only together.

    With them come the selections with the shared ones in their hypotheses.
    """
    now, found = dict(cars), list[Common]()
    for effect, start in _found_by_any(cars):
        shared = _try_in_all(now, effect, start, notify, searched_for=False)
        if shared is not None:
            found.append(shared.common)
            now |= shared.adopted
    tried = {common.name for common in found}
    for effect, start in _likely_together(now, tried):
        shared = _try_in_all(now, effect, start, notify, searched_for=True)
        if shared is not None:
            found.append(shared.common)
            now |= shared.adopted
    return found, now


def _found_by_any(cars: Mapping[str, Selected]) -> list[tuple[Candidate, Floats]]:
    """Return the effects of shared things that some car found, each once, with its values."""
    found = list[tuple[Candidate, Floats]]()
    for selected in cars.values():
        for effect, place in selected.best.each():
            values = selected.best.values[place]
            new = not any(is_same(effect, other) for other, _ in found)
            if cause_of(effect) is not None and new:
                found.append((effect, values))
    return found


def _likely_together(
    cars: Mapping[str, Selected], tried: set[str]
) -> list[tuple[Candidate, Floats]]:
    """Return effects that no car found, and of which all together may gain enough."""
    gains, starts = dict[str, float](), dict[str, tuple[float, Candidate, Floats]]()
    for selected in cars.values():
        for name, (gain, effect, values) in _tried(selected).items():
            gains[name] = gains.get(name, 0.0) + gain
            if gain > starts.get(name, (-math.inf,))[0]:
                starts[name] = gain, effect, values
    catalogue = max(len(s.context.catalogue) for s in cars.values())
    needed = {name: penalty((effect,), catalogue) for name, (_, effect, _) in starts.items()}
    likely = [n for n, gain in gains.items() if n not in tried and gain > LIKELY_SHARE * needed[n]]
    likely.sort(key=lambda name: -gains[name])
    return [starts[name][1:] for name in likely[:MAX_LIKELY]]


def _tried(selected: Selected) -> dict[str, tuple[float, Candidate, Floats]]:
    """Return what each effect of a shared thing gained alone in a car's first round, and where."""
    best: dict[str, tuple[float, Candidate, Floats]] = {}
    context = selected.context
    rounds = () if context.by_windows else selected.selection.rounds[:1]
    for one in rounds:
        bare = context.criterion(one.base)
        for alternative, criterion in zip(one.alternatives, one.criteria, strict=True):
            effect = alternative.effects[-1]
            if not effect.shared:
                continue
            paid = context.penalty((effect,))
            gain = bare + paid - criterion
            if gain > best.get(effect.name, (0.0,))[0]:
                best[effect.name] = (
                    gain,
                    effect,
                    alternative.values[-len(effect.parameters) :].copy(),
                )
    return best


def _try_in_all(
    cars: Mapping[str, Selected],
    effect: Candidate,
    start: Floats,
    notify: Notify,
    *,
    searched_for: bool,
) -> Shared | None:
    """Return an effect tried in all cars from the values that somebody found; None where no two do.

    If it was `searched_for`, no car found it: then the sum must pay for the whole catalogue.
    """
    in_cars = dict[str, EffectInCar]()
    for name, selected in cars.items():
        notify(f"trying in {name}: {effect.name.replace('_', ' ')}")
        in_cars[name] = EffectInCar(selected, effect, start)
    notify(f"fitting {effect.name.replace('_', ' ')} to all cars together")
    agreeing = _agreeing(in_cars)
    group = [in_cars[name] for name in agreeing]
    values, precision = _together(group)
    gains = {name: w.gain(w.at(values)) for name, w in in_cars.items()}
    if searched_for:
        catalogue = max(len(s.context.catalogue) for s in cars.values())
        if sum(gains[name] for name in agreeing) < penalty((effect,), catalogue):
            return None
    agreements = {
        name: _agreement(w, gains[name], agrees=name in agreeing, in_sum=searched_for)
        for name, w in in_cars.items()
    }
    seeing = [
        name
        for name, agreement in agreements.items()
        if agreement in (Agreement.CONFIRMS, Agreement.SUPPORTS)
    ]
    shared = len(seeing) > 1
    adopted = dict[str, Selected]()
    for name, in_car in in_cars.items():
        if shared and name in seeing and (in_car.alone or not is_discovered(effect)):
            adopted[name] = in_car.selected_with(in_car.at(values))
    if not shared:
        values, precision = _of_one(in_cars, values, precision)
        agreements = _against_one(in_cars, agreements)
        gains = {name: w.gain(w.at(values)) for name, w in in_cars.items()}
    common = _common(effect, in_cars, agreements, gains, values, precision, shared=shared)
    return Shared(common, adopted) if shared or not searched_for else None


def _of_one(
    in_cars: Mapping[str, EffectInCar], values: Floats, precision: Floats
) -> tuple[Floats, Floats]:
    """Return the value of the one car that found an effect, and how sure it is."""
    finders = [w.free for w in in_cars.values() if w.alone]
    best = max(finders, key=lambda t: float(np.trace(t.precision)), default=None)
    return (values, precision) if best is None else (best.values, best.precision)


def _against_one(
    in_cars: Mapping[str, EffectInCar], agreements: Mapping[str, Agreement]
) -> dict[str, Agreement]:
    """Return what each car shows of an effect that only one found."""
    finders = [name for name, w in in_cars.items() if w.alone]
    if len(finders) != 1:
        return dict(agreements)
    found = {finders[0]: Agreement.CONFIRMS}
    for name in in_cars:
        if name not in found:
            far = misses_of(name, finders, in_cars) >= _limit(in_cars[name])
            found[name] = Agreement.CONTRADICTS if far else Agreement.UNDECIDED
    return {name: found[name] for name in in_cars}


def _limit(in_car: EffectInCar) -> float:
    return UNLIKELY[min(len(in_car.effect.parameters), len(UNLIKELY)) - 1]


def _agreement(in_car: EffectInCar, gain: float, *, agrees: bool, in_sum: bool) -> Agreement:
    if not agrees:
        return Agreement.CONTRADICTS
    if in_car.alone or gain >= in_car.needed:
        return Agreement.CONFIRMS
    if in_sum and gain > 0.0:
        return Agreement.SUPPORTS
    return Agreement.UNDECIDED


def _agreeing(in_cars: Mapping[str, EffectInCar]) -> list[str]:
    """Return the cars whose own values agree; those that agree least with the others are left out.

    Where only two are left and disagree, the one that found nothing alone goes.
    """
    group = list(in_cars)
    while len(group) > 1:
        misses = {name: misses_of(name, group, in_cars) for name in group}
        worst = max(group, key=lambda name: (misses[name], _certain_of_none(in_cars[name])))
        if misses[worst] < _limit(in_cars[worst]):
            break
        if len(group) == 2:
            worst = min(group, key=lambda name: in_cars[name].gain(in_cars[name].free))
        group.remove(worst)
    return group


def _certain_of_none(in_car: EffectInCar) -> float:
    return -in_car.gain(in_car.free)


def misses_of(name: str, group: Sequence[str], in_cars: Mapping[str, EffectInCar]) -> float:
    """Return the squared deviation of a car's own value from that of others, in its std."""
    others = [in_cars[other].free for other in group if other != name]
    if not others:
        return 0.0
    mine, effect = in_cars[name].free, in_cars[name].effect
    value, precision = _combined(others, effect, mine.values)
    off = _apart(effect, mine.values, value) / _steps(effect)
    spread = _covariance(mine.precision) + _covariance(precision)
    spread = WIDER**2 * spread + np.diag(_unsure(effect, value) ** 2)
    return float(off @ np.linalg.solve(spread, off))


def _unsure(effect: Candidate, values: Floats) -> Floats:
    """Return by how many steps an effect's equation may be off, (parameters,)."""
    if effect.equation is Equation.SENSOR:
        return np.zeros(len(values))
    neutral = np.array([k.neutral for k in effect.parameters])
    return np.asarray(EQUATION_ERROR * np.abs(values - neutral) * effect.amounts / _steps(effect))


def _steps(effect: Candidate) -> Floats:
    return np.array([parameter.step for parameter in effect.parameters])


def _apart(effect: Candidate, values: Floats, others: Floats) -> Floats:
    """Return differences; those of directions the short way round."""
    turns = np.array([k.name == "uphill_rad" for k in effect.parameters])
    off = values - others
    return np.where(turns, (off + np.pi) % (2.0 * np.pi) - np.pi, off)


def _covariance(precision: Floats) -> Floats:
    return np.asarray(np.linalg.inv(precision + LOOSE * np.eye(len(precision))))


def _combined(parts: Sequence[Quadratic], effect: Candidate, near: Floats) -> tuple[Floats, Floats]:
    """Return the values at which several quadratics together are lowest, and their precision."""
    steps = _steps(effect)
    precision = np.sum([t.precision for t in parts], axis=0) + LOOSE * np.eye(len(near))
    moves = [t.precision @ (_apart(effect, t.values, near) / steps) - t.slope for t in parts]
    lowest = near + steps * np.linalg.solve(precision, np.sum(moves, axis=0))
    return lowest, np.asarray(precision)


def _together(group: Sequence[EffectInCar]) -> tuple[Floats, Floats]:
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


def _cost(parts: Sequence[Quadratic]) -> float:
    return sum(t.cost for t in parts)


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
    in_cars: Mapping[str, EffectInCar],
    agreements: Mapping[str, Agreement],
    gains: Mapping[str, float],
    values: Floats,
    precision: Floats,
    *,
    shared: bool,
) -> Common:
    cause = cause_of(effect) or Cause.CAMERA
    agreeing = [
        name for name, agreement in agreements.items() if agreement is not Agreement.CONTRADICTS
    ]
    cars = tuple(
        CarAgreement(
            car=name, agreement=agreements[name], alone=w.alone, gain=gains[name], needed=w.needed,
            misses=misses_of(name, [*agreeing, name], in_cars),
            own=estimates(w.effect, w.free.values, w.free.precision),
        )
        for name, w in in_cars.items()
    )  # fmt: skip
    numbers = estimates(effect, values, precision)
    return Common(
        name=effect.name, cause=cause, shared=shared, parameters=numbers,
        text=sentence_of(effect, numbers),
        conclusion=conclusion(cause, cars, shared=shared), cars=cars,
    )  # fmt: skip
