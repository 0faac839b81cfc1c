"""Effects that change during a recording: at a moment, evenly over all of it, or for a while.

An effect is tried as constant first. Beside that it may begin or change at a moment that is fitted
too, and end at another. What a change gains must exceed what the best of all moments, or of all
pairs of them, gains by chance.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from scm.arrays import Floats
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.findings import Course
from scm.replay.numbers import BACK, BEFORE, SINCE, UNTIL

SINCE_NAME, UNTIL_NAME, BEFORE_NAME = "since_s", "until_s", "_before"
EDGE_S = 5.0  # of a recording's begin and end, in which no change is searched for
EVERY_S = 3.0  # between the moments that are tried
LEAST_APART = 2  # of these moments, between which an effect comes and goes
LEAST_S = 20.0  # of a recording
STEADY = {"clock_drift", "surface_patch"}
"""Effects that do not change: a drifting clock is a change itself, a spot of floor is a place."""
RARE = 6.0  # what each change must gain beyond what chance gives: most faults are always there
MOMENTS = {Course.STEP: 1, Course.INTERMITTENT: 2}
"""How many moments are fitted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangingEffect(Candidate):
    """An effect that changes during a recording, a candidate like those in the catalogue.

    Its parameters are those of the effect as it is in the end; then, if it was there before, as it
    was; then the moment of a step. Of one that comes and goes they are those while it is there, and
    the two moments.

    Attributes:
        of: The effect.
        course: How it changes.
        span_s: Of the recording, on the drive's clock.
    """

    of: Candidate
    course: Course
    span_s: tuple[float, float]
    was_there: bool = False

    def numbers(self, values: tuple[float, ...]) -> dict[str, float]:
        """Return the numbers by key: in the end, before, and when they change."""
        count = len(self.of.parameters)
        found = self.of.numbers(tuple(values[:count]))
        before = self.of.numbers(self.before(values))
        since, until, back = self.change_s(values)
        for key in list(found):
            found |= {key + BEFORE: before[key], key + SINCE: since, key + UNTIL: until}
            found |= {key + BACK: back} if self.course is Course.INTERMITTENT else {}
        return found

    def before(self, values: Sequence[float]) -> tuple[float, ...]:
        """Return the effect's parameters as they were before the change."""
        count = len(self.of.parameters)
        if self.was_there:
            return tuple(values[count : 2 * count])
        return tuple(parameter.neutral for parameter in self.of.parameters)

    @property
    def replaces_own(self) -> bool:
        """Whether it takes the place of the car's own numbers from the begin on."""
        return self.was_there

    def at(
        self, values: Sequence[float], share: float, own: Mapping[str, float] = MappingProxyType({})
    ) -> tuple[float, ...]:
        """Return the effect's parameters when a share of the change is done.

        Args:
            values: Of its parameters.
            share: 0 to 1.
            own: The car's own numbers by key, which are its own before the change.
        """
        before = [
            (own[one.key] - one.given) / one.per_unit
            if one.key in own and not self.was_there
            else was
            for one, was in zip(self.of.parameters, self.before(values), strict=True)
        ]
        end = values[: len(self.of.parameters)]
        return tuple(
            (1.0 - share) * was + share * now  # exact at both ends: these may be bounds
            for was, now in zip(before, end, strict=True)
        )

    @property
    def moments(self) -> int:
        """How many moments are fitted, the last of its parameters."""
        return MOMENTS.get(self.course, 0)

    def change_s(self, values: Sequence[float]) -> tuple[float, float, float]:
        """Return when the change begins and ends, and is taken back, on the drive's clock [s]."""
        if self.course is Course.RAMP:
            return (*self.span_s, math.inf)
        if self.course is Course.STEP:
            return values[-1], values[-1], math.inf
        return values[-2], values[-2], values[-1]

    def share(self, values: Sequence[float], t_s: float) -> float:
        """Return how far the change is done at a time on the drive's clock, 0 to 1."""
        since, until, back = self.change_s(values)
        if since < until:
            return min(max((t_s - since) / (until - since), 0.0), 1.0)
        return float(since <= t_s and (t_s < back or back == math.inf))


def changing(effect: Candidate, course: Course, span_s: tuple[float, float], *,
             was_there: bool = False) -> ChangingEffect:  # fmt: skip
    """Return an effect that changes during a recording.

    Args:
        effect: Of the catalogue.
        course: A step, a ramp, or coming and going.
        span_s: Of the recording, on the drive's clock.
        was_there: Whether it was there before the change, with numbers of its own.
    """
    parameters = list(effect.parameters)
    if was_there:
        parameters += [
            replace(one, name=one.name + BEFORE_NAME, key=one.key + BEFORE, own="")
            for one in effect.parameters
        ]
    moments: Sequence[tuple[float, ...]] = [()]
    count, key = MOMENTS.get(course, 0), effect.parameters[0].key
    if count:
        bounds = span_s[0] + EDGE_S, span_s[1] - EDGE_S
        fitted = ((SINCE_NAME, SINCE), (UNTIL_NAME, BACK))[:count]
        parameters += [
            Parameter(name, key + at, "s", bounds, bounds[1], 1.0) for name, at in fitted
        ]
        at = moments_in(span_s).tolist()
        moments = [(t,) for t in at] if count == 1 else [(at[i], at[j]) for i, j in pairs_of(at)]
    level = effect.starts[0] * (2 if was_there else 1)
    return ChangingEffect(
        name=effect.name, equation=effect.equation,
        depends_on=(*(word for word in effect.depends_on if word != "constant"), "time"),
        parameters=tuple(parameters), starts=tuple((*level, *moment) for moment in moments),
        sentence=effect.sentence, rare=effect.rare + RARE * max(count, 1), like=effect.like,
        shared=effect.shared, of=effect, course=course, span_s=span_s, was_there=was_there,
    )  # fmt: skip


def moments_in(span_s: tuple[float, float]) -> Floats:
    """Return the moments at which a change is tried [s]."""
    first, last = span_s[0] + EDGE_S, span_s[1] - EDGE_S
    return np.linspace(first, last, max(round((last - first) / EVERY_S), 1) + 1)


def pairs_of(moments: Sequence[float]) -> list[tuple[int, int]]:
    """Return the pairs of moments, by number, between which coming and going is tried."""
    return [
        (first, last)
        for first in range(len(moments))
        for last in range(first + LEAST_APART, len(moments))
    ]


def may_change(effect: Candidate) -> bool:
    """Return whether an effect is one that may change during a recording."""
    return type(effect) is Candidate and effect.name not in STEADY
