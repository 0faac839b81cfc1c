"""Cars at the border of a city, where something is not as it should be."""

import pytest

from scm.geometry import Pose2
from scm.v2x.messages.border_cars import BorderCar, BorderCars
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.world.border import GHOST_NS, receive_cars
from scm.world.requests import reply_to
from tests.unit.world.test_handover import LOOP, two, until, whole


def about_to_cross(cities, name="w1"):
    """Run until a car that may cross is a few millimetres before the border; return its world."""
    west = cities.worlds["west"].world
    until(cities, lambda: name in west.border.approaching)
    until(cities, lambda: west.border.approaching[name].until_ns)
    until(cities, lambda: west.cars.hosted[name].pose.x > 1.59)
    return west


def test_car_that_cannot_stop_any_more_is_handed_over_though_its_place_has_lapsed():
    cities = two()
    west = about_to_cross(cities)
    cities.cut()
    west.border.approaching["w1"].until_ns = cities.run.now_ns
    for _ in range(25):
        cities.tick()
    assert "w1" not in west.cars.hosted
    assert "w1" in west.border.leaving
    cities.restore_link()
    until(cities, lambda: cities.where("w1") == "east", 3.0)
    assert whole(cities)


def test_refused_car_comes_back_behind_those_who_stand_at_the_border():
    cities = two()
    west = about_to_cross(cities)
    east = cities.worlds["east"].world
    reply_to(east, SpawnRequest(vehicle="w1", spawn="s2"), cities.run.now_ns)  # so it is refused
    until(cities, lambda: west.border.leaving)
    spawned = reply_to(west, SpawnRequest(vehicle="w2", spawn="s0"), cities.run.now_ns)
    assert isinstance(spawned, SpawnReply)
    second = west.cars.hosted["w2"]
    second.fleet.place(second.row, Pose2(1.3, 0.0, 0.0))
    until(cities, lambda: "w1" in west.cars.hosted, 3.0)
    gap = second.pose.x - west.cars.hosted["w1"].pose.x
    assert 0.25 < gap < 0.4
    assert not west.border.leaving


def test_new_car_gets_no_name_of_one_that_is_on_its_way():
    cities = two(("n1",))
    west = about_to_cross(cities, "n1")
    cities.cut()
    until(cities, lambda: west.border.leaving)
    reply = reply_to(west, SpawnRequest(spawn="s0"), cities.run.now_ns)
    assert isinstance(reply, SpawnReply)
    assert reply.vehicle == "n2"


@pytest.fixture
def west():
    cities = two((), maps=LOOP)
    cities.tick()
    return cities.worlds["west"].world


def report(world, now_ns, name="n1"):
    car = BorderCar(
        vehicle=name, car="nigel", x_m=0.4, y_m=-0.8, yaw_rad=0.0, speed_mps=0.0,
        yaw_rate_radps=0.0,
    )  # fmt: skip
    receive_cars(world, BorderCars(city="east", t_ns=now_ns, cars=(car,)), now_ns)


def test_car_behind_the_border_is_seen_though_one_of_its_name_is_here(west):
    assert isinstance(reply_to(west, SpawnRequest(vehicle="n1"), 0), SpawnReply)
    report(west, 0)
    assert ("east", "n1") in west.border.ghosts


def test_car_that_is_no_longer_reported_is_forgotten_though_nothing_else_comes():
    cities = two((), maps=LOOP)
    cities.cut()
    cities.tick()
    west = cities.worlds["west"].world
    report(west, cities.run.now_ns)
    for _ in range(GHOST_NS // 20_000_000 + 10):
        assert "n1" in {name for _, name in west.border.ghosts} or cities.run.now_ns > GHOST_NS
        cities.tick()
    assert not west.border.ghosts


def test_removed_car_has_no_claim_to_a_place():
    cities = two()
    west = about_to_cross(cities)
    west.remove("w1")
    assert not west.border.approaching
