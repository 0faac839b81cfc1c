"""Whole cars on floors that are not level, not dry, and in the wind."""

import math

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.segments import wall_segments
from scm.records.city_map import Box, CityMap, MapTag, Wall
from scm.records.floor import Floor, Patch, Plate, Ramp
from scm.v2x.messages.boxes_request import BoxesRequest
from scm.v2x.messages.route_request import RouteRequest
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.ground import Ground
from scm.vehicles.vehicle_status import VehicleStatus
from scm.world.requests import reply_to
from scm.world.step import tick
from scm.world.world import PERIOD_NS, World

NIGEL = load_car("nigel")
GRAVITY = 9.80665
STEP_S = 0.005


def city(boxes=(), walls=(), **floor):
    whole = Floor(x_m=(-5.0, 5.0), y_m=(-5.0, 5.0), **floor)
    return CityMap(map=1, name="n", title="", source="", floor=whole, boxes=boxes, walls=walls,
                   tag=MapTag(tag_id=0, size_m=0.1))  # fmt: skip


def drive(city_map, pose, seconds, speed=0.0, throttle=0.0, each=lambda fleet: None):
    """Let one Nigel drive; return (x, z, speed, pitch, load of a front wheel) of each step."""
    ground, fleet = Ground(city_map), Fleet(NIGEL, 1)
    fleet.add(Pose2(*pose), speed)
    ground.place_at_rest(fleet, 0)
    fleet.throttle[0] = throttle
    history = []
    for _ in range(round(seconds / STEP_S)):
        each(fleet)
        ground.feel(fleet, 0)
        fleet.advance(STEP_S)
        history.append([float(a[0]) for a in (fleet.x, fleet.z, fleet.speed, fleet.pitch)]
                       + [float(fleet.wheel_load[0, 0])])  # fmt: skip
    assert fleet.status[0] == VehicleStatus.OK
    return np.array(history), fleet


STEP = Plate(name="mat", x_m=1.0, y_m=0.0, length_m=1.0, width_m=2.0, height_m=0.005)


def test_a_car_drives_over_a_step_and_stands_on_it_afterwards():
    history, _ = drive(city(plates=(STEP,)), (0.2, 0.0, 0.0), 2.5, throttle=1.0)
    x, z, speed = history[:, 0], history[:, 1], history[:, 2]
    on_top = (x > 0.6) & (x < 1.2)
    assert on_top.any()
    assert np.abs(z[on_top][-20:] - 0.005).max() < 2e-4
    assert speed[-1] > 0.2
    assert np.isfinite(history).all()


def test_an_edge_met_by_finer_steps_is_the_same_edge():
    """The floor is looked at every 5 ms: looking every millisecond changes the ride by little."""
    rides = []
    for step_s in (0.005, 0.001):
        ground, fleet = Ground(city(plates=(STEP,))), Fleet(NIGEL, 1)
        fleet.add(Pose2(0.2, 0.0, 0.0))
        fleet.throttle[0] = 1.0
        for _ in range(round(2.0 / step_s)):
            ground.feel(fleet, 0)
            fleet.advance(step_s)
        rides.append((float(fleet.x[0]), float(fleet.z[0])))
    assert rides[0] == pytest.approx(rides[1], abs=2e-3)


def test_a_ramp_slows_a_car_and_its_top_is_as_high_as_it_says():
    ramp = Ramp(name="up", x_m=1.0, y_m=0.0, length_m=1.0, width_m=2.0, to_m=0.08)
    deck = Plate(name="deck", x_m=2.0, y_m=0.0, length_m=1.0, width_m=2.0, height_m=0.08)
    history, _ = drive(city(ramps=(ramp,), plates=(deck,)), (0.0, 0.0, 0.0), 8.0, throttle=1.0)
    x, z, speed, pitch = history.T[:4]
    up = (x > 0.8) & (x < 1.1)
    assert speed[up].mean() < 0.95 * speed[(x > 0.2) & (x < 0.3)].mean()
    # Nose up is negative pitch; the body leans with the ramp and a little more on its springs.
    assert pitch[up].mean() == pytest.approx(-math.atan(0.08), abs=0.01)
    assert z[(x > 1.8) & (x < 2.1)].mean() == pytest.approx(0.08, abs=5e-4)


@pytest.mark.parametrize("yaw", [0.0, math.pi, math.pi / 2])
def test_a_car_that_is_put_on_a_slope_stands_on_it_settled(yaw):
    ramp = Ramp(name="r", x_m=0.0, y_m=0.0, length_m=4.0, width_m=4.0, to_m=0.2)
    history, fleet = drive(city(ramps=(ramp,)), (0.5, 0.3, yaw), 0.3)
    assert fleet.z[0] == pytest.approx(0.1 + 0.05 * 0.5, abs=2e-3)
    # Nobody falls or is thrown: each wheel keeps most of its quarter of the weight.
    assert 3.0 < history[:, 4].min() < history[:, 4].max() < 9.0
    assert np.abs(np.diff(history[:, 1])).max() < 2e-4


