"""Heading of the pose against yaw as another sensor adds it up: gyro, or the wheels' difference."""

from dataclasses import replace

import numpy as np

from scm.arrays import Floats
from scm.data_quality.suspicion import Measured, Relation
from scm.data_quality.track import Series, Track, cut_at_gaps, recorded_s
from scm.data_quality.whitened import Fit, fit

ROUNDS = 4
SHORTEST_S = 10.0
SHORTEST_DRIFT_S = 30.0
MOST_ROWS = 5000


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
