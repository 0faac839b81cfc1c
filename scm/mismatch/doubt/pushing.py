"""Acceleration of the pose against the accelerometer's, both through the same Gaussian.

Whatever the smoothing does to one side it does to the other, so the relation stays exact; and no
derivative of a raw pose is ever taken.
"""

import numpy as np

from scm.arrays import Floats
from scm.mismatch.doubt.suspicion import Measured, Relation
from scm.mismatch.doubt.track import Series, Track, grid
from scm.mismatch.doubt.whitened import fit

WIDTH_S = 0.15
STEP_S = 0.02
EVERY_S = 0.3
NAMES = ("along", "across", "angle", "bias_x", "bias_y", "ahead", "aside", "delay")
LEVER_STD = 0.5


def push_against(
    poses: Track, along: Series, across: Series, late: tuple[float, float] = (0.0, 0.0)
) -> Relation | None:
    """Compare the pose's acceleration with that of an accelerometer on the car.

    Args:
        along, across: Forward and leftward acceleration without gravity [m/s^2].
        late: Delay [s] and rate by which the pose's stamps are known to be late.

    Returns:
        `along`, `across`: scale of the sensor; `angle`: its turn on the car [rad]; `bias_x`,
        `bias_y` [m/s^2]; `ahead`, `aside` [m]: where it sits from the pose's point; `delay` [s] of
        the pose's stamps beyond `late`. None where too little overlaps.
    """
    width = max(WIDTH_S, 1.5 * poses.period_s)
    start = max(poses.t[0], along.t[0] + late[0], across.t[0] + late[0]) + 2.0 * width
    end = min(poses.t[-1], along.t[-1] + late[0], across.t[-1] + late[0]) - 2.0 * width
    if end - start < 40.0 * width:
        return None
    on = grid(start, end, STEP_S, width)
    yaw = np.interp(on.t, poses.t, poses.yaw)
    c, s = np.cos(yaw), np.sin(yaw)
    u = on.t - late[0] - late[1] * (on.t - poses.t[0])
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
    rows = slice(
        round(2.0 * width / STEP_S), -round(2.0 * width / STEP_S), round(2.0 * width / STEP_S)
    )
    priors = np.array([np.inf] * 5 + [LEVER_STD] * 2 + [np.inf])
    found = fit(measured[rows], columns[rows], priors)
    return Relation(
        pair=("pose.x", "imu.accel_x"), numbers=_numbers(found.values, found.std),
        noise=found.noise, rows=len(measured[rows]),
    )  # fmt: skip


def _numbers(values: Floats, std: Floats) -> dict[str, Measured]:
    numbers = {n: Measured(float(v), float(s)) for n, v, s in zip(NAMES, values, std, strict=True)}
    for name in ("along", "across"):
        k = numbers[name]
        bounded = k.value if abs(k.value) > 1e-6 else 1e-6
        numbers[name] = Measured(1.0 / bounded, k.std / bounded**2)
    return numbers
