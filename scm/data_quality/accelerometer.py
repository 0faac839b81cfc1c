"""Acceleration of the pose against the accelerometer's, both through the same Gaussian.

Whatever the smoothing does to one side it does to the other, so the relation stays exact; and no
derivative of a raw pose is ever taken.
"""

import math

import numpy as np

from scm.arrays import Floats
from scm.data_quality.pose_track import (
    Series,
    Track,
    between_gaps_s,
    grid,
    long_gaps,
    series,
    without_pauses,
)
from scm.data_quality.quality import Measured, Relation
from scm.data_quality.whitened_fit import Fit, fit
from scm.recording.read import Recording

WIDTH_S = 0.15
STEP_S = 0.02
EVERY_S = 0.3
NAMES = ("along", "across", "angle", "bias_x", "bias_y", "ahead", "aside", "delay")
LEVER_STD = 0.5
HALF = 0.5
SHORTEST_S = 10.0


def push_of(
    recording: Recording, poses: Track, late: tuple[float, float] = (0.0, 0.0)
) -> Relation | None:
    """Compare the poses with the recording's accelerometer, None where it has none that moves."""
    along, across = (series(recording, f"imu.accel_{axis}") for axis in "xy")
    if along is None or across is None or min(np.ptp(along.values), np.ptp(across.values)) == 0.0:
        return None
    return push_against(poses, along, across, late)


def push_against(
    poses: Track, along: Series, across: Series, late: tuple[float, float] = (0.0, 0.0)
) -> Relation | None:
    """Compare the pose's acceleration with that of an accelerometer on the car.

    Args:
        poses: At the rear axle.
        along: Forward acceleration without gravity [m/s^2].
        across: To the left.
        late: Delay [s] and rate by which the pose's stamps are known to be late.

    Returns:
        `along`, `across`: scale of the sensor; `angle`: its turn on the car [rad]; `bias_x`,
        `bias_y` [m/s^2]; `ahead`, `aside` [m]: where it sits from the pose's point; `delay` [s] of
        the pose's stamps beyond `late`. None where too little overlaps.
    """
    width = max(WIDTH_S, 1.5 * poses.period_s)
    start = max(poses.t[0], along.t[0] + late[0], across.t[0] + late[0]) + 2.0 * width
    end = min(poses.t[-1], along.t[-1] + late[0], across.t[-1] + late[0]) - 2.0 * width
    gaps = long_gaps(poses.t, along.t + late[0], across.t + late[0])
    if between_gaps_s(start, end, gaps) < max(SHORTEST_S, 40.0 * width):
        return None
    on = grid(start, end, STEP_S, width, gaps)
    yaw = np.interp(on.t, poses.t, poses.yaw)
    c, s = np.cos(yaw), np.sin(yaw)
    u = on.t - late[0] - late[1] * without_pauses(on.t, float(poses.t[0]), gaps)
    ax, ay = along.at(u), across.at(u)

    def both(x: Floats, y: Floats, order: int = 0) -> Floats:
        return np.stack((on.smooth_even(x, order), on.smooth_even(y, order)), axis=1)

    measured = np.stack(
        (on.smooth(Series(poses.t, poses.x), 2), on.smooth(Series(poses.t, poses.y), 2)), axis=1
    )
    columns = np.stack(
        (
            both(c * ax, s * ax),
            both(-s * ay, c * ay),
            both(-c * ay - s * ax, -s * ay + c * ax),
            -both(c, s),
            -both(-s, c),
            -both(c, s, 2),
            -both(-s, c, 2),
            -both(c * ax - s * ay, s * ax + c * ay, 1),
        ),
        axis=2,
    )
    rows = on.inner(round(2.0 * width / STEP_S))
    priors = np.array([np.inf] * 5 + [LEVER_STD] * 2 + [np.inf])
    found = fit(measured[rows], columns[rows], priors, on.starts_of(rows))
    return Relation(
        pair=("pose.x", "imu.accel_x"), numbers=_numbers(found),
        noise=found.noise,
        rows=len(measured[rows]),
        step_s=max(poses.period_s, along.period_s),
    )  # fmt: skip


def _numbers(found: Fit) -> dict[str, Measured]:
    numbers = {
        name: Measured(float(value), float(std), float(leak))
        for name, value, std, leak in zip(NAMES, found.values, found.std, found.leak, strict=True)
    }
    turn, kx, ky = (numbers[name] for name in ("angle", "along", "across"))
    mean = 0.5 * (kx.value + ky.value)
    size = math.hypot(mean, turn.value)
    rigid = abs(kx.value - ky.value) < HALF * size
    turned = rigid and (mean > 0.0 or abs(turn.value) > HALF * size)
    if turned:
        std = turn.std / max(size, 1e-6)
        numbers["angle"] = Measured(math.atan2(turn.value, mean), std, turn.leak)
    for name in ("along", "across"):
        k = numbers[name]
        whole = k.value - mean + size if turned else k.value
        bounded = whole if abs(whole) > 1e-6 else 1e-6
        numbers[name] = Measured(1.0 / bounded, k.std / bounded**2, k.leak)
    return numbers
