"""Collisions of whole cars in the world: momentum, bounce, walls, and nobody else disturbed.

Where momentum is judged the floor has no grip: on ice the floor takes nothing, and what
is left is what the contact impulses say.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from scm.geometry import Pose2
from scm.records.city_map import CityMap, MapTag, Wall
from scm.records.floor import Floor
from scm.v2x.exchange import Incoming
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.world import step
from scm.world.requests import reply_to
from scm.world.world import PERIOD_NS, World

TICK_S = 0.02
NIGEL = load_car("nigel")
MASS, INERTIA = NIGEL.value("body.mass_kg"), NIGEL.value("body.yaw_inertia_kgm2")
RESTITUTION = NIGEL.value("body.bounce_restitution")


def world_with(*walls):
    return World(
        CityMap(
            map=1, name="plain", title="", source="", floor=Floor(x_m=(-9.0, 9.0), y_m=(-9.0, 9.0)),
            tag=MapTag(tag_id=0, size_m=0.1), walls=walls,
        ),
        capacity=8,
    )  # fmt: skip


def put(world, name, pose, speed=0.0, car="nigel", ice=False):
    hosted = world.host(name, car, Pose2(*pose), 0)
    hosted.fleet.place(hosted.row, Pose2(*pose), speed)
    if ice:
        hosted.fleet.floor_grip[hosted.row] = 0.0
    return hosted


def run(world, seconds):
    """Step the world on; return the motions of the cars after each tick, (ticks, cars, 6)."""
    history = []
    start = world.tick
    for i in range(round(seconds / TICK_S) + 1):
        tick(world, (start + i) * PERIOD_NS, [])
        cars = world.cars.hosted.values()
        history.append([car.fleet.planar_cog(car.row) for car in cars])
    return np.array(history)


def tick(world, now_ns, inbox):
    """Make a tick, and note what the world sends."""
    world.sent = step.tick(world, now_ns, inbox)


def command(world, name, throttle, seconds):
    """Lease a car and command it for a while."""
    ask = LeaseRequest(vehicle=name, owner="test", verb="acquire", ttl_ms=60_000)
    lease = reply_to(world, ask, world.tick * PERIOD_NS)
    for seq in range(round(seconds / TICK_S)):
        now = world.tick * PERIOD_NS
        told = DriveCommand(
            vehicle=name, t_ns=now, epoch=lease.epoch, seq=seq, throttle=throttle, steering=0.0
        )
        tick(world, now, [Incoming(told, now)])


def head_on(ice=True, speed=0.25, offset=0.0):
    world = world_with()
    put(world, "a", (0.0, 0.0, 0.0), speed, ice=ice)
    put(world, "b", (0.6, offset, np.pi), speed, ice=ice)
    return world


def hit_tick(history):
    """Return the first tick at which anybody's speed jumped."""
    jumps = np.abs(np.diff(history[:, :, 3], axis=0)).max(axis=1)
    return int(np.argmax(jumps > 0.05)) + 1


@pytest.mark.parametrize("offset", [0.0, 0.06])
def test_cars_on_ice_keep_their_momentum_through_a_collision(offset):
    history = run(head_on(offset=offset), 1.5)
    assert hit_tick(history) > 1
    momentum = MASS * history[:, :, 3:5].sum(axis=1)
    assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), atol=1e-9)


def test_equal_cars_on_ice_part_with_the_restitution_of_their_file():
    history = run(head_on(), 1.5)
    assert history[-1, 1, 3] - history[-1, 0, 3] == pytest.approx(0.5 * RESTITUTION, rel=1e-4)


def test_a_collision_on_ice_never_adds_energy():
    history = run(head_on(offset=0.1), 1.5)
    energy = 0.5 * (
        MASS * (history[:, :, 3:5] ** 2).sum(axis=(1, 2)) + INERTIA * (history[:, :, 5] ** 2).sum(1)
    )
    assert (np.diff(energy) <= 1e-9).all()


