"""Heading of the pose against the way it moves: a rear axle that rolls does not go sideways."""

import numpy as np

from scm.data_quality.suspicion import Measured, Relation
from scm.data_quality.track import Series, Track, grid, long_gaps, recorded_s
from scm.data_quality.whitened import fit

WIDTH_S = 0.1
STEP_S = 0.02
SHORTEST_S = 10.0
FEWEST_ROWS = 40
NAMES = ("heading", "ahead", "side_slip")
QUIET_MPS2 = 3.0  # beyond, tyres slip more than in proportion
SIDE_SLIP_STD = 0.02  # rad per m/s^2


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
