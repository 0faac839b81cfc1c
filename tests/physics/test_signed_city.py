"""Forty cars with all their physics in a city of signs: nobody touches, everybody gets on."""

import numpy as np
import pytest

from scm.maps.grid_city import grid_city
from scm.runtime.lockstep import Lockstep
from scm.v2x.messages.route_request import RouteRequest
from scm.world.driving import send
from scm.world.part import WorldPart

CARS = 40
SPAN_S = 120.0


@pytest.fixture(scope="module")
def city_after_two_minutes():
    """The world, pairs of cars that touched, and how long each car stood at most [s]."""
    city_map = grid_city(4, 4, signs=True)
    part = WorldPart(city_map, room=CARS)
    part.attach(lambda _kind, _where: False)
    world, touched = part.world, set()
    spawns = city_map.spawns
    for i in range(CARS):
        pose = world.roads.spawn_pose(spawns[i * len(spawns) // CARS].name)
        car = world.host(f"n{i + 1}", "nigel", pose, 0)
        send(world, car, RouteRequest(vehicle=car.name), 0)
    solve = world.contacts.step

    def noted(slots, motion):
        touches = solve(slots, motion)
        touched.update((a, b) for a, b in touches.pairs.tolist() if a >= 0 and b >= 0)
        return touches

    world.contacts.step = noted
    stood, longest = np.zeros(CARS), np.zeros(CARS)
    with Lockstep([part]) as city:
        for _ in range(round(SPAN_S / 0.5)):
            city.run_for(0.5)
            stood = np.where(np.abs(world.cars.arrays.speed[:CARS]) < 0.01, stood + 0.5, 0.0)
            longest = np.maximum(longest, stood)
    return world, touched, longest


def test_no_two_cars_touch(city_after_two_minutes):
    _, touched, _ = city_after_two_minutes
    assert touched == set()


def test_every_car_gets_over_junctions(city_after_two_minutes):
    world, _, longest = city_after_two_minutes
    junctions = world.drivers.passed[:CARS] / 2.0  # two lanes a junction
    # on a free road it is some 17 s from one to the next: 7 in two minutes; 4 and 6.2 were measured
    assert junctions.min() >= 3.0
    assert junctions.mean() >= 5.5
    assert longest.max() <= 40.0