def test_on_the_road_the_floor_takes_at_most_what_its_friction_allows():
    history = run(head_on(ice=False), 1.5)
    i = hit_tick(history)
    momentum = MASS * history[:, :, 3].sum(axis=1)
    # Tyres carry at most their peak coefficient, 1, times weight; one tick lasts 20 ms.
    assert abs(momentum[i] - momentum[i - 1]) <= 2 * MASS * 9.81 * TICK_S


def test_a_car_on_ice_bounces_off_a_wall_with_the_restitution_of_its_file():
    world = world_with(Wall(points=((0.5, -2.0), (0.5, 2.0))))
    put(world, "a", (0.0, 0.0, 0.0), 0.25, ice=True)
    history = run(world, 2.0)
    assert history[-1, 0, 3] == pytest.approx(-0.25 * RESTITUTION, rel=1e-3)


def test_a_car_that_pushes_against_a_wall_stays_in_front_of_it():
    world = world_with(Wall(points=((0.5, -2.0), (0.5, 2.0)), thickness_m=0.01))
    car = put(world, "a", (0.0, 0.0, 0.0))
    command(world, "a", throttle=1.0, seconds=5.0)
    nose = car.pose.x + NIGEL.vector("body.footprint_x_m")[1]
    assert nose == pytest.approx(0.495, abs=2e-3)


@pytest.mark.parametrize(("model", "speed"), [("nigel", 0.267), ("f1tenth", 7.0)])
@pytest.mark.parametrize("yaw", [0.0, 0.6])
def test_no_car_gets_through_a_thin_wall_at_its_top_speed(model, speed, yaw):
    world = world_with(Wall(points=((1.0, -4.0), (1.0, 4.0)), thickness_m=0.005))
    put(world, "a", (0.3, 0.0, yaw), speed, car=model)
    history = run(world, 1.0 if speed > 1.0 else 4.0)
    assert history[:, 0, 0].max() < 1.0


def test_cars_that_touch_nothing_move_as_if_they_were_alone_bit_for_bit():
    world = world_with(Wall(points=((3.0, -4.0), (3.0, 4.0))))
    crowd = put(world, "a", (0.0, 0.0, 0.3))
    put(world, "b", (1.0, 1.0, 2.0), 0.2)
    put(world, "c", (1.5, 1.0, -1.1), 0.2)
    alone = Fleet(NIGEL, 1)
    row = alone.add(Pose2(0.0, 0.0, 0.3))
    run(world, 3.0)
    for _ in range(4 * 150):
        alone.advance(0.005)
    for name in ("x", "y", "z", "yaw", "roll", "pitch", "speed", "wheel_angle", "wheel_load"):
        assert_array_equal(getattr(crowd.fleet, name)[crowd.row], getattr(alone, name)[row], name)


def sensed(world, name):
    found = [m for m in world.sent if isinstance(m, VehicleSensors) and m.vehicle == name]
    return found[-1]


def test_encoders_count_the_distance_driven():
    world = world_with()
    car = put(world, "a", (0.0, 0.0, 0.0))
    command(world, "a", throttle=0.5, seconds=4.0)
    counts = sensed(world, "a")
    expected = car.pose.x / (2 * np.pi * NIGEL.value("wheel.radius_m")) * 1920
    # The driven wheels slip a little, and the counts are whole ones.
    assert counts.encoder_left == counts.encoder_right == pytest.approx(expected, rel=0.01)


def test_at_rest_the_imu_reads_gravity_and_its_own_noise():
    world = world_with()
    put(world, "a", (0.0, 0.0, 0.0))
    readings = []
    for i in range(500):
        tick(world, i * PERIOD_NS, [])
        readings.append((*sensed(world, "a").accel_mps2, *sensed(world, "a").gyro_radps))
    accel, gyro = NIGEL.value("imu.accel_noise_m_s2"), NIGEL.value("imu.gyro_noise_rad_s")
    spread = np.array([accel] * 3 + [gyro] * 3)
    # 500 readings: mean within 4.5 sigma / sqrt(500), spread within 15 %.
    assert_allclose(np.mean(readings, 0), [0, 0, 9.80665, 0, 0, 0], atol=0.2 * accel)
    assert_allclose(np.std(readings, 0), spread, rtol=0.15)


