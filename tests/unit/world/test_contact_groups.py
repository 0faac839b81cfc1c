"""What contacts do to a car depends on those that it touches, and on nobody else on the map."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from scm.records.city_map import Box, CityMap, MapTag, Wall
from scm.records.floor import Floor
from scm.world.broad_phase import BroadPhase, obstacles_of
from scm.world.contact_space import STEP_S
from scm.world.contacts import Contacts
from scm.world.solids import Hull, outline_of
from scm.world.step import tick
from scm.world.sweep import MAX_PASSES, share_moves
from scm.world.world import PERIOD_NS, World

HULL = Hull(2.4, 0.0229, -0.14, 0.16, -0.0875, 0.0875, restitution=0.3, friction=0.5)
FAR_M = 4.0  # between the middles of two rooms
HALF_M = 0.75
GRIP_MPS2 = 6.0
STEPS = 160


def city(boxes=(), walls=()):
    return CityMap(map=1, name="n", title="", source="", floor=Floor(x_m=(-9, 9), y_m=(-9, 9)),
                   tag=MapTag(tag_id=0, size_m=0.1), boxes=boxes, walls=walls)  # fmt: skip


def hull(rng):
    mass, length, width = rng.uniform(0.5, 6.0), rng.uniform(0.2, 0.45), rng.uniform(0.12, 0.25)
    return Hull(mass, mass * (length**2 + width**2) / 12.0, -0.45 * length, 0.55 * length,
                -0.5 * width, 0.5 * width, rng.uniform(0.0, 0.6), rng.uniform(0.1, 0.9),
                bool(rng.random() < 0.95))  # fmt: skip


class Crowd:
    """Rooms far from each other, in which cars drive at random into each other, boxes and walls.

    Attributes:
        map: All rooms.
        middles: (rooms,) x of their middles.
        room: (n,) of each car.
        index: (n,) number of each car.
        hulls: Of the cars.
        motion: (n, 6) of the cars.
        box_room: (k,) of each box.
    """

    def __init__(self, seed, rooms, top_mps):
        rng = np.random.default_rng(seed)
        self.middles = FAR_M * np.arange(rooms)
        walls, boxes = [], []
        self.box_room = np.repeat(np.arange(rooms), rng.integers(0, 5, rooms))
        for x in self.middles.tolist():
            square = ((-1, -1), (1, -1), (1, 1), (-1, 1))
            corners = tuple((x + HALF_M * a, HALF_M * b) for a, b in square)
            walls.append(Wall(points=corners, thickness_m=0.01, closed=True))
            end = x + rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3)
            walls.append(Wall(points=((x, -0.1), end), thickness_m=0.0))
        for i, x in enumerate(self.middles[self.box_room].tolist()):
            boxes.append(Box(
                name=f"b{i}", x_m=x + rng.uniform(-0.6, 0.6), y_m=rng.uniform(-0.6, 0.6),
                yaw_rad=rng.uniform(-3.0, 3.0), length_m=rng.uniform(0.05, 0.2),
                width_m=rng.uniform(0.05, 0.2), mass_kg=rng.uniform(0.05, 1.0),
                friction=rng.uniform(0.0, 0.6),
            ))  # fmt: skip
        self.map = city(tuple(boxes), tuple(walls))
        self.room = rng.permutation(np.repeat(np.arange(rooms), rng.integers(1, 9, rooms)))
        n = len(self.room)
        self.index = rng.permutation(2 * n)[:n]
        self.hulls = [hull(rng) for _ in range(n)]
        self.motion = np.zeros((n, 6))
        self.motion[:, :2] = rng.uniform(-0.6, 0.6, (n, 2))
        self.motion[:, 0] += self.middles[self.room]
        self.motion[:, 2] = rng.uniform(-3.0, 3.0, n)
        self.speeds = rng.uniform(0.0, 1.0, (n, 2)) * [top_mps, 4.0]

    def solver(self, rows):
        """Return a solver that knows some of the cars."""
        contacts = Contacts(self.map)
        for row in rows:
            contacts.add(int(self.index[row]), self.hulls[row])
        return contacts

    def drive(self, step):
        """Let the cars drive for a step with all their grip; now and then they turn back."""
        motion, most = self.motion, GRIP_MPS2 * STEP_S
        sign = np.where((step + 37 * self.index) % 160 < 80, 1.0, -1.0)
        along, rate = sign * self.speeds[:, 0], sign * self.speeds[:, 1]
        aim = np.column_stack((along * np.cos(motion[:, 2]), along * np.sin(motion[:, 2])))
        motion[:, 3:5] += np.clip(aim - motion[:, 3:5], -most, most)
        motion[:, 5] += np.clip(rate - motion[:, 5], -0.2, 0.2)
        motion[:, :3] += STEP_S * motion[:, 3:]

    def feel(self, touches):
        self.motion[:, 3:] += touches.dv
        self.motion[:, :2] += touches.shift
        self.motion[:, 2] += touches.turn


def moved(touches):
    return np.hstack((touches.dv, touches.shift, touches.turn[:, None], touches.touched[:, None]))


def names(crowd, rows, touches):
    """Return the pairs with the cars' numbers for rows; what is below 0 stays."""
    rows = rows[np.maximum(touches.pairs, 0)]
    return np.where(touches.pairs >= 0, crowd.index[rows], touches.pairs)


