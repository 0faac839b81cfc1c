"""Numbers of a car and its sensors that change while it drives: once, evenly, or for a while."""

import math
from dataclasses import dataclass

import numpy as np


def share_of(t, since, until, back=math.inf):
    """Return how far a change is at times, 0 to 1, that goes on from one to another, then back."""
    return np.clip((t - since) / max(until - since, 1e-9), 0.0, 1.0) * (t < back)


@dataclass(frozen=True)
class Changing:
    """Two sets of numbers, and when the one turns into the other [s]; both the same: a step.

    At `back` they are as before again.
    """

    before: dict[str, float]
    after: dict[str, float]
    since: float
    until: float
    back: float = math.inf

    def share(self, t):
        """Return how far the change is at times, 0 to 1."""
        return share_of(t, self.since, self.until, self.back)

    def at(self, t):
        """Return all numbers at a time."""
        share = float(self.share(t))
        return {
            name: before + share * (self.after[name] - before)
            for name, before in self.before.items()
        }


def at(numbers, t):
    """Return numbers at a time, of those that change and of those that do not."""
    return numbers.at(t) if isinstance(numbers, Changing) else numbers


def over(numbers, name, t):
    """Return one number at each of some times."""
    if not isinstance(numbers, Changing):
        return np.full(len(t), numbers[name])
    return numbers.before[name] + numbers.share(t) * (numbers.after[name] - numbers.before[name])
