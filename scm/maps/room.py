"""Whether there is room for one more car at a place."""

import math

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2

CLEARANCE_M = 0.45
"""Between rear axles: half a Nigel stays free between two of them."""
AHEAD_S = 1.5
"""Until a car that comes has heard of the new one and stands."""


def distances_m(
    pose: Pose2, x: Floats, y: Floats, yaw: Floats, speed: Floats, *, ahead_s: float = AHEAD_S
) -> Floats:
    """Return how far other cars' rear axles are from a place [m], (n,).

    What lies to the side counts double: cars are longer than wide. A car that comes nearer counts
    from where it will be within the next `ahead_s`, where that is nearest.

    Args:
        pose: The place.
        x: Of the others [m], (n,).
        y: Likewise.
        yaw: Of the others [rad], (n,).
        speed: Of the others [m/s], (n,), + = forward.
        ahead_s: For so long they may come nearer.
    """
    dx, dy, c, s = x - pose.x, y - pose.y, math.cos(pose.yaw), math.sin(pose.yaw)
    along, across = c * dx + s * dy, 2.0 * (c * dy - s * dx)
    u = speed * np.cos(yaw - pose.yaw)
    v = 2.0 * speed * np.sin(yaw - pose.yaw)
    squared = np.maximum(u * u + v * v, 1e-12)
    when = np.clip(-(along * u + across * v) / squared, 0.0, ahead_s)
    return np.hypot(along + u * when, across + v * when)