def test_on_ice_a_car_brakes_with_the_grip_that_is_left():
    ice = Patch(name="ice", x_m=0.0, y_m=0.0, radius_m=3.0, grip=0.02)
    stops = {}
    for name, patches in (("dry", ()), ("ice", (ice,))):
        history, _ = drive(city(patches=patches), (-1.0, 0.0, 0.0), 3.0, speed=0.25)
        stops[name] = history[:, 2]
    # The motor holds the rear wheels, which carry half the weight: 0.02 * g / 2 = 0.1 m/s^2.
    slowed = (stops["ice"][20] - stops["ice"][60]) / (40 * STEP_S)
    assert slowed < 0.02 * GRAVITY
    assert np.argmax(stops["ice"] < 0.02) > 3 * np.argmax(stops["dry"] < 0.02)


def test_sand_takes_speed_away():
    sand = Patch(name="sand", x_m=1.0, y_m=0.0, length_m=1.0, width_m=2.0, rolling=0.2)
    history, _ = drive(city(patches=(sand,)), (0.0, 0.0, 0.0), 6.0, throttle=1.0)
    x, speed = history[:, 0], history[:, 2]
    assert speed[(x > 0.8) & (x < 1.2)].mean() < 0.97 * speed[(x > 0.3) & (x < 0.4)].mean()


def test_a_world_without_floor_data_moves_as_one_that_says_it_is_level():
    plain, told = city(), city(patches=(Patch(name="p", x_m=4.0, y_m=4.0, radius_m=0.1, grip=0.1),))
    rides = [drive(m, (0.0, 0.0, 0.3), 1.0, throttle=0.7)[0] for m in (plain, told)]
    assert (rides[0] == rides[1]).all()


def test_a_driver_takes_a_car_round_the_proving_ground_over_all_its_trouble():
    world = World(load_map("proving_ground"), capacity=2)
    world.subscribers.attach(lambda *_: False)  # its scans would take longer than the drive
    lane = world.roads.lanes["oval"]
    car = world.host("a", "nigel", world.roads.spawn_pose("south"), 0)
    reply_to(world, RouteRequest(vehicle="a"), 0)
    places = []
    for i in range(2300):
        tick(world, i * PERIOD_NS, [])
        places.append((*car.pose, float(car.fleet.z[car.row])))
    x, y, _, z = np.array(places).T
    points = lane.points[None]
    away = np.hypot(points[..., 0] - x[::20, None], points[..., 1] - y[::20, None]).min(axis=1)
    assert away.max() < 0.05
    assert x.min() < 0.4
    assert x.max() > 4.3
    assert z.max() == pytest.approx(0.03, abs=2e-3)
    assert car.fleet.status[car.row] == VehicleStatus.OK


def test_a_pushed_box_moves_for_lidars_and_snapshots_too():
    box = Box(name="b", x_m=0.282, y_m=0.0, length_m=0.1, width_m=0.1, mass_kg=0.2)
    wall = Wall(points=((2.0, -2.0), (2.0, 2.0)))
    world = World(city(boxes=(box,), walls=(wall,)), capacity=4)
    car = world.host("a", "nigel", Pose2(0.0, 0.0, 0.0), 0)
    car.fleet.place(car.row, Pose2(0.0, 0.0, 0.0), 0.25)
    for i in range(40):
        tick(world, i * PERIOD_NS, [])
    (seen,) = world.contacts.boxes.in_snapshot()
    assert seen.name == "b"
    assert seen.x_m > 0.283
    assert len(wall_segments(world.city_map)) == 4  # of the wall alone
    reply = reply_to(world, BoxesRequest(by="test"), 40 * PERIOD_NS)
    assert reply.boxes == 1
    assert world.contacts.boxes.in_snapshot()[0].x_m == 0.282


def test_an_accelerometer_feels_a_hit_as_the_mean_of_its_tick():
    wall = Wall(points=((0.5, -2.0), (0.5, 2.0)))
    world = World(city(walls=(wall,)), capacity=4)
    car = world.host("a", "nigel", Pose2(0.0, 0.0, 0.0), 0)
    car.fleet.place(car.row, Pose2(0.262, 0.0, 0.0), 0.25)
    felt = []
    for i in range(20):
        tick(world, i * PERIOD_NS, [])
        felt.append(float(car.fleet.contact_accel_x[car.row]))
    hardest = min(felt)
    bounce = NIGEL.value("body.bounce_restitution")
    # The motor holds the wheels, so the car has lost some of its 0.25 m/s before the wall.
    assert -(1.0 + bounce) * 0.25 / 0.02 < hardest < -0.3 * (1.0 + bounce) * 0.25 / 0.02
    assert felt[-1] == 0.0
