"""The car as it was in each part of a recording during which something changed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from msgspec import structs

from scm.mismatch.changing_effect import ChangingEffect
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.findings import Course, Effect, Estimate
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.report.car_file import FILE
from scm.vehicles.car import Car

BEFORE = "before"  # the car as it was before something changed
DURING = "during"  # with what came and went
RECORDED = "recorded.toml"  # the car with laws that hold in its recording alone
RAMP_STAGES = 5  # cars that stand for a change over a whole recording


@dataclass(frozen=True, slots=True)
class Stage:
    """The car as it was in a part of a recording, from one time on to another on its clock [s].

    Attributes:
        file: Its name in a report; the last stage is the car found.
        at_once: Whether it begins at a moment, and not within what changes evenly.
    """

    car: Car
    file: str = FILE
    from_s: float = -math.inf
    until_s: float = math.inf
    at_once: bool = False


def shares_at(fitted: Hypothesis, t_s: float) -> tuple[float, ...]:
    """Return how far each effect's change is done at a time; 1 of one that does not change."""
    return tuple(
        effect.share(fitted.values[place].tolist(), t_s)
        if isinstance(effect, ChangingEffect)
        else 1.0
        for effect, place in fitted.each()
    )


def at_shares(fitted: Hypothesis, shares: Sequence[float]) -> Hypothesis:
    """Return a hypothesis without changes: each effect as it is when its share of them is done."""
    if not any(isinstance(effect, ChangingEffect) for effect in fitted.effects):
        return fitted
    own = fitted.model.simulator.numbers(fitted.z)
    effects, values, rows = list[Candidate](), list[float](), list(range(len(fitted.z)))
    for (effect, place), share in zip(fitted.each(), shares, strict=True):
        mine = fitted.values[place].tolist()
        if not isinstance(effect, ChangingEffect):
            effects.append(effect)
            values += mine
            rows += range(len(fitted.z) + place.start, len(fitted.z) + place.stop)
        elif share > 0.0 or effect.was_there:
            effects.append(effect.of)
            values += effect.at(mine, share, own)
            first = len(fitted.z) + place.start
            rows += range(first, first + len(effect.of.parameters))
    covariance = fitted.covariance
    if covariance.size:
        covariance = covariance[np.ix_(rows, rows)]
    return replace(
        fitted, effects=tuple(effects), values=np.array(values), covariance=covariance,
        jacobian=np.zeros((0, 0)),
    )  # fmt: skip


def is_of_recording(effect: Candidate) -> bool:
    """Return whether an effect is a law against its recording's own time, void in any other."""
    return isinstance(effect, DictionaryEffect) and effect.shape.word == "time"


def lasting(fitted: Hypothesis) -> Hypothesis:
    """Return a hypothesis without laws against its recording's own time."""
    if not any(map(is_of_recording, fitted.effects)):
        return fitted
    own = len(fitted.z)
    stay = [(effect, place) for effect, place in fitted.each() if not is_of_recording(effect)]
    values = [i for _, place in stay for i in range(place.start, place.stop)]
    covariance, rows = fitted.covariance, [*range(own), *(own + i for i in values)]
    if covariance.size:
        covariance = covariance[np.ix_(rows, rows)]
    return replace(
        fitted, effects=tuple(effect for effect, _ in stay), values=fitted.values[values],
        covariance=covariance, jacobian=np.zeros((0, 0)),
    )  # fmt: skip


def as_it_was(
    effect: Effect,
    candidate: Candidate,
    values: Sequence[float],
    share: float,
    own: Mapping[str, float],
) -> Effect | None:
    """Return what is stated of an effect when a share of its change is done; None: nothing.

    Args:
        effect: As it is stated in the end.
        candidate: What it was fitted as, with the `values` of its parameters.
        values: In the order of its parameters.
        share: 0 to 1. Between, intervals go from the one end's to the other's.
        own: The car's own numbers by key.
    """
    if not isinstance(candidate, ChangingEffect):
        return effect
    if share == 1.0:
        there = candidate.course is Course.INTERMITTENT
        return structs.replace(effect, course=Course.CONSTANT) if there else effect
    if share == 0.0 and not candidate.was_there:
        return None
    parameters = dict[str, Estimate]()
    for parameter, value in zip(
        candidate.of.parameters, candidate.at(values, share, own), strict=True
    ):
        end = effect.parameters[parameter.name]
        begin = effect.before.get(parameter.name)
        half = share * (end.high - end.low) / 2.0
        half += 0.0 if begin is None else (1.0 - share) * (begin.high - begin.low) / 2.0
        parameters[parameter.name] = structs.replace(
            end, value=value, low=value - half, high=value + half
        )
    return structs.replace(effect, parameters=parameters)


def moments_of(fitted: Hypothesis) -> set[float]:
    """Return when effects came, changed or went, on the drive's clock [s]."""
    return {
        moment
        for effect, place in fitted.each()
        if isinstance(effect, ChangingEffect) and effect.moments
        for moment in fitted.values[place].tolist()[-effect.moments :]
    }


def spans_of(fitted: Hypothesis) -> list[tuple[float, float, tuple[float, ...]]]:
    """Return spans of the recording, from the first to the last, and shares of changes in each."""
    times = moments_of(fitted)
    for effect in fitted.effects:
        if isinstance(effect, ChangingEffect) and effect.course is Course.RAMP:
            since, until = effect.span_s
            middles = (np.arange(RAMP_STAGES - 1) + 0.5) / (RAMP_STAGES - 1)
            times |= set((since + (until - since) * middles).tolist())
    return [
        (from_s, until_s, shares_at(fitted, 0.5 * (from_s + until_s)))
        for from_s, until_s in pairwise([-math.inf, *sorted(times), math.inf])
    ]
