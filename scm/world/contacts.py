"""Contacts between cars, boxes and walls: pymunk's impulse solver, for those who touch.

The cars' own dynamics have already moved them; a contact step only solves impulses at the places
where footprints overlap, so its own duration is next to nothing (`INSTANT`) and it moves nobody.
What it returns per car is the change of velocity, and a shift out of the overlap that is shared by
inverse mass. A car that touches nothing gets exact zeros and never meets pymunk: `broad_phase.py`
sieves.
Boxes that can be pushed live here too: between two steps they slide, braked by the floor.
What a step does to a car depends on its group alone (`contact_groups.py`), and on what is within
reach of one move: not on other cars of the map, nor on the order in which they are given.

Two shapes a car: one meets other cars, one meets walls and boxes. pymunk multiplies the two
restitutions of a contact; with the root on the first and the car's own value on the second (walls
and boxes carry 1), a car against a wall and two equal cars both bounce with the restitution their
car file gives. Boxes bounce neither off each other nor off walls.
"""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.geometry import Pose2
from scm.records.city_map import CityMap
from scm.world.boxes import Boxes
from scm.world.broad_phase import BroadPhase, obstacles_of
from scm.world.contact_groups import WALL, ContactGroups, join
from scm.world.contact_space import STEP_S
from scm.world.solids import Hull, obstacle_boxes, outline_of

MAX_SPEED_GAIN = 2.0  # one hit gives a free box at most 1 + restitution of the car's speed
FIRST_BOX = WALL - 1


@dataclass(frozen=True, slots=True)
class Touches:
    """What one contact step did; rows as in the motion that was given, world frame.

    Attributes:
        dv: (n, 3) change of the centre of gravity's velocity x, y and of the yaw rate.
        shift: (n, 2) way out of the overlap, or back to where the car was stopped [m].
        turn: (n,) change of the yaw to what it was where the car was stopped.
        touched: (n,) whether the car touched anything.
        pairs: (k, 2) rows that touched each other; -1 stands for a wall, -2 - i for box i. Their
            order depends on the cars' numbers alone.
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
        self._groups = ContactGroups(city_map, self.boxes.boxes, self._obstacles)
        self._indices: Ints = np.empty(0, np.int64)
        self._order: Ints | None = None
        rows = [(0.0, 0.0, a, b, np.hypot(a, b), 1.0) for a, b in self.boxes.sizes.tolist()]
        self._outlines: Floats = np.array(rows, dtype=float).reshape(-1, 6)

    def add(self, index: int, hull: Hull) -> None:
        """Give a car a body under a number of the caller's; its motion comes with every step."""
        key = index + len(self.boxes)
        if key >= len(self._outlines):
            more = np.zeros((max(64, 2 * key) - len(self._outlines), 6))
            self._outlines = np.concatenate((self._outlines, more))
        self._outlines[key] = outline_of(hull)
        self._groups.add(key, hull)

    def remove(self, index: int) -> None:
        """Remove a car's body."""
        self._groups.remove(index + len(self.boxes))

    def forget(self) -> None:
        """Forget who touched whom: what follows depends on where cars are and how they move alone.

        Without that a car could not go on in another process as it would have here.
        """
        self._groups.forget()

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
        near.overlaps(np.zeros((2, 6)), outlines, marks)
        join(np.arange(2), np.arange(1), np.arange(1, 2))

    def step(self, indices: Ints, motion: Floats) -> Touches:
        """Solve the contacts of this instant.

        Args:
            indices: (n,) the caller's numbers of all cars that were added, in any order.
            motion: (n, 6) x, y, yaw, velocity x, y and yaw rate of the centres of gravity.
        """
        order = self._ascending(indices)
        if order is None:
            return self._solve(indices, motion)
        found = self._solve(indices[order], motion[order])
        back = np.empty(len(order), np.int64)
        back[order] = np.arange(len(order))
        pairs = np.where(found.pairs >= 0, order[np.maximum(found.pairs, 0)], found.pairs)
        return Touches(
            found.dv[back], found.shift[back], found.turn[back], found.touched[back], pairs
        )

    def _ascending(self, indices: Ints) -> Ints | None:
        """Return the rows (n,) by ascending number; None: they are."""
        if not np.array_equal(indices, self._indices):
            self._indices = indices.copy()
            order = np.argsort(indices)
            self._order = None if (np.diff(order) == 1).all() else order
        return self._order

    def _solve(self, indices: Ints, motion: Floats) -> Touches:
        """Solve the contacts of cars in the order of their numbers."""
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
        if back is None and self._groups.is_idle and not marks.any():
            return _nothing(n)
        overlaps = self._near.overlaps(motion, outlines, marks)
        dv, shift, pairs, labels = self._groups.solve(
            keys, motion, outlines[:, 4], marks, overlaps, stopped
        )
        out = np.column_stack((shift, np.zeros(len(keys))))
        places = np.ascontiguousarray(motion[:, :3])  # a view would be compiled for anew
        too_far = self._excess(places, out, outlines, marks) if out.any() else None
        for less in (too_far, back):
            if less is not None:
                out -= less
        if count:
            self._limit_speed(dv, motion, outlines, marks, labels)
            self.boxes.push(dv[n:], out[n:])
        touched = np.zeros(n, np.bool_)
        touched[pairs[(pairs >= 0) & (pairs < n)]] = True
        pairs = np.where(pairs >= n, FIRST_BOX - (pairs - n), pairs)
        met = (pairs >= 0).any(axis=1)
        return Touches(dv[:n], out[:n, :2], out[:n, 2], touched, pairs[met])

    def _excess(
        self, starts: Floats, moves: Floats, outlines: Floats, marks: Bools
    ) -> Floats | None:
        """Return what of the moves (n, 3) would bring bodies through each other; None: nothing."""
        shares = self._near.shares(starts, moves, outlines, self._cores, marks)
        return None if shares is None else (1.0 - shares)[:, None] * moves

    def _limit_speed(
        self, dv: Floats, motion: Floats, outlines: Floats, marks: Bools, labels: Ints
    ) -> None:
        """Lower the changes (n, 3) of boxes that shoot out of a wedge far faster than any car.

        Only cars of the same group count; `labels` (n,) say who is in which.
        """
        boxes = slice(len(motion) - len(self.boxes), None)
        points = np.where(marks, _speeds(motion[:, 3:], outlines[:, 4]).sum(axis=0), 0.0)
        points[: boxes.start] *= MAX_SPEED_GAIN
        limits = np.zeros(len(motion))
        np.maximum.at(limits, labels[marks], points[marks])
        limit = limits[labels[boxes]]
        velocity = motion[boxes, 3:] + dv[boxes]
        middle, edge = _speeds(velocity, outlines[boxes, 4])
        # Of a box that was hit off its middle the edge is up to sqrt(3) times faster than what hit.
        speed = np.maximum(middle, 0.5 * edge)
        fast = speed > limit
        slower = velocity[fast] * (limit[fast] / speed[fast])[:, None]
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
