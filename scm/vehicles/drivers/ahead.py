"""Which cars are on the way ahead: outlines against the corridor that the own car will sweep."""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.geometry import Pose2
from scm.vehicles.driver import Other
from scm.vehicles.drivers.track import Track

REACH = 2.0
MARGIN = 0.01


class Ahead(NamedTuple):
    """A car on the way.

    Attributes:
        rear: Where along the way it begins [m].
        speed: Along the way, never negative [m/s].
        length: Of the car [m].
    """

    rear: float
    speed: float
    length: float


def cars_ahead(
    track: Track, front: float, width: float, pose: Pose2, others: tuple[Other, ...]
) -> list[Ahead]:
    """Return the cars that stand in the way from `front` on, nearest first.

    Args:
        track: The way.
        front: Where the own front bumper is along it [m].
        width: Of the own car [m].
        pose: Of the own car: what is farther off than the reach is not looked at.
        others: Every other car.
    """
    near = [o for o in others if math.hypot(o.x - pose.x, o.y - pose.y) < REACH]
    if not near:
        return []
    s, index = track.samples(front, front + REACH)
    inside, along = _overlaps(track, index, 0.5 * width + MARGIN, near)
    found = []
    for other, hit, same_way in zip(near, inside, along, strict=True):
        if hit.any():
            first = int(np.argmax(hit))
            speed = max(0.0, other.speed * float(same_way[first]))
            found.append(Ahead(float(s[first]), speed, other.length))
    return sorted(found)


def _overlaps(track: Track, index: Ints, half: float, others: list[Other]) -> tuple[Bools, Floats]:
    """Return (which samples of the corridor each car covers, cosine of the angle to it): (m, n)."""
    boxes = np.array([(o.x, o.y, o.yaw, 0.5 * o.length, 0.5 * o.width) for o in others])
    x, y, yaw, half_length, half_width = boxes.T[:, :, None]
    dx, dy = track.x[index] - x, track.y[index] - y
    cos, sin = np.cos(yaw), np.sin(yaw)
    turned = track.yaw[index] - yaw
    same_way, across = np.cos(turned), np.sin(turned)
    lengthwise = np.abs(cos * dx + sin * dy) <= half_length + half * np.abs(across)
    sideways = np.abs(cos * dy - sin * dx) <= half_width + half * np.abs(same_way)
    return lengthwise & sideways, same_way