@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), top_mps=st.sampled_from([0.3, 2.0, 8.0]))
@example(seed=1, top_mps=0.3)
@example(seed=2, top_mps=2.0)
@example(seed=3, top_mps=8.0)
def test_cars_of_one_city_touch_as_in_several_that_each_hold_some_rooms(seed, top_mps):
    crowd, rng = Crowd(seed, 5, top_mps), np.random.default_rng(seed)
    everybody = np.arange(len(crowd.room))
    whole = crowd.solver(everybody)
    owner = rng.permutation(np.arange(5) % 3)
    parts = [np.flatnonzero(owner[crowd.room] == part) for part in range(3)]
    solvers = [crowd.solver(rows) for rows in parts]
    contacts = 0
    for step in range(STEPS):
        crowd.drive(step)
        touches = whole.step(crowd.index, crowd.motion)
        contacts += len(touches.pairs)
        for part, (rows, solver) in enumerate(zip(parts, solvers, strict=True)):
            alone = solver.step(crowd.index[rows], crowd.motion[rows])
            assert_array_equal(moved(alone), moved(touches)[rows])
            boxes = owner[crowd.box_room] == part
            assert_array_equal(solver.boxes.motion[boxes], whole.boxes.motion[boxes])
        crowd.feel(touches)
    assert contacts > STEPS


@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), top_mps=st.sampled_from([0.3, 2.0, 8.0]))
@example(seed=1, top_mps=0.3)
@example(seed=2, top_mps=2.0)
def test_contacts_do_not_depend_on_the_order_of_the_rows(seed, top_mps):
    crowd, rng = Crowd(seed, 2, top_mps), np.random.default_rng(seed)
    everybody = np.arange(len(crowd.room))
    one, other = crowd.solver(everybody), crowd.solver(rng.permutation(everybody))
    for step in range(STEPS):
        crowd.drive(step)
        touches = one.step(crowd.index, crowd.motion)
        rows = rng.permutation(everybody)
        mixed = other.step(crowd.index[rows], crowd.motion[rows])
        assert_array_equal(moved(mixed), moved(touches)[rows])
        assert_array_equal(names(crowd, rows, mixed), names(crowd, everybody, touches))
        assert_array_equal(other.boxes.motion, one.boxes.motion)
        crowd.feel(touches)


def test_cars_that_come_and_go_elsewhere_change_nothing():
    crowd, rng = Crowd(5, 3, 1.0), np.random.default_rng(5)
    here, there = np.flatnonzero(crowd.room == 0), np.flatnonzero(crowd.room != 0)
    busy, quiet = crowd.solver(here), crowd.solver(here)
    present = np.zeros(len(crowd.room), np.bool_)
    present[here] = True
    for step in range(STEPS):
        before = crowd.motion.copy()
        crowd.drive(step)
        crowd.motion[~present] = before[~present]
        for row in there[rng.random(len(there)) < 0.05].tolist():
            index = int(crowd.index[row])
            if present[row]:
                busy.remove(index)
            else:
                busy.add(index, crowd.hulls[row])
            present[row] = not present[row]
        rows = np.flatnonzero(present)
        touches = busy.step(crowd.index[rows], crowd.motion[rows])
        alone = quiet.step(crowd.index[here], crowd.motion[here])
        assert_array_equal(moved(touches)[np.isin(rows, here)], moved(alone))
        crowd.motion[rows, 3:] += touches.dv
        crowd.motion[rows, :2] += touches.shift
        crowd.motion[rows, 2] += touches.turn


def test_what_stops_a_move_does_not_depend_on_when_neighbours_were_listed():
    crowd = Crowd(7, 1, 3.0)
    outlines = np.array([outline_of(one) for one in crowd.hulls])
    walls = np.array([[0.0, 0.0, 1.0, 0.0, 0.5, 0.01], [0.3, 0.2, 0.0, 1.0, 0.5, 0.0]])
    order, stops = np.arange(len(outlines)), 0
    old = BroadPhase(obstacles_of(walls))
    for step in range(STEPS):
        crowd.drive(step)
        moves = STEP_S * crowd.motion[:, 3:]
        found = []
        for near in (old, BroadPhase(obstacles_of(walls))):
            marks = near.touching(order, crowd.motion, outlines, len(order))
            starts = crowd.motion[:, :3] - moves
            found.append((marks, near.shares(starts, moves, outlines, walls, marks)))
        (marks, shares), (new_marks, new_shares) = found
        assert_array_equal(marks, new_marks)
        assert (shares is None) == (new_shares is None)
        if shares is not None:
            assert_array_equal(shares, new_shares)
            stops += 1
            crowd.motion[:, :3] -= (1.0 - shares)[:, None] * moves
    assert stops > 10


