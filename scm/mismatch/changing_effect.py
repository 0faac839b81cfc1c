"""Effects that change during a recording: at a moment, or evenly over all of it.

An effect is tried as constant first. Beside that it may begin or change at a moment that is fitted
too. What a change gains must exceed what the best of all moments gains by chance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from scm.arrays import Floats
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.findings import Course
from scm.replay.numbers import BEFORE, SINCE, UNTIL

SINCE_NAME, BEFORE_NAME = "since_s", "_before"
EDGE_S = 5.0  # of a recording's begin and end, in which no change is searched for
EVERY_S = 3.0  # between the moments that are tried
LEAST_S = 20.0  # of a recording
STEADY = {"clock_drift", "surface_patch"}
"""Effects that do not change: a drifting clock is a change itself, a spot of floor is a place."""
RARE = 6.0  # what a change must gain beyond what chance gives: most faults have been there before


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangingEffect(Candidate):
    """An effect that changes during a recording, a candidate like those in the catalogue.

    Its parameters are those of the effect as it is in the end; then, if it was there before, as it
    was; then the moment of a step.

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
        since, until = self.change_s(values)
        for key in list(found):
            found |= {key + BEFORE: before[key], key + SINCE: since, key + UNTIL: until}
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
        return tuple(was + share * (now - was) for was, now in zip(before, end, strict=True))

    def change_s(self, values: Sequence[float]) -> tuple[float, float]:
        """Return when the change begins and ends, on the drive's clock [s]."""
        return self.span_s if self.course is Course.RAMP else (values[-1], values[-1])


def changing(effect: Candidate, course: Course, span_s: tuple[float, float], *,
             was_there: bool = False) -> ChangingEffect:  # fmt: skip
    """Return an effect that changes during a recording.

    Args:
        effect: Of the catalogue.
        course: A step or a ramp.
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
    if course is Course.STEP:
        bounds = span_s[0] + EDGE_S, span_s[1] - EDGE_S
        parameters.append(
            Parameter(SINCE_NAME, effect.parameters[0].key + SINCE, "s", bounds, bounds[1], 1.0)
        )
        moments = [(float(t),) for t in moments_in(span_s)]
    level = effect.starts[0] * (2 if was_there else 1)
    return ChangingEffect(
        name=effect.name, equation=effect.equation,
        depends_on=(*(word for word in effect.depends_on if word != "constant"), "time"),
        parameters=tuple(parameters), starts=tuple((*level, *moment) for moment in moments),
        sentence=effect.sentence, rare=effect.rare + RARE, like=effect.like, shared=effect.shared,
        of=effect, course=course, span_s=span_s, was_there=was_there,
    )  # fmt: skip


def moments_in(span_s: tuple[float, float]) -> Floats:
    """Return the moments at which a change is tried [s]."""
    first, last = span_s[0] + EDGE_S, span_s[1] - EDGE_S
    return np.linspace(first, last, max(round((last - first) / EVERY_S), 1) + 1)


def may_change(effect: Candidate) -> bool:
    """Return whether an effect is one that may change during a recording."""
    return type(effect) is Candidate and effect.name not in STEADY
