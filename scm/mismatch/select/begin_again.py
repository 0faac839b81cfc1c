"""Begins a selection by residual windows again: from a plain bicycle, or with wider numbers.

Adding one effect at a time, a search may go down a valley that it cannot leave. The bicycle was
fitted from many starts, and each of its numbers stands for an effect: a delay, a trim, a gain.
Numbers of the car's file that end at an end of their scatter, whatever effects there are, were
guessed too surely: they get a wider one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from scm.arrays import Floats
from scm.mismatch.budget import Question
from scm.mismatch.effect_catalogue import Candidate, terms_needed
from scm.mismatch.fit.fitter import FARTHEST, Fitter
from scm.mismatch.fit.hypothesis import Hypothesis, together
from scm.mismatch.fit.likelihood import NominalParameter
from scm.mismatch.select.confirm import confirmed, prune, with_placed_moments
from scm.mismatch.select.round import Context, fit_with_noise
from scm.mismatch.select.search import by_windows, select_many
from scm.mismatch.select.selected import Selected, tried_of
from scm.replay.commands import FULL_SPEED
from scm.vehicles.car import Car

LIMIT, WHEELBASE = "steering.limit_rad", "body.wheelbase_m"
UNCHANGED = 1.0
AT_END, WIDER = 0.95, 2.0  # of a number's scatter: what is at its end, and what it gets then
Meaning = Callable[[Car, Mapping[str, float]], float]


def _speed_gain(car: Car, bicycle: Mapping[str, float]) -> float:
    """Return the gain of a drive that has a full speed; other drives begin as they are."""
    if not car.has(FULL_SPEED):
        return UNCHANGED
    return bicycle["speed_gain_mps"] / car.value(FULL_SPEED)


def _steering_gain(car: Car, bicycle: Mapping[str, float]) -> float:
    full = car.value(LIMIT) if car.has(LIMIT) else bicycle["steering_gain_rad"]
    return bicycle["steering_gain_rad"] / full


MEANINGS: dict[str, tuple[str, Meaning]] = {
    "steer_gain": ("steering_gain_rad", _steering_gain),
    "steer_trim": ("steering_offset_rad", lambda _, found: found["steering_offset_rad"]),
    "steer_delay": ("steering_delay_s", lambda _, found: found["steering_delay_s"]),
    "understeer": (
        "understeer_s2_per_m2",
        lambda car, found: found["understeer_s2_per_m2"] * car.value(WHEELBASE),
    ),
    "drive_gain": ("speed_gain_mps", _speed_gain),
    "drive_deadband": ("dead_band", lambda _, found: found["dead_band"]),
    "drive_delay": ("throttle_delay_s", lambda _, found: found["throttle_delay_s"]),
}
"""Of an effect with one parameter: the number of the bicycle that shows it, and what it means."""


def from_witness(selected: Selected, bicycle: Mapping[str, float]) -> Selected | None:
    """Return what a search by residual windows selects that begins where a bicycle points.

    Args:
        selected: What was found, and strays farther than the bicycle.
        bicycle: Its numbers by name, as `Witness.numbers`.

    Returns:
        None where there is no time for it, or where it finds no effect.
    """
    context = selected.context
    pointed = {
        effect.name: value
        for effect in context.catalogue
        if (value := _meant(selected.car, effect, bicycle)) is not None
    }
    if not pointed:
        return None
    context.notify(f"starting again from what a bicycle shows: {', '.join(pointed)}")
    begun = context.budget.attempt(Question.WITNESS, partial(_begun_again, selected, pointed))
    again = None if begun is None else _continued(*begun)
    return again if again and again.best.effects else None


def _begun_again(selected: Selected, pointed: Mapping[str, float]) -> tuple[Selected, Hypothesis]:
    """Return a selection by residual windows, and the hypothesis that it begins from."""
    context, retuned = selected.context, selected.retuned
    if not context.by_windows:
        kernel_car = selected.car.with_terms(terms_needed(selected.car))
        many = by_windows(context, selected.drives, kernel_car)
        context, retuned = many.context, many.retuned
        selected = replace(selected, context=context, parts=many.parts)
    more = [effect for effect in context.catalogue if effect.name in pointed]
    begun, best = [_with(context, retuned, more, pointed)], selected.best
    if best.effects and best.model.simulator is retuned.model.simulator:
        there = {*best.names, *(effect.like for effect in best.effects)}
        beside = [effect for effect in more if effect.name not in there]
        begun.append(_with(context, best, beside, pointed))
    found = [prune(context, fit_with_noise(context, one), retuned) for one in begun]
    again = replace(selected.selection, retuned=retuned)
    return replace(selected, context=context, selection=again), min(found, key=context.cost)


def _continued(selected: Selected, first: Hypothesis) -> Selected:
    """Return what is selected from a hypothesis on, as far as time goes."""
    context, retuned = selected.context, selected.retuned
    selection = select_many(context, retuned, first)
    unseen = selected.parts.confirm.weight
    end, denied = confirmed(
        context, with_placed_moments(context, selection.best, unseen), retuned, unseen
    )
    rounds = (*selection.rounds, *selected.selection.rounds)  # some effects are of the first search
    return replace(
        selected, selection=replace(selection, best=end, rounds=rounds), denied=denied,
        offered=None, discovery=None,
        tried=tried_of(context, selection) or selected.tried,
    )  # fmt: skip


def with_wider_numbers(selected: Selected) -> Selected | None:
    """Return what is selected where numbers that ended at their ends may lie farther off.

    Args:
        selected: What was found.

    Returns:
        None where it was not judged by residual windows, no number ended so, or time is up.
    """
    context = selected.context
    numbers = numbers_at_ends(selected.best) if context.by_windows else []
    if not numbers:
        return None
    context.notify(f"letting numbers scatter more widely: {', '.join(n.key for n in numbers)}")
    work = partial(_widened, selected, numbers)
    begun = context.budget.attempt(Question.WIDER, work)
    return None if begun is None else _continued(*begun)


def numbers_at_ends(fitted: Hypothesis) -> list[NominalParameter]:
    """Return the car's own numbers that end at an end of their scatter."""
    return [
        number
        for number, z in zip(fitted.model.nominal, fitted.z, strict=True)
        if abs(z) >= AT_END * FARTHEST and not number.key.startswith("clock.")
    ]


