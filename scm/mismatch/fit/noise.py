"""How far a right model may be off: the least that any noise model allows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.replay.drive import Drive

ALIKE, ABRUPT = 0.003, 0.1
JOLTS = 0.05
LASTS_S = 2.0
MAX_LOW_NOISE = 3.0  # times the least noise: beyond that, noise may hide what is searched for
SLOWEST_MPS, STRAIGHTEST_RAD_S = 0.01, 0.01  # a drive straight ahead, without noise, turns by none


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

    A launch leaves a tenth of a throttle leap's speed open, a steering leap a tenth of its turning.
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
        launch=ABRUPT * fast, turn=ABRUPT * turning,
    )  # fmt: skip
