"""Contacts between cars, boxes and walls: pymunk's impulse solver, for those who touch.

The cars' own dynamics have already moved them; a contact step only solves impulses at the places
where footprints overlap, so its own duration is next to nothing (`INSTANT`) and it moves nobody.
What it returns per car is the change of velocity, and a shift out of the overlap that is shared by
inverse mass. A car that touches nothing gets exact zeros and never meets pymunk: `broad_phase.py`
sieves.
Boxes that can be pushed live here too: between two steps they slide, braked by the floor.

Two shapes a car: one meets other cars, one meets walls and boxes. pymunk multiplies the two
restitutions of a contact; with the root on the first and the car's own value on the second (walls
and boxes carry 1), a car against a wall and two equal cars both bounce with the restitution their
car file gives. Boxes bounce neither off each other nor off walls.
Read and written through `pymunk.batch`: attributes cost thirty times as much.
"""

from dataclasses import dataclass

import numpy as np
import pymunk
from pymunk import batch

from scm.arrays import Bools, Floats, Ints
from scm.geometry import Pose2
from scm.records.city_map import CityMap
from scm.world.boxes import Boxes, is_still
from scm.world.broad_phase import BroadPhase, obstacles_of
from scm.world.solids import Hull, box_body, car_body, obstacle_boxes, outline_of, solids

INSTANT = 1e-9  # duration of a solver step [s]: it moves nobody
STEP_S = 0.005
ALLOWED_OVERLAP_M = 2e-4  # stays, so that a contact does not flicker
SHARE_CORRECTED = 0.2  # of a deeper overlap, in one step
ITERATIONS = 30
MAX_ITERATIONS = 300  # where bodies were stopped: a light one between heavy ones takes many
MAX_SPEED_GAIN = 2.0  # one hit gives a free box at most 1 + restitution of the car's speed
STEPS_IN_SPACE = 40  # a body stays after its last contact: entering costs ten microseconds
WALL, FIRST_BOX = -1, -2

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


@dataclass(frozen=True, slots=True)
class Touches:
    """What one contact step did; rows as in the motion that was given, world frame.

    Attributes:
        dv: (n, 3) change of the centre of gravity's velocity x, y and of the yaw rate.
        shift: (n, 2) way out of the overlap, or back to where the car was stopped [m].
        turn: (n,) change of the yaw to what it was where the car was stopped.
        touched: (n,) whether the car touched anything.
        pairs: (k, 2) rows that touched each other; -1 stands for a wall, -2 - i for box i.
    """

    dv: Floats
    shift: Floats
    turn: Floats
    touched: Bools
    pairs: Ints


