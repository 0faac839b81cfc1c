"""How well a car with given numbers explains recordings: weighed residuals of many sets at once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.drive import Drive
from scm.mismatch.predict import POSE_CLOCK, Prediction
from scm.mismatch.rollouts import COMMAND_CLOCK, Numbers, Rollouts
from scm.mismatch.whiten import Noise, Whitener
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
ALIKE, ABRUPT = 0.005, 0.1
JOLTS = 0.05
LASTS_S = 2.0
LEAST_NOISE = 0.7
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
    """

    def __init__(self, drives: Sequence[Drive], car: Car) -> None:
        self.car, self.drives = car, drives
        self._rollouts = [Rollouts(drive, car) for drive in drives]
        self.ordinary = ordinary_numbers(car, self._rollouts[0].params)
        self._predictions = [Prediction(drive) for drive in drives]
        self.believe(usual_noise(drives))
        self.runs = 0

    def believe(self, noise: Noise) -> None:
        """Take another belief about noise."""
        self.noise = noise
        self.whiteners = [Whitener(drive, noise) for drive in self.drives]
        self.t = np.concatenate([w.t for w in self.whiteners])

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
            motions = rollouts.run(sets)
            ok &= motions.ok
            found.append(prediction.residuals(motions, sets))
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


def clipped(ordinary: Ordinary, z: float) -> float:
    """Return a number at `z` standard deviations, within its bounds."""
    low, high = ordinary.bounds
    return float(min(max(ordinary.mean + z * ordinary.std, low), high))


def usual_noise(drives: Sequence[Drive]) -> Noise:
    """Return the least that any car model is off: half a per cent of the usual speed and turning.

    A launch leaves a tenth of a throttle leap's speed open, a steering leap a tenth of its turning. Less is
    never believed: two simulators of the same car differ by as much.
    """
    speeds = [np.hypot(d.smoothed["pose.x"].rate, d.smoothed["pose.y"].rate) for d in drives]
    turns = [np.abs(d.smoothed["pose.yaw"].rate) for d in drives]
    fast = float(np.percentile(np.concatenate(speeds), 90))
    turning = float(np.percentile(np.concatenate(turns), 90))
    own = dict[str, float]()
    for name in drives[0].names:
        if name.startswith(("encoder.", "wheel_speed.")):
            own[name] = ALIKE * fast
        elif name.startswith("imu.accel"):
            stream = drives[0].stream(name)
            own[name] = JOLTS * float(np.percentile(np.abs(stream.values), 90)) + 0.5 * stream.std
    scale = dict.fromkeys(drives[0].names, 1.0)
    return Noise(
        ALIKE * fast, ALIKE * fast, ALIKE * turning, own, scale, lasts_s=LASTS_S,
        launch=ABRUPT * fast, turn=ABRUPT * turning,
    )  # fmt: skip


def learn_noise(model: Likelihood, residuals: Sequence[Sequence[Floats]], rounds: int = 2) -> Noise:
    """Return the belief under which residuals are most likely, by steps of two."""

    def cost(noise: Noise) -> float:
        model.believe(noise)
        e = model.weigh(residuals)
        return float((e * e).sum() + model.log_size.sum())

    best = model.noise
    lowest = cost(best)
    least = usual_noise(model.drives)
    for _ in range(rounds):
        for change in _CHANGES:
            for factor in (2.0, 0.5):
                while True:
                    other = _at_least(change(best, factor), least)
                    if other == best:
                        break
                    value = cost(other)
                    if value > lowest - 2.0:
                        break
                    best, lowest = other, value
    model.believe(best)
    return best


def _at_least(noise: Noise, least: Noise) -> Noise:
    """Return a belief no smaller than another one in anything."""
    return Noise(
        max(noise.speed, least.speed), max(noise.side, least.side),
        max(noise.yaw_rate, least.yaw_rate),
        {k: max(v, least.own[k]) for k, v in noise.own.items()},
        {k: max(v, LEAST_NOISE) for k, v in noise.scale.items()},
        noise.lasts_s, max(noise.launch, least.launch), max(noise.turn, least.turn),
    )  # fmt: skip


def _own(kinds: tuple[str, ...]) -> "object":
    def change(noise: Noise, factor: float) -> Noise:
        own = {k: v * factor if k.startswith(kinds) else v for k, v in noise.own.items()}
        return replace(noise, own=own)

    return change


def _scale(kinds: tuple[str, ...]) -> "object":
    def change(noise: Noise, factor: float) -> Noise:
        scale = {k: v * np.sqrt(factor) if k.startswith(kinds) else v
                 for k, v in noise.scale.items()}
        return replace(noise, scale=scale)

    return change


_CHANGES = (
    lambda n, f: replace(n, launch=n.launch * f),
    lambda n, f: replace(n, turn=n.turn * f),
    lambda n, f: replace(n, speed=n.speed * f),
    lambda n, f: replace(n, side=n.side * f),
    lambda n, f: replace(n, yaw_rate=n.yaw_rate * f),
    _own(("encoder.", "wheel_speed.")),
    _own(("imu.accel_x",)),
    _own(("imu.accel_y",)),
    _scale(("imu.accel_x",)),
    _scale(("imu.accel_y",)),
    _scale(("imu.gyro_z", "yaw_rate")),
    _scale(("encoder.",)),
)
