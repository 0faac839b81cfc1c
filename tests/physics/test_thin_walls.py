"""Nothing goes through a wall, however thin: fast cars, and light boxes that they push at it."""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from scm.geometry import Pose2
from scm.records.city_map import Box, CityMap, MapTag, Wall
from scm.records.floor import Floor
from scm.vehicles.car import load_car
from scm.world.contact_space import STEP_S
from scm.world.contacts import Contacts
from scm.world.solids import hull_of
from scm.world.step import tick
from scm.world.world import PERIOD_NS, World

RECORDED = Path(__file__).parents[2] / "recordings" / "cars"
TOP_MPS = {
    "nigel": 0.27,
    "dart": 4.0,
    "f1tenth": 7.0,
    RECORDED / "ucar.toml": 4.3,
    RECORDED / "f1tenth_clemson.toml": 10.0,
    RECORDED / "f1tenth_penn.toml": 10.0,
    RECORDED / "av21.toml": 90.0,
    RECORDED / "genesis.toml": 60.0,
}
THICK_M = (0.0, 0.001, 0.005, 0.01, 0.05)
CARS = sorted(TOP_MPS, key=str)
WALL_X = 1.0
GRIP_MPS2 = 8.0


def box(x, y=0.0, size=0.05, mass=0.05, yaw=0.0, name="b", friction=0.5):
    return Box(name=name, x_m=x, y_m=y, yaw_rad=yaw, length_m=size, width_m=size, mass_kg=mass,
               friction=friction)  # fmt: skip


def city(*boxes, walls):
    return CityMap(map=1, name="n", title="", source="", floor=Floor(x_m=(-99, 99), y_m=(-99, 99)),
                   tag=MapTag(tag_id=0, size_m=0.1), boxes=boxes, walls=walls)  # fmt: skip


def upright(thick, half=9.0):
    return Wall(points=((WALL_X, -half), (WALL_X, half)), thickness_m=thick)


class Drive:
    """Cars that drive on ahead with all their grip, and what contacts make of it.

    Attributes:
        through: Names of those whose middle went through a wall.
        fastest: The highest speed of any box so far [m/s].
    """

    def __init__(self, city_map, hulls, motions, speed):
        self.contacts, self.speed, self.through, self.fastest = Contacts(city_map), speed, [], 0.0
        self.motion = np.array(motions, dtype=float).reshape(-1, 6)
        self.walls = [
            piece
            for wall in city_map.walls
            for piece in pairwise([*wall.points, *wall.points[: int(wall.closed)]])
        ]
        for slot, hull in enumerate(hulls):
            self.contacts.add(slot, hull)

    def run(self, seconds):
        for _ in range(round(seconds / STEP_S)):
            before = np.vstack((self.motion, self.contacts.boxes.motion))[:, :2]
            self.step()
            after = np.vstack((self.motion, self.contacts.boxes.motion))[:, :2]
            for i, (p, q) in enumerate(zip(before, after, strict=True)):
                if any(cross(p, q, np.array(a), np.array(b)) for a, b in self.walls):
                    self.through.append(i)
            speeds = np.hypot(*self.contacts.boxes.motion[:, 3:5].T)
            self.fastest = max(self.fastest, speeds.max(initial=0.0))
        return self

    def step(self):
        motion, most = self.motion, GRIP_MPS2 * STEP_S
        ahead = np.column_stack((np.cos(motion[:, 2]), np.sin(motion[:, 2])))
        along = (motion[:, 3:5] * ahead).sum(axis=1, keepdims=True)
        aside = motion[:, 3:5] - along * ahead
        slip = np.maximum(np.hypot(*aside.T), 1e-9)[:, None]
        motion[:, 3:5] += ahead * np.clip(self.speed - along, -most, most)
        motion[:, 3:5] -= aside * np.minimum(1.0, most / slip)
        motion[:, :3] += STEP_S * motion[:, 3:]
        touches = self.contacts.step(np.arange(len(motion)), motion)
        motion[:, 3:] += touches.dv
        motion[:, :2] += touches.shift
        motion[:, 2] += touches.turn


def cross(p, q, a, b):
    """Return whether the ways from p to q and from a to b cross."""

    def side(u, v, w):
        return (v[0] - u[0]) * (w[1] - u[1]) - (v[1] - u[1]) * (w[0] - u[0])

    return side(a, b, p) * side(a, b, q) < 0.0 and side(p, q, a) * side(p, q, b) < 0.0