class Contacts:
    """Who can touch whom on a map, by the caller's slots.

    Attributes:
        boxes: Those that can be pushed.
    """

    def __init__(self, city_map: CityMap) -> None:
        self.boxes = Boxes(city_map.boxes)
        self._obstacles = obstacles_of(obstacle_boxes(city_map))
        self._near = BroadPhase(self._obstacles)
        self._cores = obstacle_boxes(city_map, round_ends=False)
        self._ring = _Ring(city_map, self.boxes)
        rows = [(0.0, 0.0, a, b, np.hypot(a, b), 1.0) for a, b in self.boxes.sizes.tolist()]
        self._outlines: Floats = np.array(rows, dtype=float).reshape(-1, 6)

    def add(self, index: int, hull: Hull) -> None:
        """Give a car a body under a number of the caller's; its motion comes with every step."""
        key = index + len(self.boxes)
        if key >= len(self._outlines):
            more = np.zeros((max(64, 2 * key) - len(self._outlines), 6))
            self._outlines = np.concatenate((self._outlines, more))
        self._outlines[key] = outline_of(hull)
        self._ring.known[key] = hull

    def remove(self, index: int) -> None:
        """Remove a car's body."""
        self._ring.forget(index + len(self.boxes))

    def is_free(self, hull: Hull, pose: Pose2) -> bool:
        """Return whether a car with its centre of gravity at a pose touches no wall and no box."""
        motion = np.vstack(([*pose, 0.0, 0.0, 0.0], self.boxes.motion))
        outlines = np.vstack((outline_of(hull), self._outlines[: len(self.boxes)]))
        marks = BroadPhase(self._obstacles).touching(np.arange(len(motion)), motion, outlines, 1)
        return not marks[0]

    def warm(self) -> None:
        """Compile or load now what `step` needs, not when the first cars meet."""
        outlines, walls = np.full((2, 6), 0.1), np.array([[5.0, 0.0, 1.0, 0.0, 1.0, 0.1]])
        near = BroadPhase(obstacles_of(walls))
        for _ in range(2):  # at the second step it looks who has strayed
            marks = near.touching(np.arange(2), np.zeros((2, 6)), outlines, 1)
        for marked in (np.zeros(2, np.bool_), marks):
            near.shares(np.zeros((2, 3)), np.zeros((2, 3)), outlines, walls, marked)

    def step(self, indices: Ints, motion: Floats) -> Touches:
        """Solve the contacts of this instant.

        Args:
            indices: (n,) the caller's numbers of all cars that were added, in any order.
            motion: (n, 6) x, y, yaw, velocity x, y and yaw rate of the centres of gravity.
        """
        n, count = len(indices), len(self.boxes)
        keys = indices + count
        if count:
            self.boxes.slide(STEP_S)
            keys = np.concatenate((keys, np.arange(count)))
            motion = np.concatenate((motion, self.boxes.motion))
        outlines = self._outlines[keys]
        marks = self._near.touching(keys, motion, outlines, n)
        moves = STEP_S * motion[:, 3:]
        back = self._excess(motion[:, :3] - moves, moves, outlines, marks)
        stopped = np.zeros(len(keys), np.bool_)
        if back is not None:
            stopped |= back.any(axis=1)
            motion = np.hstack((motion[:, :3] - back, motion[:, 3:]))
            marks = self._near.touching(keys, motion, outlines, n)
        rows = np.flatnonzero(marks)
        if not len(rows) and back is None:
            return _nothing(n)
        dv, shift, pairs = self._ring.solve(keys, motion, rows, stopped)
        turn = np.zeros(len(keys))
        if back is not None:
            out = np.column_stack((shift, turn))
            too_far = self._excess(motion[:, :3], out, outlines, marks)
            out -= back if too_far is None else back + too_far
            shift, turn = out[:, :2], out[:, 2]
        if count:
            self._limit_speed(dv, motion, outlines, marks)
            self.boxes.push(dv[n:], np.column_stack((shift[n:], turn[n:])))
        touched = np.zeros(n, np.bool_)
        touched[pairs[(pairs >= 0) & (pairs < n)]] = True
        pairs = np.where(pairs >= n, FIRST_BOX - (pairs - n), pairs)
        met = (pairs >= 0).any(axis=1)
        return Touches(dv[:n], shift[:n], turn[:n], touched, pairs[met])

    def _excess(
        self, starts: Floats, moves: Floats, outlines: Floats, marks: Bools
    ) -> Floats | None:
        """Return what of the moves (n, 3) would bring bodies through each other; None: nothing."""
        shares = self._near.shares(starts, moves, outlines, self._cores, marks)
        return None if shares is None else (1.0 - shares)[:, None] * moves

    def _limit_speed(self, dv: Floats, motion: Floats, outlines: Floats, marks: Bools) -> None:
        """Lower the changes (n, 3) of boxes that shoot out of a wedge far faster than any car."""
        boxes = slice(len(motion) - len(self.boxes), None)
        points = np.where(marks, _speeds(motion[:, 3:], outlines[:, 4]).sum(axis=0), 0.0)
        fastest_car = points[: boxes.start].max(initial=0.0)
        limit = max(MAX_SPEED_GAIN * fastest_car, points[boxes].max())
        velocity = motion[boxes, 3:] + dv[boxes]
        middle, edge = _speeds(velocity, outlines[boxes, 4])
        # Of a box that was hit off its middle the edge is up to sqrt(3) times faster than what hit.
        speed = np.maximum(middle, 0.5 * edge)
        fast = speed > limit
        slower = velocity[fast] * (limit / speed[fast])[:, None]
        dv[boxes][fast] = slower - motion[boxes, 3:][fast]


