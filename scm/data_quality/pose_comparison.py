"""The pose against other sensors: its heading against yaw, its acceleration against another's.

Of acceleration both sides are smoothed by one Gaussian: what that does to one side it does to the
other, so the relation stays exact, and no raw pose is differentiated.
"""

import math

import numpy as np

from scm.arrays import Floats
from scm.data_quality.pose_track import (
    Series,
    Track,
    between_gaps_s,
    cut_at_gaps,
    grid,
    long_gaps,
    recorded_s,
    series,
    without_pauses,
)
from scm.data_quality.quality import Measured, Relation
from scm.data_quality.whitened_fit import Fit, fit
from scm.recording.read import Recording

ROUNDS = 4
SHORTEST_S = 10.0
SHORTEST_DRIFT_S = 30.0
MOST_ROWS = 5000
WIDTH_S = 0.1
STEP_S = 0.02
FEWEST_ROWS = 40
TRAVEL = ("heading", "ahead", "side_slip")
QUIET_MPS2 = 3.0  # beyond, tyres slip more than in proportion
SIDE_SLIP_STD = 0.02  # rad per m/s^2
ACCEL_WIDTH_S = 0.15
ACCEL = ("along", "across", "angle", "bias_x", "bias_y", "ahead", "aside", "delay")
LEVER_STD = 0.5
HALF = 0.5


def yaw_against(
    poses: Track, turned: Series, other: str, start: tuple[float, float] = (0.0, 0.0)
) -> Relation | None:
    """Compare pose yaw with yaw that a sensor has added up.

    The pose stamped t shows the car at u = t - delay - rate (t - start of the poses).

    Args:
        poses: At the rear axle.
        turned: Yaw since its start [rad], on its own clock.
        other: Its channel.
        start: Delay [s] and rate to start from.

    Returns:
        `scale` and `bias` [rad/s] of the other sensor, `delay` [s] and `rate` of the pose's stamps;
        None where too little overlaps or nothing turns.
    """
    inside = (poses.t - start[0] > turned.t[0]) & (poses.t - start[0] < turned.t[-1])
    rows = poses.cut(inside)
    if len(rows.t) < 50 or recorded_s(rows.t) < SHORTEST_S or np.ptp(rows.yaw) < 0.2:
        return None
    rows = rows.cut(np.arange(len(rows.t)) % (1 + len(rows.t) // MOST_ROWS) == 0)
    since = rows.since
    rate = Series(turned.t, np.gradient(turned.values, turned.t))
    warp = np.array(start)
    found, starts = None, cut_at_gaps(rows.starts, rows.t, turned.t)
    for _ in range(ROUNDS):
        u = rows.t - warp[0] - warp[1] * since
        columns = np.stack((turned.at(u), since, -rate.at(u), -rate.at(u) * since), axis=1)
        if since[-1] < SHORTEST_DRIFT_S:
            columns = columns[:, :3]
        found = fit(rows.yaw[:, None], columns[:, None, :], None, starts, near=found)
        step = found.values[2:] / found.values[0] if found.values[0] else np.zeros(1)
        warp[: len(step)] += np.clip(step, -0.5, 0.5)
        if np.all(np.abs(step) < (1e-5, 1e-7)[: len(step)]):
            break
    if found is None:
        return None
    numbers = _yaw_numbers(found, warp)
    return Relation(("pose.yaw", other), numbers, max(poses.period_s, turned.period_s))


def _yaw_numbers(found: Fit, warp: Floats) -> dict[str, Measured]:
    k, drift = (float(value) for value in found.values[:2])
    std, leak = found.std / max(abs(k), 1e-9), [float(each) for each in found.leak]
    numbers = {
        "scale": Measured(1.0 / k, float(found.std[0]) / k**2, leak[0]),
        "bias": Measured(-drift / k, float(std[1]), leak[1]),
        "delay": Measured(float(warp[0]), float(std[2]), leak[2]),
    }
    if len(found.values) > 3:
        numbers["rate"] = Measured(float(warp[1]), float(std[3]), leak[3])
    return numbers


def sideways_of(poses: Track) -> Relation | None:
    """Hold the heading of the pose against its direction of travel.

    Returns:
        `heading` [rad], by which the pose's yaw is turned, and `ahead` [m], where the tracked point
        is; None where the car does not move enough.
    """
    width = max(WIDTH_S, 1.5 * poses.period_s)
    if recorded_s(poses.t) < max(SHORTEST_S, 60.0 * width):
        return None
    on = grid(poses.t[0], poses.t[-1], STEP_S, width, long_gaps(poses.t))
    yaw = on.smooth(Series(poses.t, poses.yaw))
    rate = on.smooth(Series(poses.t, poses.yaw), 1)
    vx, vy = (on.smooth(Series(poses.t, values), 1) for values in (poses.x, poses.y))
    along = np.cos(yaw) * vx + np.sin(yaw) * vy
    left = np.cos(yaw) * vy - np.sin(yaw) * vx
    rows = on.inner(round(2.0 * width / STEP_S))
    quiet = np.abs(along * rate)[rows] < QUIET_MPS2
    if quiet.sum() < FEWEST_ROWS:
        return None
    columns = np.stack((-along, rate, along * along * rate), axis=1)[rows][quiet]
    found = fit(
        left[rows, None][quiet], columns[:, None, :], np.array([np.inf, np.inf, SIDE_SLIP_STD])
    )
    return Relation(("pose.yaw", "pose.x"), found.numbers(TRAVEL))


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
    width = max(ACCEL_WIDTH_S, 1.5 * poses.period_s)
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
    numbers = _accelerometer_numbers(found)
    return Relation(("pose.x", "imu.accel_x"), numbers, max(poses.period_s, along.period_s))


def _accelerometer_numbers(found: Fit) -> dict[str, Measured]:
    """Return the accelerometer's scales, turn, biases and place by name."""
    numbers = found.numbers(ACCEL)
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
