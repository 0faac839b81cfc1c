"""Poses on the floor and angles: ISO 8855, x forward, y left, yaw counter-clockwise."""

import math
from typing import NamedTuple

TAU = 2.0 * math.pi


def wrap_angle(angle: float) -> float:
    """Return the angle in (-pi, pi] [rad]."""
    wrapped = math.remainder(angle, TAU)
    return math.pi if wrapped == -math.pi else wrapped


class Pose2(NamedTuple):
    """A pose on the floor: position [m] and yaw [rad] of a frame seen from another one."""

    x: float
    y: float
    yaw: float

    def __matmul__(self, other: "Pose2") -> "Pose2":
        """Chain transforms: `world_T_body @ body_T_tag` is `world_T_tag`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            wrap_angle(self.yaw + other.yaw),
        )

    def inverse(self) -> "Pose2":
        """Return the transform the other way round."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(-c * self.x - s * self.y, s * self.x - c * self.y, wrap_angle(-self.yaw))

    def apply(self, x: float, y: float) -> tuple[float, float]:
        """Return a point given in this frame, seen from the frame this pose is given in [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + c * x - s * y, self.y + s * x + c * y