def behind(x, hull, y=0.0, yaw=0.0, speed=0.0, gap=0.3):
    """Return the motion of a car whose nose is before (x, y), and which drives there."""
    c, s = math.cos(yaw), math.sin(yaw)
    far = hull.front + gap
    return [x - far * c, y - far * s, yaw, speed * c, speed * s, 0.0]


def push_box(car, speed, thick, y=0.0, yaw=0.0, gap=0.1, size=0.05, mass=0.05, seconds=1.0):
    """Let a car push a box against a wall."""
    hull = hull_of(load_car(car))
    x = WALL_X - 0.5 * thick - 0.5 * size - gap
    start = behind(x - size, hull, 0.0, yaw, speed)
    there = city(box(x, y, size, mass), walls=(upright(thick),))
    return Drive(there, [hull], [start], speed).run(seconds)


@pytest.mark.parametrize("thick", THICK_M)
@pytest.mark.parametrize("speed", [1.0, 3.0, 7.0])
@pytest.mark.parametrize("y", [0.0, 0.1])
def test_a_light_box_that_an_f1tenth_pushes_stays_before_the_wall(thick, speed, y):
    drive = push_box("f1tenth", speed, thick, y)
    assert drive.contacts.boxes.motion[0, 0] < WALL_X
    assert drive.through == []
    assert drive.fastest < 2.0 * speed


@pytest.mark.parametrize("car", CARS, ids=lambda car: Path(car).stem)
@pytest.mark.parametrize("thick", [0.0, 0.005])
def test_no_car_gets_through_a_thin_wall_or_pushes_a_box_through_it(car, thick):
    for yaw, size, mass in ((0.0, 0.05, 0.05), (0.4, 0.05, 0.05), (0.0, 0.2, 0.5)):
        drive = push_box(car, TOP_MPS[car], thick, 0.02, yaw, size=size, mass=mass, seconds=0.6)
        assert drive.through == []
        assert drive.fastest < 3.0 * TOP_MPS[car]


@pytest.mark.parametrize("speed", [3.0, 7.0])
def test_two_cars_push_no_box_through_a_wall(speed):
    hull = hull_of(load_car("f1tenth"))
    starts = [behind(0.8, hull, y, yaw, speed) for y, yaw in ((-0.15, 0.2), (0.15, -0.2))]
    there = city(box(0.9), walls=(upright(0.001),))
    drive = Drive(there, [hull, hull], starts, speed).run(1.0)
    assert drive.through == []
    assert drive.fastest < 3.0 * speed


def test_a_row_of_boxes_is_pushed_through_no_wall():
    hull = hull_of(load_car("f1tenth"))
    row = [box(0.7 + 0.06 * i, 0.01 * i, name=str(i)) for i in range(4)]
    there = city(*row, walls=(upright(0.001),))
    drive = Drive(there, [hull], [behind(0.6, hull, 0.0, 0.0, 7.0)], 7.0).run(1.0)
    assert drive.through == []
    assert (np.diff(drive.contacts.boxes.motion[:, 0]) > -0.05).all()


@pytest.mark.parametrize("yaw", [0.6, math.pi / 4])
def test_a_box_that_is_pushed_into_a_corner_stays_in_it(yaw):
    hull = hull_of(load_car("f1tenth"))
    corner = Wall(points=((-3.0, 1.0), (1.0, 1.0), (1.0, -3.0)), thickness_m=0.001)
    start = behind(0.8, hull, 0.8, yaw, 7.0)
    drive = Drive(city(box(0.9, 0.9), walls=(corner,)), [hull], [start], 7.0).run(1.0)
    assert drive.through == []
    assert (drive.contacts.boxes.motion[0, :2] < 1.0).all()


def room(rng, reach):
    """Return a closed wall of 3 to 6 corners, the angles of these, and its distance [m]."""
    corners = int(rng.integers(3, 7))
    radius = 8.0 * reach / math.cos(math.pi / corners)
    angles = rng.uniform(0.0, math.tau) + math.tau * np.arange(corners) / corners
    points = tuple((radius * math.cos(a), radius * math.sin(a)) for a in angles.tolist())
    thick = float(rng.choice([0.0, rng.uniform(0.0, 0.05)]))
    return Wall(points=points, thickness_m=thick, closed=True), angles, 8.0 * reach


