"""How well a car with given numbers explains recordings: weighed residuals of many sets at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.drive import Drive
from scm.mismatch.noise import Noise, usual_noise
from scm.mismatch.predict import POSE_CLOCK, Prediction
from scm.mismatch.rollouts import COMMAND_CLOCK, Numbers, Rollouts
from scm.mismatch.whiten import Whitener
from scm.vehicles.car import Car
from scm.vehicles.param import Param


@dataclass(frozen=True, slots=True)
class Ordinary:
    """A number of the car file that is free within the scatter that the file states."""

    key: str
    mean: float
    std: float
    bounds: tuple[float, float]


LOCK = "drive.axle_lock"
_UNKNOWN = {LOCK: (0.5, 0.5)}  # what no car file says and every car has
SETTLED_S = 1.0
TIMING_S = 0.003  # no recording's stamps are better than that
LEAST_SCATTER = {"body.mass_kg": 0.06}  # cars are weighed without cables, tape and battery
_CLOCKS = tuple(
    Ordinary(key, 0.0, TIMING_S, (-3.0 * TIMING_S, 3.0 * TIMING_S))
    for key in (COMMAND_CLOCK, POSE_CLOCK)
)


def ordinary_numbers(car: Car, params: Sequence[Param]) -> tuple[Ordinary, ...]:
    """Return every number of a car's equations that its file says is uncertain."""
    found = dict[str, Ordinary]()
    for param in params:
        std = car.quantity(param.key).std
        if param.key in _UNKNOWN:
            mean, std = _UNKNOWN[param.key]
            found[param.key] = Ordinary(param.key, mean, std, param.bounds)
        elif param.fit and std:
            mean = car.value(param.key)
            std = max(std, LEAST_SCATTER.get(param.key, 0.0) * abs(mean))
            found[param.key] = Ordinary(param.key, mean, std, param.bounds)
    return (*found.values(), *_CLOCKS)


class Likelihood:
    """One car's recordings under one belief about noise.

    Attributes:
        ordinary: The car's own uncertain numbers, in the order of every `z`.
        t: Times of all innovations, (events,); `settled`: 0 while the start still matters, else 1.
    """

    def __init__(self, drives: Sequence[Drive], car: Car) -> None:
        self.car, self.drives = car, drives
        self._rollouts = [Rollouts(drive, car) for drive in drives]
        self.ordinary = ordinary_numbers(car, self._rollouts[0].params)
        self._predictions = [Prediction(drive) for drive in drives]
        self.believe(usual_noise(drives))
        self.runs = 0

    def unit(self, key: str) -> str:
        """Return the unit of one of the car's numbers."""
        return next((p.unit for p in self._rollouts[0].params if p.key == key), "s")

    def believe(self, noise: Noise) -> None:
        """Take another belief about noise."""
        self.noise = noise
        self.whiteners = [Whitener(drive, noise) for drive in self.drives]
        self.t = np.concatenate([w.t for w in self.whiteners])
        begun = [
            w.t > d.edges[0] + SETTLED_S for w, d in zip(self.whiteners, self.drives, strict=True)
        ]
        self.settled = np.concatenate(begun).astype(np.float64)

    @property
    def log_size(self) -> Floats:
        """Logarithm of each innovation's variance, (events,)."""
        return np.concatenate([w.log_size for w in self.whiteners])

    def residuals(self, sets: Sequence[Numbers]) -> tuple[list[list[Floats]], Bools]:
        """Return residuals of every drive's streams, and which sets stayed physical."""
        self.runs += len(sets)
        ok = np.ones(len(sets), dtype=np.bool_)
        found = []
        for rollouts, prediction in zip(self._rollouts, self._predictions, strict=True):
            left, fine = residuals_of(rollouts, prediction, sets)
            ok &= fine
            found.append(left)
        return found, ok

    def weigh(self, residuals: Sequence[Sequence[Floats]]) -> Floats:
        """Return the unit innovations of all drives, (events, sets)."""
        parts = [w.innovations(r) for w, r in zip(self.whiteners, residuals, strict=True)]
        return np.concatenate(parts, axis=0)

    def __call__(self, sets: Sequence[Numbers]) -> tuple[Floats, Bools]:
        """Return unit innovations of each set, (events, sets), and which stayed physical."""
        residuals, ok = self.residuals(sets)
        return self.weigh(residuals), ok

    def numbers(self, z: Floats) -> dict[str, float]:
        """Return the car's own numbers at `z` standard deviations from the file's."""
        return {o.key: clipped(o, v) for o, v in zip(self.ordinary, z, strict=True)}


def residuals_of(
    rollouts: Rollouts, prediction: Prediction, sets: Sequence[Numbers]
) -> tuple[list[Floats], Bools]:
    """Return residuals of each stream of one drive, (samples, sets), and which sets were fine."""
    done = rollouts.each(
        sets, lambda motions, some: (prediction.residuals(motions, some), motions.ok)
    )
    streams = [np.concatenate(parts, axis=1) for parts in zip(*(d[0] for d in done), strict=True)]
    return streams, np.concatenate([d[1] for d in done])


def clipped(ordinary: Ordinary, z: float) -> float:
    """Return a number at `z` standard deviations, within its bounds."""
    low, high = ordinary.bounds
    return float(min(max(ordinary.mean + z * ordinary.std, low), high))
