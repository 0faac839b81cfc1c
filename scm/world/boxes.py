"""The construction boxes that cars can push: where they are, how they slide, and how to draw them.

A pushed box slides until the floor's friction has stopped it. The contact solver knows the friction
as a brake of limited strength, for sliding and for turning:

    force <= mu m g,   torque <= mu m g * arm,   arm = mean distance of the base from its middle

so a box at rest holds against any push that is weaker.   Source: Coulomb; the mean lever arm of an
evenly pressed base (Goyal, Ruina, Papadopoulos, Wear 143, 1991).
"""

import math

import numpy as np

from scm.arrays import Bools, Floats
from scm.records.boxes import SnapshotBox
from scm.records.city_map import Box

GRAVITY = 9.80665  # m/s^2
STILL_MPS, STILL_RADPS = 1e-6, 1e-5  # less is rounding of the solver


class Boxes:
    """All movable boxes of a map.

    Attributes:
        boxes: As the map has them, in its order.
        names: Of the boxes.
        motion: (k, 6) x, y, yaw, velocity x, y and yaw rate of their middles, map frame.
        sizes: (k, 2) half length and half width [m].
    """

    def __init__(self, boxes: tuple[Box, ...]) -> None:
        self.boxes = tuple(box for box in boxes if box.mass_kg is not None)
        self.names = tuple(box.name for box in self.boxes)
        self.sizes: Floats = np.array(
            [(0.5 * box.length_m, 0.5 * box.width_m) for box in self.boxes]
        ).reshape(-1, 2)
        self.motion: Floats = np.zeros((len(self.boxes), 6))
        self.reset()

    def __len__(self) -> int:
        return len(self.boxes)

    @property
    def poses(self) -> Floats:
        """Where they are: (k, 3) x, y, yaw."""
        return self.motion[:, :3]

    def reset(self) -> None:
        """Put all of them back where the map has them, at rest."""
        for i, box in enumerate(self.boxes):
            self.motion[i] = box.x_m, box.y_m, box.yaw_rad, 0.0, 0.0, 0.0

    def slide(self, dt: float) -> None:
        """Move the boxes that slide for a time [s]."""
        self.motion[:, :3] += dt * self.motion[:, 3:]
        self.motion[:, 2] = math.pi - np.mod(math.pi - self.motion[:, 2], 2.0 * math.pi)

    def push(self, dv: Floats, shift: Floats) -> None:
        """Change velocities (k, 3) and places (k, 2) or poses (k, 3).

        Velocities within the solver's rounding become zero.
        """
        self.motion[:, 3:] += dv
        self.motion[:, : shift.shape[1]] += shift
        self.motion[is_still(self.motion[:, 3:]), 3:] = 0.0

    def outline(self) -> Floats:
        """Return their faces, (4 k, 4) x0, y0, x1, y1, counter-clockwise [m]."""
        a, b = self.sizes[:, :1], self.sizes[:, 1:]
        along, across = a * np.array([1.0, -1.0, -1.0, 1.0]), b * np.array([1.0, 1.0, -1.0, -1.0])
        x, y, yaw = (self.motion[:, i : i + 1] for i in range(3))
        c, s = np.cos(yaw), np.sin(yaw)
        corners = np.stack((x + c * along - s * across, y + s * along + c * across), axis=2)
        faces = np.concatenate((corners, np.roll(corners, -1, axis=1)), axis=2)
        return faces.reshape(-1, 4)

    def in_snapshot(self) -> tuple[SnapshotBox, ...]:
        """Return where they are, for everybody who draws."""
        return tuple(
            SnapshotBox(name=name, x_m=x, y_m=y, yaw_rad=yaw)
            for name, (x, y, yaw) in zip(self.names, self.poses.tolist(), strict=True)
        )


def is_still(velocity: Floats) -> Bools:
    """Return which velocities (k, 3) x, y, yaw rate are no more than rounding of the solver."""
    slow = np.hypot(velocity[:, 0], velocity[:, 1]) < STILL_MPS
    return np.asarray(slow & (np.abs(velocity[:, 2]) < STILL_RADPS))


def mass_of(box: Box) -> float:
    """Return the mass of a movable box [kg]."""
    return box.mass_kg or 0.0


def inertia_of(box: Box) -> float:
    """Return the moment of inertia of an evenly filled box about its upright axis [kg m^2]."""
    return mass_of(box) * (box.length_m**2 + box.width_m**2) / 12.0


def arm_of(box: Box) -> float:
    """Return the mean distance of the base's points from its middle [m]."""
    a, b = 0.5 * box.length_m, 0.5 * box.width_m
    diagonal = math.hypot(a, b)
    return (
        diagonal
        + a * a / (2.0 * b) * math.log((b + diagonal) / a)
        + b * b / (2.0 * a) * math.log((a + diagonal) / b)
    ) / 3.0