@pytest.mark.parametrize("car", CARS, ids=lambda car: Path(car).stem)
def test_no_car_and_no_box_gets_out_of_a_room_of_any_walls(car):
    rng, hull = np.random.default_rng(CARS.index(car)), hull_of(load_car(car))
    reach = math.hypot(hull.front, hull.left)
    for _ in range(2):
        wall, angles, inner = room(rng, reach)
        speed, heads = TOP_MPS[car], rng.uniform(0.0, math.tau) + np.array([0.0, math.pi])
        ways = np.column_stack((np.cos(heads), np.sin(heads)))
        starts = [
            [*(6.0 * reach * way), yaw, *(speed * way), 0.0]
            for yaw, way in zip(heads.tolist(), ways, strict=True)
        ]
        boxes = [  # before the cars' noses, light and small
            box(*(rng.uniform(7.1, 7.6) * reach * way + rng.uniform(-0.1, 0.1, 2) * reach),
                size=rng.uniform(0.02, 0.1), mass=rng.uniform(0.01, 0.2), name=f"{k}{i}")
            for i, way in enumerate(ways) for k in range(2)
        ]  # fmt: skip
        drive = Drive(city(*boxes, walls=(wall,)), [hull, hull], starts, speed)
        drive.run(min(0.5, 0.2 + 2.0 * reach / speed))
        places = np.vstack((drive.motion, drive.contacts.boxes.motion))[:, :2]
        normals = angles + 0.5 * (angles[1] - angles[0])
        out = places @ np.stack((np.cos(normals), np.sin(normals)))
        assert out.max() < inner
        assert drive.through == []


def test_boxes_that_fly_stop_at_walls_and_at_each_other():
    there = city(box(0.7, name="a"), box(0.0, name="b"), walls=(upright(0.0),))
    drive = Drive(there, [], [], 0.0)
    drive.contacts.boxes.motion[1, 3] = 30.0
    for _ in range(200):
        drive.contacts.step(np.empty(0, np.int64), np.empty((0, 6)))
    first, second = drive.contacts.boxes.motion[:, 0]
    assert second < first < WALL_X


def test_a_hit_at_top_speed_gives_a_free_box_what_momentum_says():
    hull = hull_of(load_car("f1tenth"))
    there = city(box(0.5, friction=0.0), walls=())
    drive = Drive(there, [hull], [behind(0.47, hull, 0.0, 0.0, 7.0, gap=0.01)], 7.0)
    drive.step()
    share = hull.mass / (hull.mass + 0.05)
    expected = (1.0 + hull.restitution) * share * 7.0
    drive.run(0.05)
    assert drive.contacts.boxes.motion[0, 3] == pytest.approx(expected, rel=1e-3)


def test_a_car_that_nobody_can_move_is_not_stopped():
    hull = hull_of(load_car("f1tenth"), movable=False)
    there = city(box(0.9), walls=(upright(0.005),))
    contacts = Contacts(there)
    contacts.add(0, hull)
    motion = np.array([behind(0.8, hull, 0.0, 0.0, 3.0)])
    for _ in range(32):  # its nose comes 20 mm close to the wall
        motion[:, :3] += STEP_S * motion[:, 3:]
        touches = contacts.step(np.zeros(1, np.int64), motion)
        assert np.abs(touches.shift).max() < 1e-6
    assert contacts.boxes.motion[0, 0] < WALL_X


def test_the_same_squeeze_comes_out_the_same_bit_for_bit():
    one, other = (push_box("f1tenth", 7.0, 0.005, 0.03) for _ in range(2))
    assert_array_equal(one.motion, other.motion)
    assert_array_equal(one.contacts.boxes.motion, other.contacts.boxes.motion)


@pytest.mark.parametrize("thick", [0.005, 0.01])
def test_a_simulated_f1tenth_holds_a_light_box_at_a_wall(thick):
    world = World(city(box(0.9), walls=(upright(thick),)), capacity=2)
    car = world.host("a", "f1tenth", Pose2(-0.2, 0.02, 0.0), 0)
    car.fleet.place(car.row, Pose2(-0.2, 0.02, 0.0), 3.0)
    car.fleet.throttle[car.row] = 0.5
    for i in range(100):
        tick(world, i * PERIOD_NS, [])
    assert world.contacts.boxes.motion[0, 0] < WALL_X
    assert car.pose.x < WALL_X
