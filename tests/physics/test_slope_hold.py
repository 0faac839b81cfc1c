"""Cars stand where they are parked on a slope, and level floors know nothing of it."""

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.records.city_map import CityMap, MapTag
from scm.records.floor import Floor, Patch, Ramp
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.ground import Ground
from scm.vehicles.slope_hold import LENGTH_M, MEMORY, standing
from scm.world.step import move
from scm.world.world import PERIOD_NS, World
from vehicle_agent.bodies.simulated import SimulatedBody

PARKED_TICKS = 20 * 1_000_000_000 // PERIOD_NS
HEADINGS = (0.0, 0.7, 1.57, -2.4)


def city(**floor):
    whole = Floor(x_m=(-5.0, 5.0), y_m=(-5.0, 5.0), **floor)
    return CityMap(map=1, name="n", title="", source="", floor=whole,
                   tag=MapTag(tag_id=0, size_m=0.1))  # fmt: skip


def hill(slope):
    ramp = Ramp(name="up", x_m=0.0, y_m=0.0, length_m=8.0, width_m=8.0, to_m=8.0 * slope)
    return city(ramps=(ramp,))


def parked(slope, cars):
    """Return how far each car moved in 20 s, and in the last half of them [m]."""
    world = World(hill(slope), prepare=())
    for i, (car, yaw) in enumerate(cars):
        world.host(f"c{i}", car, Pose2(1.5 * (i // 4) - 2.0, 1.5 * (i % 4) - 2.0, yaw), 0)
    places = []
    for i in range(PARKED_TICKS + 1):
        if i in {0, PARKED_TICKS // 2, PARKED_TICKS}:
            world.cars.locate(world.sensors.external)
            of = [world.cars.get(f"c{k}").index for k in range(len(cars))]
            places.append(np.column_stack((world.cars.arrays.x[of], world.cars.arrays.y[of])))
        move(world, i * PERIOD_NS)
    start, half, end = places
    return np.hypot(*(end - start).T), np.hypot(*(end - half).T)


def test_parked_cars_stand():
    whole, late = parked(0.05, [(n, yaw) for n in ("nigel", "f1tenth", "dart") for yaw in HEADINGS])
    assert whole.max() < 1e-4
    assert late.max() < 1e-9


def test_only_a_car_whose_motors_hold_stands_where_it_is_steep():
    whole, late = parked(0.1, [("nigel", 0.0), ("nigel", 0.7), ("f1tenth", 0.0), ("dart", 0.0)])
    assert whole[:2].max() < 1e-4
    assert late[:2].max() < 1e-9
    assert whole[2:].min() > 0.1


def test_stronger_holding_motors_hold_on_a_steeper_slope():
    car = load_car("f1tenth").with_terms([], {"drive.hold_torque_nm": 0.05})
    assert stood(Ground(hill(0.1)), car) < 1e-4


def stood(ground, car):
    fleet = Fleet(ground.fit(car), 1)
    fleet.add(Pose2(0.0, 0.0, 0.3))
    ground.place_at_rest(fleet, 0)
    x, y = float(fleet.x[0]), float(fleet.y[0])
    for _ in range(2000):
        ground.feel(fleet, 0)
        fleet.advance(0.005)
    return float(np.hypot(fleet.x[0] - x, fleet.y[0] - y))


@pytest.mark.parametrize("name", ["nigel", "f1tenth", "dart"])
def test_a_level_floor_leaves_every_car_as_it_is(name):
    car = load_car(name)
    assert Ground(city()).fit(car) is car
    wet = Patch(name="wet", grip=0.5, x_m=0.0, y_m=0.0, radius_m=1.0)
    assert Ground(city(patches=(wet,))).fit(car) is car


def test_what_a_car_lists_itself_stays_as_it_is():
    listed = load_car("nigel").with_terms(MEMORY, {"tyre_windup.length_m": 0.1})
    assert standing(listed) is listed
    half = load_car("nigel").with_terms(["tyre_windup"], {"tyre_windup.length_m": 0.1})
    assert standing(half).value("tyre_windup.length_m") == 0.1
    assert standing(half).value("tyre_relaxation.length_m") == LENGTH_M


def test_an_agents_own_car_stands_too():
    body = SimulatedBody("nigel", seed=1)
    body.learn(hill(0.05), seed=1)
    body.place(Pose2(0.0, 0.0, 0.4), 0)
    for t_ns in range(0, 10_000_000_000, PERIOD_NS):
        body.advance(t_ns)
    pose = body.motion().pose
    assert np.hypot(pose.x, pose.y) < 1e-4
