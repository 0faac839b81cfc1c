"""The belief about noise under which what is left of a fit is most likely."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from scm.arrays import Floats
from scm.mismatch.likelihood import Likelihood
from scm.mismatch.noise import Noise, usual_noise

LEAST_NOISE = 0.7  # of the noise stated, where a channel seems quieter
Change = Callable[[Noise, float], Noise]


def learn_noise(model: Likelihood, residuals: Sequence[Sequence[Floats]], rounds: int = 2) -> Noise:
    """Return the belief under which residuals are most likely, by steps of two.

    Steps begin at what is believed now and at the least: a poor model before this one may have
    raised disturbances that no single step takes back.
    """

    def cost(noise: Noise) -> float:
        model.believe(noise)
        e = model.weigh(residuals)
        return float(model.settled @ ((e * e).sum(axis=1) + model.log_size))

    least = usual_noise(model.drives)
    starts = [model.noise] if model.noise == least else [model.noise, least]
    found = [_descended(cost, start, least, rounds) for start in starts]
    best = min(found, key=lambda one: one[1] if math.isfinite(one[1]) else math.inf)[0]
    model.believe(best)
    return best


def _descended(
    cost: Callable[[Noise], float], best: Noise, least: Noise, rounds: int
) -> tuple[Noise, float]:
    """Return where steps from one belief end, and its cost."""
    lowest = cost(best)
    for _ in range(rounds):
        for change in _CHANGES:
            for factor in (2.0, 0.5):
                while True:
                    other = _at_least(change(best, factor), least)
                    if other == best:
                        break
                    value = cost(other)
                    if not value <= lowest - 2.0:  # no number is no improvement either
                        break
                    best, lowest = other, value
    return best, lowest


def _at_least(noise: Noise, least: Noise) -> Noise:
    """Return a belief no smaller than another one in anything."""
    return Noise(
        max(noise.speed, least.speed), max(noise.side, least.side),
        max(noise.yaw_rate, least.yaw_rate),
        {k: max(v, least.own[k]) for k, v in noise.own.items()},
        {k: max(v, LEAST_NOISE) for k, v in noise.scale.items()},
        noise.lasts_s, max(noise.launch, least.launch), max(noise.turn, least.turn),
    )  # fmt: skip


def _own(*kinds: str) -> Change:
    def change(noise: Noise, factor: float) -> Noise:
        own = {k: v * factor if k.startswith(kinds) else v for k, v in noise.own.items()}
        return replace(noise, own=own)

    return change


def _scale(*kinds: str) -> Change:
    def change(noise: Noise, factor: float) -> Noise:
        scale = {
            k: v * np.sqrt(factor) if k.startswith(kinds) else v for k, v in noise.scale.items()
        }
        return replace(noise, scale=scale)

    return change


_CHANGES: tuple[Change, ...] = (
    lambda n, f: replace(n, launch=n.launch * f),
    lambda n, f: replace(n, turn=n.turn * f),
    lambda n, f: replace(n, speed=n.speed * f),
    lambda n, f: replace(n, side=n.side * f),
    lambda n, f: replace(n, yaw_rate=n.yaw_rate * f),
    _own("encoder.", "wheel_speed."),
    _own("imu.accel_x"),
    _own("imu.accel_y"),
    _scale("imu.accel_x"),
    _scale("imu.accel_y"),
    _scale("imu.gyro_z", "yaw_rate"),
    _scale("encoder."),
)
