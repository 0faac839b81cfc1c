"""Contacts between cars, and of cars with walls and boxes: pymunk's impulse solver, in batches.

The cars' own dynamics have already moved them; a contact step only solves impulses at the places
where footprints overlap, so its own duration is next to nothing (`INSTANT`) and it moves nobody.
What it returns per car is the change of velocity, and a shift out of the overlap that is shared by
inverse mass. A car that touches nothing gets exact zeros.

Two shapes a car: one meets other cars, one meets walls. pymunk multiplies the two restitutions of a
contact; with the root on the first and the car's own value on the second (walls carry 1), a car
against a wall and two equal cars both bounce with the restitution their car file gives.
Read and written through `pymunk.batch`: attributes cost thirty times as much.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pymunk
from pymunk import batch

from scm.arrays import Bools, Floats, Ints
from scm.maps.model import Box, CityMap, Wall

INSTANT = 1e-9
OVERLAP_KEPT = 2e-4
SHARE_CORRECTED = 0.2
ITERATIONS = 30
MEETS_CARS, MEETS_WALLS, WALL = 0b001, 0b010, 0b100

_MOTION = (
    batch.BodyFields.POSITION
    | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY
    | batch.BodyFields.ANGULAR_VELOCITY
)
_TOUCH = (
    batch.ArbiterFields.BODY_A_ID
    | batch.ArbiterFields.BODY_B_ID
    | batch.ArbiterFields.CONTACT_COUNT
    | batch.ArbiterFields.NORMAL
    | batch.ArbiterFields.DISTANCE_1
    | batch.ArbiterFields.DISTANCE_2
)


class Hull(NamedTuple):
    """What a car is to others: a box about its centre of gravity, body frame, SI."""

    mass: float
    yaw_inertia: float
    rear: float
    front: float
    right: float
    left: float
    restitution: float
    friction: float


@dataclass(frozen=True, slots=True)
class Touches:
    """What one contact step did; rows as in the motion that was given, world frame.

    Attributes:
        dv: (n, 3) change of the centre of gravity's velocity x, y and of the yaw rate.
        shift: (n, 2) way out of the overlap [m].
        touched: (n,) whether the car touched anything.
        pairs: (k, 2) rows that touched each other; -1 stands for a wall.
    """

    dv: Floats
    shift: Floats
    touched: Bools
    pairs: Ints


class Contacts:
    """A pymunk space with the map's obstacles and one body for each slot in use."""

    def __init__(self, city_map: CityMap) -> None:
        self._space = pymunk.Space()
        self._space.iterations = ITERATIONS
        self._space.collision_slop = 0.0
        self._space.collision_bias = 1.0  # pymunk moves nobody out of an overlap: we do
        self._bodies: dict[int, pymunk.Body] = {}
        self._slot_of_id: dict[int, int] = {}
        self._order: Ints = np.empty(0, np.int64)
        self._inverse_mass: Floats = np.empty(0)
        self._motion_in, self._motion_out, self._touch = (batch.Buffer() for _ in range(3))
        for wall in city_map.walls:
            self._space.add(*_wall_shapes(self._space.static_body, wall))
        for box in city_map.boxes:
            self._space.add(_box_shape(self._space.static_body, box))
        self._reorder()

    def add(self, slot: int, hull: Hull) -> None:
        """Give a car a body under a number of the caller's; its motion comes with every step."""
        body = pymunk.Body(hull.mass, hull.yaw_inertia)
        corners = [
            (hull.rear, hull.right),
            (hull.front, hull.right),
            (hull.front, hull.left),
            (hull.rear, hull.left),
        ]
        for category, mask, restitution, friction in (
            (MEETS_CARS, MEETS_CARS, math.sqrt(hull.restitution), math.sqrt(hull.friction)),
            (MEETS_WALLS, WALL, hull.restitution, hull.friction),
        ):
            shape = pymunk.Poly(body, corners)
            shape.elasticity, shape.friction = restitution, friction
            shape.filter = pymunk.ShapeFilter(categories=category, mask=mask)
            self._space.add(*(() if body.space else (body,)), shape)
        self._bodies[slot] = body
        self._reorder()

    def remove(self, slot: int) -> None:
        """Take a car's body away."""
        body = self._bodies.pop(slot)
        self._space.remove(body, *body.shapes)
        self._reorder()

    def step(self, slots: Ints, motion: Floats) -> Touches:
        """Solve the contacts of this instant.

        Args:
            slots: (n,) the caller's numbers of all cars that were added, in any order.
            motion: (n, 6) x, y, yaw, velocity x, y and yaw rate of the centres of gravity.
        """
        n = len(slots)
        row_of_slot = np.empty(max(self._bodies, default=-1) + 1, np.int64)
        row_of_slot[slots] = np.arange(n)
        row_of_body = row_of_slot[self._order]
        block = np.zeros((n + 1, 6))  # the last body is the static one
        block[:n] = motion[row_of_body]
        self._motion_in.set_float_buf(block)
        batch.set_space_bodies(self._space, _MOTION, self._motion_in)
        self._space.step(INSTANT)
        pairs, normals, depths = self._touching(row_of_slot)
        touched = np.zeros(n, np.bool_)
        touched[pairs[pairs >= 0]] = True
        return Touches(
            self._velocity_change(motion, row_of_body, touched),
            self._shifts(n, pairs, normals, depths, row_of_body),
            touched,
            pairs,
        )

    def _velocity_change(self, motion: Floats, row_of_body: Ints, touched: Bools) -> Floats:
        dv = np.zeros((len(motion), 3))
        if touched.any():
            self._motion_out.clear()
            batch.get_space_bodies(self._space, _MOTION, self._motion_out)
            after = np.frombuffer(self._motion_out.float_buf()).reshape(-1, 6)
            dv[row_of_body] = after[: len(row_of_body), 3:] - motion[row_of_body, 3:]
        return dv

    def _shifts(
        self, n: int, pairs: Ints, normals: Floats, depths: Floats, row_of_body: Ints
    ) -> Floats:
        shift = np.zeros((n, 2))
        if not len(pairs):
            return shift
        inverse_mass = np.zeros(n + 1)  # a wall is row -1: the last, immovable one
        inverse_mass[row_of_body] = self._inverse_mass
        a, b = pairs.T
        out = SHARE_CORRECTED * np.maximum(depths - OVERLAP_KEPT, 0.0)
        out /= inverse_mass[a] + inverse_mass[b]
        way = np.zeros((n + 1, 2))
        np.add.at(way, a, -normals * (out * inverse_mass[a])[:, None])
        np.add.at(way, b, normals * (out * inverse_mass[b])[:, None])
        shift[:] = way[:n]
        return shift

    def _touching(self, row_of_slot: Ints) -> tuple[Ints, Floats, Floats]:
        self._touch.clear()
        batch.get_space_arbiters(self._space, _TOUCH, self._touch)
        ints = np.frombuffer(self._touch.int_buf(), np.uint64).reshape(-1, 3)
        floats = np.frombuffer(self._touch.float_buf()).reshape(-1, 4)
        alive = ints[:, 2] > 0  # arbiters of past contacts linger for some steps
        ints, floats = ints[alive], floats[alive]
        pairs = np.array([[self._row(i, row_of_slot) for i in ids] for ids in ints[:, :2].tolist()])
        depths = -np.minimum(floats[:, 2], np.where(ints[:, 2] > 1, floats[:, 3], np.inf))
        return pairs.reshape(-1, 2).astype(np.int64), floats[:, :2], depths

    def _row(self, body_id: int, row_of_slot: Ints) -> int:
        slot = self._slot_of_id.get(body_id)
        return -1 if slot is None else int(row_of_slot[slot])

    def _reorder(self) -> None:
        """Learn in which order the batch calls walk through the bodies."""
        self._slot_of_id = {body.id: slot for slot, body in self._bodies.items()}
        buffer = batch.Buffer()
        batch.get_space_bodies(self._space, batch.BodyFields.BODY_ID, buffer)
        ids = np.frombuffer(buffer.int_buf(), np.uint64).tolist()
        self._order = np.array(
            [self._slot_of_id[i] for i in ids if i in self._slot_of_id], dtype=np.int64
        )
        self._inverse_mass = np.array([1.0 / self._bodies[slot].mass for slot in self._order])


def _wall_shapes(static: pymunk.Body, wall: Wall) -> list[pymunk.Shape]:
    points = [*wall.points, wall.points[0]] if wall.closed else list(wall.points)
    ends = pairwise(points)
    radius = 0.5 * wall.thickness_m
    return [_solid(pymunk.Segment(static, a, b, radius)) for a, b in ends]


def _box_shape(static: pymunk.Body, box: Box) -> pymunk.Shape:
    c, s = math.cos(box.yaw_rad), math.sin(box.yaw_rad)
    half = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    sizes = [(0.5 * i * box.length_m, 0.5 * j * box.width_m) for i, j in half]
    corners = [(box.x_m + c * x - s * y, box.y_m + s * x + c * y) for x, y in sizes]
    return _solid(pymunk.Poly(static, corners))


def _solid(shape: pymunk.Shape) -> pymunk.Shape:
    shape.elasticity = shape.friction = 1.0
    shape.filter = pymunk.ShapeFilter(categories=WALL, mask=MEETS_WALLS)
    return shape
