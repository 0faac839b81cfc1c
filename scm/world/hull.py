"""The outline of a car: what others collide with and what LIDARs see."""

import numpy as np

from scm.arrays import Floats
from scm.vehicles.car import Car
from scm.vehicles.shape import shape_of
from scm.world.solids import Hull


def hull_of(car: Car, *, movable: bool = True) -> Hull:
    """Return the contact body of a car file; an immovable one pushes and is not pushed."""
    shape = shape_of(car)
    cog = shape.cog_to_rear_axle
    rear, front = car.vector("body.footprint_x_m")
    right, left = car.vector("body.footprint_y_m")
    heavy = 1.0 if movable else 1e6
    return Hull(
        mass=shape.mass * heavy,
        yaw_inertia=car.value("body.yaw_inertia_kgm2") * heavy,
        rear=rear - cog,
        front=front - cog,
        right=right,
        left=left,
        restitution=car.value("body.bounce_restitution"),
        friction=car.value("body.contact_friction"),
        movable=movable,
    )


def outline(car: Car, poses: Floats) -> Floats:
    """Return the four faces of each car, (4 n, 4) x0, y0, x1, y1, of rear-axle poses (n, 3)."""
    rear, front = car.vector("body.footprint_x_m")
    right, left = car.vector("body.footprint_y_m")
    along = np.array([rear, front, front, rear])
    across = np.array([right, right, left, left])
    x, y, yaw = (column[:, None] for column in poses.T)
    c, s = np.cos(yaw), np.sin(yaw)
    corners = np.stack((x + c * along - s * across, y + s * along + c * across), axis=2)
    faces = np.concatenate((corners, np.roll(corners, -1, axis=1)), axis=2)
    return faces.reshape(-1, 4)


def cog_motion(ahead: float, motion: Floats) -> Floats:
    """Return the motion of the centres of gravity, (n, 6) x, y, yaw, vx, vy, yaw rate, map frame.

    Args:
        ahead: How far ahead of the rear axle they are [m].
        motion: (n, 6) of the rear axles: x, y, yaw, speed along and across the body, yaw rate.
    """
    x, y, yaw, speed, lateral, rate = motion.T
    c, s = np.cos(yaw), np.sin(yaw)
    across = lateral + ahead * rate
    return np.column_stack(
        (x + ahead * c, y + ahead * s, yaw, c * speed - s * across, s * speed + c * across, rate)
    )
