"""A hypothesis: effects with their numbers, the noise model, and how well it explains recordings.

It is a value. A fit returns a new one; going back is keeping the older one.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from scm.arrays import Floats
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import Noise
from scm.replay.numbers import BEFORE


def numbers_of(effects: Sequence[Candidate], values: Floats) -> dict[str, float]:
    """Return the numbers of effects by key, given the values of their parameters in order."""
    found, at = dict[str, float](), 0
    for effect in effects:
        end = at + len(effect.parameters)
        found |= effect.numbers(tuple(values[at:end]))
        at = end
    return found


def together(
    own: Mapping[str, float], effects: Sequence[Candidate], values: Floats
) -> dict[str, float]:
    """Return a car's own numbers and those of effects, by key.

    Where an effect only moves a number, that begins as the car's own.
    """
    found = {**own, **numbers_of(effects, values)}
    for effect in effects:
        if not effect.replaces_own:
            keys = {parameter.key for parameter in effect.parameters}
            found |= {key + BEFORE: own[key] for key in keys & own.keys()}
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """Effects that may be missing, with the numbers that explain the recordings best so far.

    Attributes:
        model: The recordings under the noise model that goes with it.
        z: The car's own numbers, standard deviations from the file's.
        values: The effects' numbers, in the order of their parameters.
        innovations: Unit innovations, (events,).
        score: Their loss on the fitted part, and the prior's; lower is better.
        jacobian: Of the innovations by `z` and then by values over their parameters' steps,
            (events, n); empty where it was dropped.
        covariance: Of `z` and values over steps; empty where none was computed.
    """

    model: Likelihood
    effects: tuple[Candidate, ...]
    z: Floats
    values: Floats
    innovations: Floats
    score: float
    jacobian: Floats
    covariance: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def noise(self) -> Noise:
        """The noise model."""
        return self.model.noise

    @property
    def names(self) -> tuple[str, ...]:
        """The effects' names."""
        return tuple(effect.name for effect in self.effects)

    @property
    def parameters(self) -> list[Parameter]:
        """The effects' parameters, in the order of `values`."""
        return [parameter for effect in self.effects for parameter in effect.parameters]

    @property
    def numbers(self) -> dict[str, float]:
        """All numbers by key, the car's own first."""
        return together(self.model.simulator.numbers(self.z), self.effects, self.values)

    def each(self) -> Iterator[tuple[Candidate, slice]]:
        """Yield each effect and where its numbers stand in `values`."""
        at = 0
        for effect in self.effects:
            yield effect, slice(at, at + len(effect.parameters))
            at += len(effect.parameters)

    def place_of(self, effect: Candidate) -> slice:
        """Return where an effect's numbers stand in `values`."""
        return next(place for one, place in self.each() if one is effect)
