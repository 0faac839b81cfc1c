"""The noise model under which the residuals of a fit are most likely."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from scm.arrays import Floats
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import Noise, usual_noise
from scm.mismatch.fit.rollouts import THREADS
from scm.vehicles.fleet_rows import pool

LEAST_NOISE = 0.7  # of the noise stated, where a channel seems quieter
FACTORS = 2.0, 0.5
Change = Callable[[Noise, float], Noise]
_Key = tuple[object, ...]


def fit_noise(
    model: Likelihood, residuals: Sequence[Sequence[Floats]], rounds: int = 2
) -> Likelihood:
    """Return the likelihood whose noise model makes residuals most likely, by steps of two.

    Steps begin at the present noise model and at the least one: a poor fit before this one may have
    raised disturbances that no single step takes back.
    """
    least, costs = usual_noise(model.drives), _Costs(model, residuals)
    starts = [model.noise] if model.noise == least else [model.noise, least]
    found = [_descended(costs, start, least, rounds) for start in starts]
    best = min(found, key=lambda one: one[1] if math.isfinite(one[1]) else math.inf)[0]
    return model.under(best)


class _Costs:
    """What residuals cost under noise models, each computed once.

    Beside the noise model requested, the next one that is not known yet is computed.
    """

    def __init__(self, model: Likelihood, residuals: Sequence[Sequence[Floats]]) -> None:
        self._model, self._residuals = model, residuals
        self._known = dict[_Key, float]()

    def __call__(self, noise: Noise, soon: Iterable[Noise] = ()) -> float:
        """Return the cost of a noise model.

        Args:
            noise: The noise model.
            soon: What will be requested if this one is no better.
        """
        key = _key(noise)
        if key not in self._known:
            new = (n for n in soon if _key(n) != key and _key(n) not in self._known)
            batch = [noise, *islice(new, THREADS - 1)]
            for one, cost in zip(batch, pool(THREADS).map(self._cost, batch), strict=True):
                self._known[_key(one)] = cost
        return self._known[key]

    def _cost(self, noise: Noise) -> float:
        whiteners = [whitener.under(noise) for whitener in self._model.whiteners]
        e = self._model.weigh(self._residuals, whiteners)
        log_size = np.concatenate([w.log_size for w in whiteners])
        return float(self._model.valid @ ((e * e).sum(axis=1) + log_size))


def _key(noise: Noise) -> _Key:
    of_streams = (tuple(one.items()) for one in (noise.own, noise.scale))
    shared = noise.speed, noise.side, noise.yaw_rate, noise.lasts_s, noise.launch, noise.turn
    return *shared, *of_streams


def _descended(costs: _Costs, best: Noise, least: Noise, rounds: int) -> tuple[Noise, float]:
    """Return where steps from one noise model end, and its cost."""
    lowest = costs(best, _steps(best, 0, least))
    for _ in range(rounds):
        for i, change in enumerate(_CHANGES):
            for factor in FACTORS:
                while True:
                    other = _at_least(change(best, factor), least)
                    if other == best:
                        break
                    value = costs(other, _steps(best, i, least))
                    if not value <= lowest - 2.0:  # no number is no improvement either
                        break
                    best, lowest = other, value
    return best, lowest


def _steps(noise: Noise, first: int, least: Noise) -> Iterator[Noise]:
    """Yield the noise models one step from `noise`, by the changes from `first` on."""
    for change in _CHANGES[first:]:
        for factor in FACTORS:
            yield _at_least(change(noise, factor), least)


def _at_least(noise: Noise, least: Noise) -> Noise:
    """Return a noise model no smaller than another one in anything."""
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
