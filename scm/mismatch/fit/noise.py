"""How far a right model may be off: the noise model, and the one that fits residuals best."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from scm.arrays import Floats
from scm.mismatch.fit.rollouts import THREADS
from scm.replay.drive import Drive
from scm.vehicles.fleet_rows import pool

if TYPE_CHECKING:
    from scm.mismatch.fit.likelihood import Likelihood

ALIKE = 0.003
LAUNCH, TURN = 0.03, 0.05  # healthy cars of many unlike equations: 0.005 and 0.04 at most
MUCH = 0.1  # of either: a real car's
JOLTS = 0.05
LASTS_S = 2.0
MAX_LOW_NOISE = 3.0  # times the least noise: beyond that, noise may hide what is searched for
SLOWEST_MPS, STRAIGHTEST_RAD_S = 0.01, 0.01  # a drive straight ahead, without noise, turns by none
LEAST_NOISE = 0.7  # of the noise stated, where a channel seems quieter
FACTORS = 2.0, 0.5


@dataclass(frozen=True, slots=True)
class Noise:
    """How far a right model may be off.

    Attributes:
        speed, side, yaw_rate: Shared disturbances [m/s, m/s, rad/s].
        own: Of each stream that has one, by channel [its rate's unit, or its own].
        lasts_s: How long disturbances last.
        scale: Factor on the noise of each stream, by channel.
        launch, turn: What a leap of the whole throttle adds to speed, wheels included, and one of
            the whole steering to yaw rate, for as long as a leap is felt: transients are where any
            car model is worst [m/s, rad/s].
    """

    speed: float
    side: float
    yaw_rate: float
    own: Mapping[str, float]
    scale: Mapping[str, float]
    lasts_s: float = 1.0
    launch: float = 0.0
    turn: float = 0.0


def lowered(noise: Noise, drives: Sequence[Drive]) -> Noise:
    """Return a noise model with disturbances of at most `MAX_LOW_NOISE` times a car's usual."""
    least = usual_noise(drives)
    return replace(
        noise,
        speed=min(noise.speed, MAX_LOW_NOISE * least.speed),
        side=min(noise.side, MAX_LOW_NOISE * least.side),
        yaw_rate=min(noise.yaw_rate, MAX_LOW_NOISE * least.yaw_rate),
        own={
            name: min(value, MAX_LOW_NOISE * least.own[name]) for name, value in noise.own.items()
        },
        launch=min(noise.launch, MAX_LOW_NOISE * least.launch),
        turn=min(noise.turn, MAX_LOW_NOISE * least.turn),
    )


def usual_noise(drives: Sequence[Drive]) -> Noise:
    """Return the least that any car model is off: 0.3 % of the usual speed and turning.

    A launch leaves 2 % of a throttle leap's speed open, a steering leap 5 % of its turning.
    It is never less: two simulators of the same car differ by as much.
    """
    speeds = [drive.pose_speed for drive in drives]
    turns = [np.abs(d.smoothed["pose.yaw"].rate) for d in drives]
    fast = max(float(np.percentile(np.concatenate(speeds), 90)), SLOWEST_MPS)
    turning = max(float(np.percentile(np.concatenate(turns), 90)), STRAIGHTEST_RAD_S)
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
        launch=LAUNCH * fast, turn=TURN * turning,
    )  # fmt: skip


def doublings(noise: Noise, drives: Sequence[Drive]) -> float:
    """Return how often the least disturbances were doubled, summed over their kinds.

    Of launches and steering leaps only what is much.
    """
    least = usual_noise(drives)
    found = [getattr(noise, k) / getattr(least, k) for k in ("speed", "side", "yaw_rate")]
    found += [noise.launch / least.launch * LAUNCH / MUCH, noise.turn / least.turn * TURN / MUCH]
    return float(np.log2(np.maximum(found, 1.0)).sum())


def fit_noise(
    model: "Likelihood", residuals: Sequence[Sequence[Floats]], rounds: int = 2
) -> "Likelihood":
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

    def __init__(self, model: "Likelihood", residuals: Sequence[Sequence[Floats]]) -> None:
        self._model, self._residuals = model, residuals
        self._known = dict[tuple[object, ...], float]()

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


def _key(noise: Noise) -> tuple[object, ...]:
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


Change = Callable[[Noise, float], Noise]


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
