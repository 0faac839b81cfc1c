"""Boxes that cars push: momentum, friction that holds and stops, walls behind them, and energy."""

import gc

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from scm.records.city_map import Box, CityMap, MapTag, Wall
from scm.records.floor import Floor
from scm.world.boxes import Boxes, arm_of, inertia_of
from scm.world.contact_groups import STEPS_IN_SPACE
from scm.world.contact_space import STEP_S
from scm.world.contacts import Contacts
from scm.world.solids import Hull

HULL = Hull(2.4, 0.0229, -0.14, 0.16, -0.0875, 0.0875, restitution=0.3, friction=0.5)
GRAVITY = 9.80665
WEIGHTS = np.array([HULL.mass, HULL.mass, HULL.yaw_inertia])


def box(x=0.3, y=0.0, mass=0.5, friction=0.5, name="b", size=0.2):
    return Box(name=name, x_m=x, y_m=y, length_m=size, width_m=size, mass_kg=mass,
               friction=friction)  # fmt: skip


def city(*boxes, walls=()):
    return CityMap(map=1, name="n", title="", source="", floor=Floor(x_m=(-9, 9), y_m=(-9, 9)),
                   tag=MapTag(tag_id=0, size_m=0.1), boxes=boxes, walls=walls)  # fmt: skip


class Scene:
    """Cars on ice, moved by contacts alone and by a force of ours."""

    def __init__(self, city_map, *motions):
        self.contacts = Contacts(city_map)
        self.motion = np.array(motions, dtype=float).reshape(-1, 6)
        for slot in range(len(self.motion)):
            self.contacts.add(slot, HULL)

    def step(self, force=0.0):
        self.motion[:, 3] += force / HULL.mass * STEP_S
        self.motion[:, :3] += STEP_S * self.motion[:, 3:]
        touches = self.contacts.step(np.arange(len(self.motion)), self.motion)
        self.motion[:, 3:] += touches.dv
        self.motion[:, :2] += touches.shift
        return touches

    def energy(self):
        moved = self.contacts.boxes
        total = 0.5 * (self.motion[:, 3:] ** 2 @ WEIGHTS).sum()
        for one, velocity in zip(moved.boxes, moved.motion[:, 3:], strict=True):
            weights = np.array([one.mass_kg, one.mass_kg, inertia_of(one)])
            total += 0.5 * float(velocity**2 @ weights)
        return total


def test_a_car_gives_a_box_its_momentum_but_for_what_the_floor_takes():
    scene = Scene(city(box(friction=0.0)), [0.0, 0.0, 0.0, 0.5, 0.0, 0.0])
    for _ in range(60):
        scene.step()
    (moved,) = scene.contacts.boxes.motion
    assert HULL.mass * scene.motion[0, 3] + 0.5 * moved[3] == pytest.approx(HULL.mass * 0.5)
    assert moved[3] - scene.motion[0, 3] == pytest.approx(HULL.restitution * 0.5, rel=1e-3)


@pytest.mark.parametrize("friction", [0.2, 0.6])
def test_a_box_that_was_hit_slides_as_far_as_coulomb_lets_it(friction):
    scene = Scene(city(box(friction=friction)), [0.039, 0.0, 0.0, 0.6, 0.0, 0.0])
    speeds = []
    for _ in range(200):
        scene.step()
        scene.motion[0, 0] = -1.0  # the car is taken away at once
        speeds.append(scene.contacts.boxes.motion[0, 3])
    start = speeds[0]
    assert start > 0.3
    slid = scene.contacts.boxes.motion[0, 0] - 0.3
    # The first step of sliding is free of friction: it acts on the velocity after it.
    assert slid == pytest.approx(start**2 / (2 * friction * GRAVITY), abs=start * STEP_S)
    assert_array_equal(scene.contacts.boxes.motion[0, 3:], 0.0)