def _widened(
    selected: Selected, numbers: Sequence[NominalParameter]
) -> tuple[Selected, Hypothesis]:
    """Return a selection with wider numbers, and what it begins from: what was found."""
    best, own = selected.best, selected.best.model.simulator.numbers(selected.best.z)
    wider = {
        one.key: replace(selected.car.quantity(one.key), std=WIDER * one.std)
        for one in numbers
        if selected.car.has(one.key)
    }
    car = replace(selected.car, values={**selected.car.values, **wider})
    many = by_windows(selected.context, selected.drives, car.with_terms(terms_needed(car)))
    z = np.array([(own[one.key] - one.mean) / one.std for one in many.retuned.model.nominal])
    first = _at(many.context, many.retuned, z, best.effects, best.values)
    first = prune(many.context, fit_with_noise(many.context, first), many.retuned)
    again = replace(selected.selection, retuned=many.retuned)
    return replace(selected, context=many.context, parts=many.parts, selection=again), first


def _meant(car: Car, effect: Candidate, bicycle: Mapping[str, float]) -> float | None:
    """Return the value at which an effect begins; None where the bicycle does not show it."""
    name, meaning = MEANINGS.get(effect.name, ("", None))
    if meaning is None or name not in bicycle or len(effect.parameters) != 1:
        return None
    low, high = effect.parameters[0].bounds
    return float(np.clip(meaning(car, bicycle), low, high))


def _with(
    context: Context, base: Hypothesis, more: Sequence[Candidate], values: Mapping[str, float]
) -> Hypothesis:
    """Return a hypothesis with further effects at given values, not fitted yet."""
    started = np.concatenate((base.values, [values[effect.name] for effect in more]))
    return _at(context, base, base.z, (*base.effects, *more), started)


def _at(
    context: Context, base: Hypothesis, z: Floats, effects: tuple[Candidate, ...], values: Floats
) -> Hypothesis:
    """Return a hypothesis with other effects and numbers than one, not fitted yet."""
    own = base.model.simulator.numbers(z)
    e, _ = base.model([together(own, effects, values)])
    score = float(Fitter(base.model, context.part).score(e, z)[0])
    return replace(
        base, effects=effects, values=values, z=z, innovations=e[:, 0], score=score,
        jacobian=np.zeros((0, 0)), covariance=np.zeros((0, 0)),
    )  # fmt: skip