def _speeds(velocity: Floats, reach: Floats) -> Floats:
    """Return the speed of the middle and what turning adds to it at most, (2, n) [m/s]."""
    middle = np.hypot(velocity[:, 0], velocity[:, 1])
    return np.stack((middle, reach * np.abs(velocity[:, 2])))


def _nothing(n: int) -> Touches:
    return Touches(
        dv=np.zeros((n, 3)),
        shift=np.zeros((n, 2)),
        turn=np.zeros(n),
        touched=np.zeros(n, np.bool_),
        pairs=np.empty((0, 2), np.int64),
    )


class _Ring:
    """The pymunk space: everything that stays, and whoever touched something a moment ago.

    A body stays for `STEPS_IN_SPACE` steps that solve.

    Attributes:
        known: Cars that may come in, by key; boxes have the first keys.
    """

    def __init__(self, city_map: CityMap, boxes: Boxes) -> None:
        self._space = pymunk.Space()
        self._space.iterations = ITERATIONS
        self._space.collision_slop = 0.0
        self._space.collision_bias = 1.0  # pymunk moves nobody out of an overlap: we do
        self._boxes = boxes.boxes
        self.known: dict[int, Hull] = {}
        self._bodies: dict[int, pymunk.Body] = {}
        self._brakes: dict[int, tuple[pymunk.Constraint, ...]] = {}
        self._left: dict[int, int] = {}
        self._order: Ints = np.empty(0, np.int64)
        self._ids: Ints = np.empty(0, np.int64)
        self._keys_of_ids: Ints = np.empty(0, np.int64)
        self._lightness: Floats = np.empty(0)
        self._motion_in, self._motion_out, self._touch = (batch.Buffer() for _ in range(3))
        self._space.add(*solids(self._space.static_body, city_map))

    def forget(self, key: int) -> None:
        """Remove a car permanently."""
        del self.known[key]
        if key in self._left:
            self._leave([key])
        self._bodies.pop(key, None)

    def solve(
        self, keys: Ints, motion: Floats, rows: Ints, stopped: Bools
    ) -> tuple[Floats, Floats, Ints]:
        """Return changes of velocity (n, 3), shifts (n, 2) and pairs (k, 2) of rows; -1: a wall.

        Args:
            keys: (n,) who is in which row.
            motion: (n, 6).
            rows: Those that touch something.
            stopped: (n,) those that could not make all of their last move.
        """
        # They come in anew: pymunk begins with the impulses of its last step, and those that were
        # stopped need not touch all that they touched then.
        if again := [key for key in keys[stopped].tolist() if key in self._left]:
            self._leave(again)
        self._space.iterations = MAX_ITERATIONS if stopped.any() else ITERATIONS
        self._let_in(keys[rows].tolist(), motion[rows, :3].tolist())
        row_of = np.empty(int(keys.max()) + 1, np.int64)
        row_of[keys] = np.arange(len(keys))
        inside = row_of[self._order]
        block = np.zeros((len(inside) + 1, 6))  # the last body is the static one
        block[:-1] = motion[inside]
        self._motion_in.set_float_buf(block)
        batch.set_space_bodies(self._space, _MOTION, self._motion_in)
        self._space.step(INSTANT)
        pairs, normals, depths = self._touching(row_of)
        dv = np.zeros((len(keys), 3))
        self._motion_out.clear()
        batch.get_space_bodies(self._space, _MOTION, self._motion_out)
        after = np.frombuffer(self._motion_out.float_buf()).reshape(-1, 6)
        dv[inside] = after[: len(inside), 3:] - block[:-1, 3:]
        lightness = np.zeros(len(keys) + 1)  # a wall is row -1: the last, immovable one
        lightness[inside] = self._lightness
        # A box that the floor holds is no way out: shifts would creep it along under any push.
        holds = (self._order < len(self._boxes)) & is_still(after[: len(inside), 3:])
        lightness[inside[holds]] = 0.0
        return dv, _shifts(pairs, normals, depths, lightness), pairs

    def _touching(self, row_of: Ints) -> tuple[Ints, Floats, Floats]:
        self._touch.clear()
        batch.get_space_arbiters(self._space, _TOUCH, self._touch)
        ints = np.frombuffer(self._touch.int_buf(), np.int64).reshape(-1, 3)
        floats = np.frombuffer(self._touch.float_buf()).reshape(-1, 4)
        alive = ints[:, 2] > 0  # arbiters of past contacts linger for some steps
        ints, floats = ints[alive], floats[alive]
        places = np.minimum(np.searchsorted(self._ids, ints[:, :2]), len(self._ids) - 1)
        is_body = self._ids[places] == ints[:, :2]
        pairs = np.where(is_body, row_of[self._keys_of_ids[places]], WALL)
        depths = -np.minimum(floats[:, 2], np.where(ints[:, 2] > 1, floats[:, 3], np.inf))
        return pairs, floats[:, :2], depths

    def _let_in(self, keys: list[int], poses: list[list[float]]) -> None:
        """Add bodies that touch something; remove those that have not for long.

        Each comes in at its place: where all came in at one, the space would pair all with all.
        """
        left = {key: steps - 1 for key, steps in self._left.items()}
        new = {key: pose for key, pose in zip(keys, poses, strict=True) if key not in left}
        left.update(dict.fromkeys(keys, STEPS_IN_SPACE))
        self._left = left
        for key, (x, y, yaw) in new.items():
            if key not in self._bodies:
                self._make(key)
            body = self._bodies[key]
            body.position, body.angle = (x, y), yaw
            self._space.add(body, *body.shapes, *self._brakes.get(key, ()))
        old = [key for key, steps in left.items() if steps <= 0]
        if old:
            self._leave(old)
        elif new:
            self._reorder()

    def _make(self, key: int) -> None:
        if key < len(self._boxes):
            made = box_body(self._boxes[key], self._space.static_body, STEP_S / INSTANT)
            self._bodies[key], self._brakes[key] = made
        else:
            self._bodies[key] = car_body(self.known[key])

    def _leave(self, keys: list[int]) -> None:
        for key in keys:
            del self._left[key]
            body = self._bodies[key]
            self._space.remove(body, *body.shapes, *self._brakes.get(key, ()))
        self._reorder()

    def _reorder(self) -> None:
        """Learn in which order the batch calls walk through the bodies."""
        key_of = {self._bodies[key].id: key for key in self._left}
        buffer = batch.Buffer()
        batch.get_space_bodies(self._space, batch.BodyFields.BODY_ID, buffer)
        ids = [i for i in np.frombuffer(buffer.int_buf(), np.int64).tolist() if i in key_of]
        self._order = np.array([key_of[i] for i in ids], dtype=np.int64)
        self._ids = np.sort(np.array(ids, dtype=np.int64))
        self._keys_of_ids = np.array([key_of[i] for i in self._ids.tolist()], dtype=np.int64)
        self._lightness = np.array([1.0 / self._bodies[key].mass for key in self._order.tolist()])


def _shifts(pairs: Ints, normals: Floats, depths: Floats, lightness: Floats) -> Floats:
    """Return the way out of the overlaps (n, 2), shared by inverse mass."""
    way = np.zeros((len(lightness), 2))
    if len(pairs):
        a, b = pairs.T
        out = SHARE_CORRECTED * np.maximum(depths - ALLOWED_OVERLAP_M, 0.0)
        whole = lightness[a] + lightness[b]
        out /= np.where(whole > 0.0, whole, np.inf)
        np.add.at(way, a, -normals * (out * lightness[a])[:, None])
        np.add.at(way, b, normals * (out * lightness[b])[:, None])
    return way[:-1]