def test_a_box_that_left_the_solver_is_braked_when_it_is_hit_again():
    wall = Wall(points=((-6.0, -2.0), (-6.0, 2.0)), thickness_m=0.02)
    friction, apart, at_the_wall = 0.6, [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [-6.0] + 5 * [0.0]
    scene = Scene(city(box(friction=friction), walls=(wall,)), apart, at_the_wall)
    (moved,) = scene.contacts.boxes.motion
    for _ in range(2):
        begun = moved[0]
        scene.motion[:] = [begun - 0.261, 0.0, 0.0, 0.6, 0.0, 0.0], at_the_wall
        scene.step()
        start = moved[3]
        assert start > 0.3
        for _ in range(STEPS_IN_SPACE + 100):  # at last the wall's car alone is in the solver
            scene.motion[:] = apart, at_the_wall
            scene.step()
        expected = start**2 / (2 * friction * GRAVITY)
        assert moved[0] - begun == pytest.approx(expected, abs=2 * start * STEP_S)
        gc.collect()


def test_a_box_turns_and_comes_to_rest():
    scene = Scene(city(box(y=0.12)), [0.039, 0.0, 0.0, 0.6, 0.0, 0.0])
    scene.step()
    assert abs(scene.contacts.boxes.motion[0, 5]) > 0.1
    for _ in range(300):
        scene.motion[0, 0] = -1.0
        scene.step()
    assert_array_equal(scene.contacts.boxes.motion[0, 3:], 0.0)


def test_a_push_below_the_friction_of_the_floor_moves_no_box():
    holds = 0.5 * 0.5 * GRAVITY
    scene = Scene(city(box()), [0.04, 0.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(50):
        scene.step(force=0.9 * holds)
    there = scene.contacts.boxes.motion[0].copy()  # the first hit may move it a hair
    for _ in range(400):
        scene.step(force=0.9 * holds)
    assert there[0] == pytest.approx(0.3, abs=1e-3)
    assert_array_equal(scene.contacts.boxes.motion[0], there)


def test_a_stronger_push_moves_the_box_with_what_is_left_of_it():
    holds = 0.5 * 0.5 * GRAVITY
    scene = Scene(city(box()), [0.0399, 0.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(200):
        scene.step(force=2.0 * holds)
    expected = holds / (HULL.mass + 0.5) * 200 * STEP_S
    assert scene.motion[0, 3] == pytest.approx(expected, rel=0.03)


def test_a_box_pushed_against_a_wall_stops_the_car():
    wall = Wall(points=((0.6, -2.0), (0.6, 2.0)), thickness_m=0.02)
    scene = Scene(city(box(), walls=(wall,)), [0.0, 0.0, 0.0, 0.25, 0.0, 0.0])
    for _ in range(1000):
        scene.step(force=3.0)
    assert scene.contacts.boxes.motion[0, 0] == pytest.approx(0.49, abs=3e-3)
    assert scene.motion[0, 0] == pytest.approx(0.39 - HULL.front, abs=5e-3)


def test_boxes_push_each_other():
    boxes = (box(), box(x=0.505, name="c"))
    scene = Scene(city(*boxes), [0.0, 0.0, 0.0, 0.25, 0.0, 0.0])
    for _ in range(400):
        scene.step(force=12.0)
    first, second = scene.contacts.boxes.motion
    assert second[0] > 0.7
    assert second[0] - first[0] == pytest.approx(0.2, abs=3e-3)


def test_nothing_ever_gains_energy_from_contacts_and_friction():
    rng = np.random.default_rng(5)
    for _ in range(20):
        boxes = [
            box(*rng.uniform(-0.5, 0.5, 2), mass=rng.uniform(0.1, 3.0), name=str(i))
            for i in range(4)
        ]
        cars = rng.uniform(-1, 1, (4, 6)) * [0.6, 0.6, 3.0, 0.5, 0.5, 2.0]
        scene = Scene(city(*boxes), *cars)
        before = scene.energy()
        for _ in range(40):
            scene.step()
            after = scene.energy()
            assert after <= before + 1e-6  # the solver ends that near to the answer
            before = after


def test_what_a_car_touches_is_told_by_number():
    scene = Scene(city(box(name="a", x=3.0), box()), [0.05, 0.0, 0.0, 0.1, 0.0, 0.0])
    pairs = scene.step().pairs
    assert sorted(pairs[0].tolist()) == [-3, 0]


def test_boxes_go_back_to_their_places():
    boxes = Boxes((box(), box(name="c", x=1.0)))
    boxes.push(np.array([[1.0, 0.0, 2.0], [0.0, 0.0, 0.0]]), np.zeros((2, 2)))
    boxes.slide(0.5)
    assert boxes.poses[0].tolist() == pytest.approx([0.8, 0.0, 1.0])
    boxes.reset()
    assert_array_equal(boxes.motion, [[0.3, 0, 0, 0, 0, 0], [1.0, 0, 0, 0, 0, 0]])


def test_a_boxs_faces_run_counter_clockwise_about_it():
    faces = Boxes((box(),)).outline()
    assert faces.shape == (4, 4)
    middle = faces[:, :2].mean(axis=0)
    assert_allclose(middle, [0.3, 0.0], atol=1e-12)
    a, b = faces[:, :2] - middle, faces[:, 2:] - middle
    assert (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0).all()


def test_the_mean_arm_of_a_square_base_is_the_known_one():
    assert arm_of(box(size=1.0)) == pytest.approx(0.382598, rel=1e-5)
