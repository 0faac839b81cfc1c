"""The pose's heading: against yaw as another sensor integrates it, and against where it moves."""

from dataclasses import replace

import numpy as np

from scm.arrays import Floats
from scm.data_quality.pose_track import Series, Track, cut_at_gaps, grid, long_gaps, recorded_s
from scm.data_quality.quality import Measured, Relation
from scm.data_quality.whitened_fit import Fit, fit

ROUNDS = 4
SHORTEST_S = 10.0
SHORTEST_DRIFT_S = 30.0
MOST_ROWS = 5000
WIDTH_S = 0.1
STEP_S = 0.02
FEWEST_ROWS = 40
NAMES = ("heading", "ahead", "side_slip")
QUIET_MPS2 = 3.0  # beyond, tyres slip more than in proportion
SIDE_SLIP_STD = 0.02  # rad per m/s^2


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
    relation = _relation(("pose.yaw", other), found, warp, len(rows.t))
    return replace(relation, step_s=max(poses.period_s, turned.period_s))


def _relation(pair: tuple[str, str], found: Fit, warp: Floats, rows: int) -> Relation:
    k, drift = (float(value) for value in found.values[:2])
    std, leak = found.std / max(abs(k), 1e-9), [float(each) for each in found.leak]
    numbers = {
        "scale": Measured(1.0 / k, float(found.std[0]) / k**2, leak[0]),
        "bias": Measured(-drift / k, float(std[1]), leak[1]),
        "delay": Measured(float(warp[0]), float(std[2]), leak[2]),
    }
    if len(found.values) > 3:
        numbers["rate"] = Measured(float(warp[1]), float(std[3]), leak[3])
    return Relation(pair=pair, numbers=numbers, noise=found.noise, rows=rows)


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
    numbers = {
        name: Measured(float(value), float(std), float(leak))
        for name, value, std, leak in zip(NAMES, found.values, found.std, found.leak, strict=True)
    }
    return Relation(
        pair=("pose.yaw", "pose.x"), numbers=numbers, noise=found.noise, rows=len(columns)
    )
