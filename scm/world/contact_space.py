"""A pymunk space for bodies that may touch one another, read and written through `pymunk.batch`.

Attributes of pymunk cost thirty times as much as its batch calls. Chipmunk solves contacts in an
order that depends on all bodies and walls of a space, and on when each of them entered: so a space
holds those alone that depend on each other anyway, and they enter and leave in a given order.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import pymunk
from pymunk import batch

from scm.arrays import Floats, Ints
from scm.records.city_map import Box
from scm.world.solids import Hull, Solid, box_body, car_body, solid_shape

INSTANT = 1e-9  # duration of a solver step [s]: it moves nobody
STEP_S = 0.005

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


@dataclass(frozen=True)
class Parts:
    """All that may enter a space.

    Attributes:
        boxes: Those that can be pushed; the first keys are theirs.
        solids: What never moves.
        hulls: Cars, by key.
    """

    boxes: tuple[Box, ...]
    solids: tuple[Solid, ...]
    hulls: dict[int, Hull] = field(default_factory=dict)


class Buffers:
    """Room for what batch calls write and read, of several spaces after each other."""

    def __init__(self) -> None:
        self._into, self._out, self._touch = (batch.Buffer() for _ in range(3))

    def clear(self) -> None:
        """Forget what was read."""
        self._out.clear()
        self._touch.clear()

    def solve(self, space: pymunk.Space, block: Floats) -> None:
        """Let a space solve the contacts of its bodies' motion, and read what came of it."""
        self._into.set_float_buf(block)
        batch.set_space_bodies(space, _MOTION, self._into)
        space.step(INSTANT)
        batch.get_space_bodies(space, _MOTION, self._out)
        batch.get_space_arbiters(space, _TOUCH, self._touch)

    @property
    def motion(self) -> Floats:
        """The motions (k, 6) of all that were solved."""
        return np.frombuffer(self._out.float_buf()).reshape(-1, 6)

    @property
    def contacts(self) -> tuple[Ints, Floats, Floats]:
        """Contacts: ids of both bodies (k, 2), normals (k, 2) and depths (k,) [m]."""
        ints = np.frombuffer(self._touch.int_buf(), np.int64).reshape(-1, 3)
        floats = np.frombuffer(self._touch.float_buf()).reshape(-1, 4)
        alive = ints[:, 2] > 0  # arbiters of past contacts linger for some steps
        ints, floats = ints[alive], floats[alive]
        depths = -np.minimum(floats[:, 2], np.where(ints[:, 2] > 1, floats[:, 3], np.inf))
        return ints[:, :2], floats[:, :2], depths


class ContactSpace:
    """Bodies with the walls near them.

    Attributes:
        bodies: Those inside, by key, as they entered.
    """

    def __init__(self, parts: Parts, walls: Iterable[int] = ()) -> None:
        self._space = pymunk.Space()
        self._space.collision_slop = 0.0
        self._space.collision_bias = 1.0  # pymunk moves nobody out of an overlap: we do
        self._parts = parts
        self._walls: set[int] = set()
        self.bodies: dict[int, pymunk.Body] = {}
        self._brakes: dict[int, tuple[pymunk.Constraint, ...]] = {}
        self._order: tuple[Ints, Ints] | None = None
        self.add_walls(walls)

    def add_walls(self, walls: Iterable[int]) -> None:
        """Add those of what never moves, by number, that are not there yet."""
        static = self._space.static_body
        for wall in walls:
            if wall not in self._walls:
                self._walls.add(wall)
                self._space.add(solid_shape(static, self._parts.solids[wall]))

    def enter(self, key: int, x: float, y: float, yaw: float) -> None:
        """Let a body in.

        It comes in at its place: where all came in at one, the space would pair all with all.
        """
        boxes = self._parts.boxes
        if key < len(boxes):
            static = self._space.static_body
            body, self._brakes[key] = box_body(boxes[key], static, STEP_S / INSTANT)
        else:
            body = car_body(self._parts.hulls[key])
        body.position, body.angle = (x, y), yaw
        self._space.add(body, *body.shapes, *self._brakes.get(key, ()))
        self.bodies[key] = body
        self._order = None

    def leave(self, key: int) -> None:
        """Let a body out; the contacts that it had are forgotten."""
        body = self.bodies.pop(key)
        self._space.remove(body, *body.shapes, *self._brakes.pop(key, ()))
        self._order = None

    @property
    def order(self) -> tuple[Ints, Ints]:
        """Ids and keys (k,) in the order in which batch calls walk through the bodies."""
        if self._order is None:
            key_of = {body.id: key for key, body in self.bodies.items()}
            buffer = batch.Buffer()
            batch.get_space_bodies(self._space, batch.BodyFields.BODY_ID, buffer)
            ids = [i for i in np.frombuffer(buffer.int_buf(), np.int64).tolist() if i in key_of]
            self._order = np.array(ids, np.int64), np.array([key_of[i] for i in ids], np.int64)
        return self._order

    def solve(self, block: Floats, iterations: int, buffers: Buffers) -> None:
        """Solve the contacts of this instant.

        Args:
            block: (k + 1, 6) motions of the bodies in order; the last is the static one's.
            iterations: How often the solver goes round.
            buffers: Take the answer.
        """
        self._space.iterations = iterations
        buffers.solve(self._space, block)
