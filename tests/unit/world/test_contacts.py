"""The contact step: impulses where footprints overlap, exact zeros everywhere else."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from scm.records.city_map import Box, CityMap, MapTag, Wall
from scm.records.floor import Floor
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.contacts import Contacts
from scm.world.solids import Hull

HULL = Hull(2.4, 0.0229, -0.14, 0.16, -0.0875, 0.0875, restitution=0.3, friction=0.5)
LENGTH = HULL.front - HULL.rear
SOLVER = 1e-4  # two contact points a side are solved by turns, to five digits after 30 turns
OVERLAP = 0.001


def city(**obstacles):
    return CityMap(
        map=1,
        name="plain",
        title="",
        source="",
        floor=Floor(x_m=(-9.0, 9.0), y_m=(-9.0, 9.0)),
        tag=MapTag(tag_id=0, size_m=0.1),
        **obstacles,
    )


def touching(motion, hulls=None, city_map=None):
    motion = np.array(motion, float)
    contacts = Contacts(city_map or city())
    for slot in range(len(motion)):
        contacts.add(slot, (hulls or {}).get(slot, HULL))
    return contacts.step(np.arange(len(motion)), motion)


def head_on(speed=0.25, offset=0.0):
    gap = 2 * HULL.front - OVERLAP
    return [[0, 0, 0, speed, 0, 0], [gap, offset, np.pi, -speed, 0, 0]]


def test_cars_that_touch_nothing_get_exact_zeros():
    touches = touching([[0, 0, 0.3, 1.0, 0.5, 2.0], [3, 0, 0, 0, 0, 0]])
    assert_array_equal(touches.dv, np.zeros((2, 3)))
    assert_array_equal(touches.shift, np.zeros((2, 2)))


def test_two_equal_cars_bounce_with_the_restitution_of_their_file():
    touches = touching(head_on())
    assert_allclose(touches.dv[:, 0], [-0.25 * 1.3, 0.25 * 1.3], rtol=1e-9)


def test_a_car_bounces_off_a_wall_with_its_own_restitution():
    wall = Wall(points=((0.165, -1.0), (0.165, 1.0)), thickness_m=0.012)
    touches = touching([[0, 0, 0, 0.2, 0, 0]], city_map=city(walls=(wall,)))
    assert_allclose(touches.dv[0], [-0.2 * 1.3, 0, 0], atol=SOLVER)


def test_a_box_stops_a_car_like_a_wall():
    box = Box(name="b", x_m=0.2, y_m=0.0, yaw_rad=np.pi / 2, length_m=0.5, width_m=0.082)
    touches = touching([[0, 0, 0, 0.2, 0, 0]], city_map=city(boxes=(box,)))
    assert_allclose(touches.dv[0], [-0.2 * 1.3, 0, 0], atol=SOLVER)


@pytest.mark.parametrize("offset", [0.0, 0.04, 0.1])
def test_momentum_and_angular_momentum_are_kept_between_unlike_cars(offset):
    heavy = HULL._replace(mass=5.0, yaw_inertia=0.07)
    motion = np.array(head_on(offset=offset))
    touches = touching(motion, {1: heavy})
    mass = np.array([HULL.mass, heavy.mass])
    inertia = np.array([HULL.yaw_inertia, heavy.yaw_inertia])
    assert touches.touched.all()
    assert_allclose(mass @ touches.dv[:, :2], 0.0, atol=1e-12)
    x, y = motion[:, 0], motion[:, 1]
    spin = mass * (x * touches.dv[:, 1] - y * touches.dv[:, 0]) + inertia * touches.dv[:, 2]
    impulse = HULL.mass * np.hypot(*touches.dv[0, :2])
    # Friction acts on each car at its own side of the overlap: a couple with that arm remains.
    assert abs(spin.sum()) <= OVERLAP * impulse


def test_a_contact_never_adds_energy():
    rng = np.random.default_rng(3)
    for _ in range(200):
        motion = rng.normal(size=(2, 6)) * [0.1, 0.1, 1.0, 0.3, 0.3, 1.0]
        touches = touching(motion)
        before, after = motion[:, 3:], motion[:, 3:] + touches.dv
        weights = np.array([HULL.mass, HULL.mass, HULL.yaw_inertia])
        assert (after**2 @ weights).sum() <= (before**2 @ weights).sum() + 1e-12


def test_overlapping_cars_at_rest_are_moved_apart_and_not_kicked():
    touches = touching([[0, 0, 0, 0, 0, 0], [LENGTH - 0.01, 0, 0, 0, 0, 0]])
    assert_array_equal(touches.dv, np.zeros((2, 3)))
    assert touches.shift[0, 0] < 0.0 < touches.shift[1, 0]
    assert_allclose(touches.shift.sum(axis=0), 0.0, atol=1e-15)


def test_the_pairs_name_rows_and_minus_one_for_a_wall():
    wall = Wall(points=((-0.15, -1.0), (-0.15, 1.0)), thickness_m=0.03)
    touches = touching([[9, 9, 0, 0, 0, 0], *head_on()], city_map=city(walls=(wall,)))
    assert sorted(tuple(sorted(p)) for p in touches.pairs.tolist()) == [(-1, 1), (1, 2)]


def test_slots_may_come_in_any_order_and_go_away():
    contacts = Contacts(city())
    for slot in (7, 2, 5):
        contacts.add(slot, HULL)
    contacts.remove(7)
    motion = np.array(head_on())
    forward = contacts.step(np.array([2, 5]), motion)
    backward = contacts.step(np.array([5, 2]), motion[::-1])
    assert_allclose(forward.dv, backward.dv[::-1], atol=1e-12)
    assert forward.dv[0, 0] < 0.0


def test_a_car_that_presses_against_a_wall_does_not_say_that_it_speeds_up(make_city):
    city = make_city(hosted=(("n1", "nigel"),))
    lease = city.lease()
    renewal = LeaseRequest(vehicle="n1", owner="ann", verb="renew", epoch=lease.epoch)
    for seq in range(1, 120):
        news = (city.command(lease, seq, 1.0), *((renewal,) if seq % 20 == 0 else ()))
        city.run(1, *news)
    slot = city.world.cars.hosted["n1"].index
    assert abs(city.world.cars.arrays.speed[slot]) < 0.01
    assert city.world.cars.garage.signal("accel_x")[slot] > 1.0, "what its wheels alone would do"
    assert abs(city.heard(VehicleState)[-1].accel_mps2) < 0.3