def stopped_shares(cars, chain):
    """Return the shares of two cars of which one cannot be stopped, with a long chain elsewhere."""
    n = 2 + chain
    outlines = np.tile([0.0, 0.0, 0.1, 0.1, 0.15, 1.0], (n, 1))
    outlines[0, 5] = 0.0
    starts, moves = np.zeros((n, 3)), np.zeros((n, 3))
    starts[:2, 0], moves[:2, 0] = [0.0, 0.3], cars
    starts[2:, 0], moves[2:, 0] = 9.0 + 0.2 * np.arange(chain), 2.0
    pairs = [(0, 1), *((i, i + 1) for i in range(2, n - 1))]
    walls = np.array([[9.0 + 0.2 * chain, 0.0, 1.0, 0.0, 0.1, 0.1]])
    wall_of = np.array([[n - 1, 0]] if chain else np.empty((0, 2)), np.int64)
    shares = np.ones(n)
    share_moves(shares, np.array(pairs), wall_of, starts, moves, outlines, walls,
                np.ones(n, np.bool_), True)  # fmt: skip
    return shares


def test_a_long_jam_elsewhere_stops_nobody_earlier():
    alone, beside = (stopped_shares([0.2, -0.1], chain) for chain in (0, 2 * MAX_PASSES))
    assert 0.0 < alone[1] < 1.0
    assert (beside[2:] < 1.0).all()
    assert_array_equal(beside[:2], alone)


def test_a_group_meets_walls_that_were_far_when_it_began():
    wall = Wall(points=((1.5, -1.0), (1.5, 1.0)), thickness_m=0.02)
    contacts = Contacts(city(walls=(wall,)))
    motion = np.zeros((2, 6))
    motion[:, 0], motion[:, 3] = [0.0, 0.2995], 0.5
    for index in range(2):
        contacts.add(index, HULL)
    hits, furthest = [], 0.0
    for step in range(800):
        motion[0, 3] += 0.002  # the rear one pushes
        motion[:, :3] += STEP_S * motion[:, 3:]
        touches = contacts.step(np.arange(2), motion)
        motion[:, 3:] += touches.dv
        motion[:, :2] += touches.shift
        if (touches.pairs == -1).any():
            hits.append(step)
        furthest = max(furthest, motion[1, 0])
    assert 100 < hits[0] < 700
    assert furthest < 1.49 - HULL.front + 8e-3, "it was stopped at the first touch"
    assert motion[1, 0] == pytest.approx(1.49 - HULL.front, abs=0.02)
    assert abs(motion[1, 3]) < 0.1


def test_a_body_that_joins_leaves_the_others_what_the_solver_knew():
    wall = Wall(points=((0.0, -1.0), (0.0, 1.0)), thickness_m=0.0)
    contacts, row = Contacts(city(walls=(wall,))), 12
    motion = np.zeros((row + 1, 6))
    motion[:, 0] = -HULL.front - (HULL.front - HULL.rear) * np.arange(row + 1)
    motion[row, 0] -= 1.0
    for index in range(row + 1):
        contacts.add(index, HULL)
    pushed = []
    for step in range(200):
        motion[:row, 3] += 0.01
        motion[:row, :3] += STEP_S * motion[:row, 3:]
        motion[row, 0] = motion[row - 1, 0] - (0.2999 if step == 150 else 0.4)
        touches = contacts.step(np.arange(row + 1), motion)
        motion[:row, 3:] += touches.dv[:row]
        motion[:row, :2] += touches.shift[:row]
        pushed.append(np.abs(motion[:row, 3]).max())
    assert pushed[150] < 1.5 * pushed[149]
    assert pushed[0] > 3.0 * pushed[149]


def test_boxes_slide_on_where_the_last_car_has_left():
    box = Box(name="b", x_m=0.0, y_m=0.0, length_m=0.2, width_m=0.2, mass_kg=0.5, friction=0.1)
    world = World(city(boxes=(box,)), capacity=1)
    world.contacts.boxes.motion[0, 3] = 0.5
    for i in range(100):
        tick(world, i * PERIOD_NS, [])
    assert world.contacts.boxes.motion[0, 0] == pytest.approx(
        0.5**2 / (2 * 0.1 * 9.80665), rel=0.05
    )
    assert_array_equal(world.contacts.boxes.motion[0, 3:], 0.0)