class Agent:
    """A remote car with a fleet of its own, whose reports take a tick and whose pushes take two."""

    def __init__(self, world, name, pose, speed, ice=False):
        self.world, self.name, self.seq = world, name, 0
        world.sent = []
        self.car = world.admit(name, "remote", "s", "nigel", Pose2(*pose), 0)
        self.fleet = Fleet(NIGEL, 1)
        self.fleet.add(Pose2(*pose), speed)
        self.told, self._under_way, self.felt = [], [], 0
        if ice:
            self.fleet.floor_grip[0] = 0.0

    def step(self, now):
        """Move a tick, having heard the contacts of the tick before last; report."""
        arrived, self._under_way = (
            self._under_way,
            [m for m in self.world.sent if isinstance(m, Contact) and m.number],
        )
        for contact in arrived:
            self.felt = contact.number
            self.told.append(contact)
            self.fleet.push(0, contact.dvx_mps, contact.dvy_mps, contact.dyaw_rate_radps,
                            contact.dx_m, contact.dy_m, contact.dyaw_rad)  # fmt: skip
        self.fleet.advance(TICK_S)
        self.seq += 1
        x, y, yaw = self.fleet.pose(0)
        state = VehicleState(
            vehicle=self.name, t_ns=now, seq=self.seq, x_m=x, y_m=y, yaw_rad=yaw,
            speed_mps=float(self.fleet.speed[0]),
            lateral_speed_mps=float(self.fleet.lateral_speed[0]),
            yaw_rate_radps=float(self.fleet.yaw_rate[0]),
            steering_rad=0.0, throttle=0.0, source="simulated", contacts=self.felt,
        )  # fmt: skip
        return Incoming(state, now)


def rear_end(seconds, ice, throttle=0.0, start=0.0):
    """Let a remote car run into a standing hosted one; return both and their gaps."""
    world = world_with()
    hosted = put(world, "a", (0.5, 0.0, 0.0), ice=ice)
    agent = Agent(world, "n7", (start, 0.0, 0.0), 0.25, ice=ice)
    gaps = []
    for i in range(round(seconds / TICK_S)):
        agent.fleet.throttle[0] = throttle
        tick(world, i * PERIOD_NS, [agent.step(i * PERIOD_NS)])
        gaps.append(hosted.pose.x - agent.fleet.x[0] - 0.30)
    return hosted, agent, gaps


def test_what_a_remote_car_is_told_is_what_the_hosted_car_gained():
    hosted, agent, _ = rear_end(3.0, ice=True)
    gained = hosted.fleet.planar_cog(hosted.row)[3]
    assert sum(contact.dvx_mps for contact in agent.told) == pytest.approx(-gained, abs=1e-9)
    assert agent.told[0].against == ("a",)


@pytest.mark.parametrize("start", [0.0, 0.001, 0.002, 0.003, 0.004])
def test_one_hit_by_a_remote_car_is_told_once(start):
    hosted, _, _ = rear_end(3.0, ice=True, start=start)
    # Equal cars on ice: the hit one leaves with (1 + e) / 2 of the speed; told twice it were more.
    gained = hosted.fleet.planar_cog(hosted.row)[3]
    assert gained == pytest.approx(0.25 * (1 + RESTITUTION) / 2, rel=0.02)


def test_a_remote_car_that_keeps_pushing_does_not_creep_into_the_hosted_one():
    _, agent, gaps = rear_end(4.0, ice=False, throttle=0.8)
    assert len(agent.told) > 10
    # The overlap stays below what the car drives in the 30 ms that a push needs to reach it.
    assert min(gaps) > -0.03 * 0.25
    assert gaps[-1] > gaps[-50] - 0.001
