"""Begins a selection again from what a plain bicycle shows that follows the car better.

Adding one effect at a time, a search may go down a valley that it cannot leave. The bicycle was
fitted from many starts, and each of its numbers stands for an effect: a delay, a trim, a gain.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from scm.mismatch.budget import Question
from scm.mismatch.effect_catalogue import Candidate, terms_needed
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis, together
from scm.mismatch.select.confirm import confirmed, prune, with_placed_moments
from scm.mismatch.select.round import Context, fit_with_noise
from scm.mismatch.select.search import by_windows, select_many
from scm.mismatch.select.selected import Selected, tried_of
from scm.replay.commands import FULL_SPEED
from scm.vehicles.car import Car

LIMIT, WHEELBASE = "steering.limit_rad", "body.wheelbase_m"
UNCHANGED = 1.0
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
    return None if begun is None else _continued(*begun)


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


def _continued(selected: Selected, first: Hypothesis) -> Selected | None:
    """Return what is selected from a hypothesis on, as far as time goes."""
    context, retuned = selected.context, selected.retuned
    selection = select_many(context, retuned, first)
    unseen = selected.parts.confirm.weight
    end, denied = confirmed(
        context, with_placed_moments(context, selection.best, unseen), retuned, unseen
    )
    if not end.effects:
        return None
    rounds = (*selection.rounds, *selected.selection.rounds)  # some effects are of the first search
    return replace(
        selected, selection=replace(selection, best=end, rounds=rounds), denied=denied,
        offered=None, discovery=None,
        tried=tried_of(context, selection) or selected.tried,
    )  # fmt: skip


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
    effects = (*base.effects, *more)
    started = np.concatenate((base.values, [values[effect.name] for effect in more]))
    own = base.model.simulator.numbers(base.z)
    e, _ = base.model([together(own, effects, started)])
    score = float(Fitter(base.model, context.part).score(e, base.z)[0])
    return replace(
        base, effects=effects, values=started, innovations=e[:, 0], score=score,
        jacobian=np.zeros((0, 0)), covariance=np.zeros((0, 0)),
    )  # fmt: skip
