"""Many drivers at once: the same decisions as alone, and streets that stay safe and moving."""

import itertools
import math
from functools import cache

import numpy as np
import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.geometry import Pose2
from scm.maps.grid_city import grid_city
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.city_map import RadioChannel
from scm.traffic.signals.part import TrafficPart
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem import SpatemTx
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.channel import channel_of, has_arrived
from scm.vehicles.drivers.driver_batch import DriverBatch
from scm.vehicles.drivers.driver_state import WAITING_FOR
from scm.vehicles.drivers.lane_graph import LaneGraph
from scm.vehicles.drivers.received_cams import estimate_for
from scm.vehicles.jit import plain

NIGEL = CarLimits(
    wheelbase=0.14154, steer_limit=0.5235988, steer_rate=0.42, front=0.23, rear=0.07, width=0.175,
    speeds=(0.02867, 0.05685, 0.08457, 0.11185, 0.13871, 0.16516, 0.19122, 0.21688, 0.24215,
            0.26703),
)  # fmt: skip
TICK_NS = 20 * NS_PER_MS


@pytest.fixture(scope="module")
def grid():
    return Roads(grid_city(3, 3))


@pytest.fixture(scope="module")
def eight():
    return Roads(load_map("driving_school"))


class City:
    """Bicycles with slow servos on a map, driven by a crowd; everybody publishes at each tick."""

    def __init__(self, roads, places, seeds=None, **options):
        n = len(places)
        self.roads = roads
        self.drivers = DriverBatch(LaneGraph(roads), n, **options)
        self.traffic = TrafficPart(roads.city_map)
        self.x, self.y, self.yaw, self.speed, self.angle = np.zeros((5, n))
        self.driven = np.ones(n, np.bool_)
        self.now_ns = 0
        self.colours = {}
        for slot, (lane, s) in enumerate(places):
            self.x[slot], self.y[slot], self.yaw[slot] = roads.lane(lane).at(s)
            self.drivers.enter(slot, NIGEL, seeds[slot] if seeds else slot)
            self.drivers.circulate(slot, lane, s)

    def publish(self):
        if self.now_ns % (100 * NS_PER_MS) == 0:
            for message in self.traffic.step(self.now_ns, []):
                if isinstance(message, SpatemTx):
                    self.drivers.receive_spatem(message.body, self.now_ns)
                elif isinstance(message, Spat):
                    for group in message.groups:
                        self.colours[message.junction, group.group] = group.colour
        ahead = NIGEL.front * np.cos(self.yaw), NIGEL.front * np.sin(self.yaw)
        rate = self.speed * np.tan(self.angle) / NIGEL.wheelbase
        slots = np.arange(len(self.x))
        cam = self.x + ahead[0], self.y + ahead[1], self.yaw, self.speed, rate
        self.drivers.receive_cams(slots, self.now_ns, *cam)

    def decide(self):
        self.drivers.decide(self.now_ns, self.x, self.y, self.yaw, self.speed, self.driven)

    def tick(self):
        self.publish()
        self.decide()
        most = NIGEL.steer_rate * 0.01
        wanted = np.interp(self.drivers.throttle, np.linspace(0, 1, 11), (0.0, *NIGEL.speeds))
        for _ in range(2):
            turn = self.drivers.steering * NIGEL.steer_limit - self.angle
            self.angle += np.clip(turn, -most, most)
            self.speed += (wanted - self.speed) * 0.15
            self.x += self.speed * np.cos(self.yaw) * 0.01
            self.y += self.speed * np.sin(self.yaw) * 0.01
            self.yaw += self.speed * np.tan(self.angle) / NIGEL.wheelbase * 0.95 * 0.01
        self.now_ns += TICK_NS


def on_streets(roads, count, seed=0):
    """Return places for cars, by lot, on the streets of a grid city."""
    spawns = roads.city_map.spawns
    lot = np.random.default_rng(seed).choice(len(spawns), count, replace=False)
    return [(spawns[k].lane, spawns[k].at_m) for k in lot]


def touching(city):
    """Return the pairs of cars whose outlines overlap."""
    middles = np.column_stack([city.x + 0.08 * np.cos(city.yaw), city.y + 0.08 * np.sin(city.yaw)])
    one, other = np.triu_indices(len(middles), 1)
    near = np.hypot(*(middles[one] - middles[other]).T) < 0.36
    return [
        (a, b)
        for a, b in zip(one[near], other[near], strict=True)
        if not (apart(city.yaw, middles, a, b) or apart(city.yaw, middles, b, a))
    ]


def apart(yaw, middles, a, b):
    seen = Pose2(*middles[a], yaw[a]).inverse().apply(*middles[b])
    cos, sin = abs(math.cos(yaw[b] - yaw[a])), abs(math.sin(yaw[b] - yaw[a]))
    along, across = 0.15 + 0.15 * cos + 0.0875 * sin, 0.0875 + 0.15 * sin + 0.0875 * cos
    return abs(seen[0]) > along or abs(seen[1]) > across


def test_dense_traffic_flows_without_touching_running_red_or_blocking_a_junction(grid):
    city = City(grid, on_streets(grid, 60))
    lines = {line.lane: line for line in grid.city_map.stop_lines}
    inside = {m.lane for j in grid.city_map.junctions for g in j.groups for m in g.movements}
    names, drivers = city.drivers.lane_graph.names, city.drivers
    line_m = np.array([lines[name].at_m if name in lines else math.inf for name in names])
    is_inside = np.array([name in inside for name in names])
    passed, began, driven = 0, np.zeros(60), np.zeros(60)
    for tick in range(6000):
        before, was_at_m = drivers.lane.copy(), drivers.s + NIGEL.front
        city.tick()
        driven += city.speed * 0.02
        lane, is_at_m = drivers.lane, drivers.s + NIGEL.front
        crosses = (lane == before) & (was_at_m <= line_m[lane]) & (line_m[lane] < is_at_m)
        for slot in np.flatnonzero(crosses):
            line = lines[names[lane[slot]]]
            assert city.colours[line.junction, line.group] in ("green", "yellow")
        passed += np.count_nonzero(crosses)
        began = np.where(is_inside[lane], began, tick)
        assert (tick - began).max() < 1000, "a car has been in a junction for 20 s"
        if tick % 25 == 0:
            assert touching(city) == []
        if tick > 250:
            assert np.abs(drivers.cross_track).max() < 0.007
    assert passed > 60
    assert driven.min() > 0.8  # all junctions share the longest cycle of them, for a green wave


def test_every_car_of_a_crowd_decides_as_it_would_alone(eight):
    places = [("east_loop", 0.3), ("west_loop", 1.1), ("crossing_south_east", 0.1)]
    together = City(eight, places)
    alone = [City(eight, [place], [slot]) for slot, place in enumerate(places)]
    for _ in range(100):
        together.tick()
        for slot, one in enumerate(alone):
            one.tick()
            assert one.drivers.throttle[0] == together.drivers.throttle[slot]
            assert one.drivers.steering[0] == together.drivers.steering[slot]


def test_how_many_threads_work_changes_nothing(grid, monkeypatch):
    monkeypatch.setattr("scm.vehicles.drivers.driver_batch.MIN_CARS_FOR_THREADS", 2)
    one, two = (City(grid, on_streets(grid, 40)) for _ in range(2))
    two.drivers.threads = 2
    for _ in range(200):
        one.tick()
        two.tick()
    assert np.array_equal(one.drivers.throttle, two.drivers.throttle)
    assert np.array_equal(one.x, two.x)


def test_where_a_car_turns_depends_on_its_own_seed_alone(grid):
    lane = grid.city_map.spawns[0].lane
    drivers = DriverBatch(LaneGraph(grid), 3)
    for slot, seed in enumerate((7, 8, 7)):
        drivers.enter(slot, NIGEL, seed)
        drivers.circulate(slot, lane, 0.2)
    assert drivers.planned_lanes(0) == drivers.planned_lanes(2)
    assert drivers.planned_lanes(0) != drivers.planned_lanes(1)


def test_all_ways_behind_a_junction_are_taken(grid):
    spawn = next(
        s for s in grid.city_map.spawns if len(grid.successors(grid.successors(s.lane)[0]))
    )
    drivers = DriverBatch(LaneGraph(grid), 1)
    taken = set()
    for seed in range(40):
        drivers.enter(0, NIGEL, seed)
        drivers.circulate(0, spawn.lane, 0.2)
        taken.add(drivers.planned_lanes(0)[1])
    assert taken == set(grid.successors(spawn.lane))


def test_a_car_without_a_driver_keeps_its_commands(eight):
    city = City(eight, [("east_loop", 0.3)])
    city.tick()
    before = float(city.drivers.throttle[0])
    city.driven[:] = False
    city.decide()
    assert city.drivers.throttle[0] == before > 0.0


def test_a_halted_car_is_not_driven_before_it_is_sent_again(eight):
    city = City(eight, [("east_loop", 0.3)])
    city.drivers.halt(0)
    city.tick()
    assert city.drivers.throttle[0] == 0.0
    city.drivers.circulate(0, "east_loop", 0.3)
    city.tick()
    assert city.drivers.throttle[0] > 0.0


def test_a_car_behind_another_stops_and_reports_why(eight):
    city = City(eight, [("east_loop", 0.3), ("east_loop", 1.2)])
    city.driven[1] = False
    for _ in range(400):
        city.tick()
    gap = 1.2 - NIGEL.rear - (city.drivers.s[0] + NIGEL.front)
    assert 0.05 < gap < 0.15
    assert WAITING_FOR[city.drivers.waiting[0]] == "vehicle"


def test_a_removed_car_is_not_received(eight):
    city = City(eight, [("east_loop", 0.3), ("east_loop", 1.0)])
    city.driven[1] = False
    city.drivers.leave(1)
    for _ in range(300):
        city.tick()
    assert city.drivers.done_m[0] > 1.0


@pytest.mark.parametrize(("queue", "enters"), [(7, False), (3, True)])
def test_no_car_enters_a_junction_with_a_full_exit_even_if_all_roll_there(grid, queue, enters):
    """A street full of cars that say they roll leaves no place once they have to stop."""
    line = next(line for line in grid.city_map.stop_lines if line.lane == "j0_1_e")
    way, street = "j1_1_ee", "j1_1_e"
    assert grid.stop_lines_on(street)
    places = [(line.lane, line.at_m - 0.8), *((street, 0.5 + 0.37 * k) for k in range(queue))]
    city = City(grid, places)
    city.drivers.send(0, (line.lane, way, street), line.at_m - 0.8)
    city.driven[1:] = False
    x, y, was_green = city.x[1:].copy(), city.y[1:].copy(), 0
    for _ in range(3500):
        city.x[1:], city.y[1:], city.speed[1:] = x, y, 0.2
        city.tick()
        was_green += city.colours[line.junction, line.group] == "green"
    assert was_green > 100
    assert bool(city.drivers.passed[0] > 0) is enters


def test_with_all_frames_lost_no_car_is_known(eight):
    city = City(eight, [("east_loop", 0.3), ("east_loop", 1.2)], radio=RadioChannel(loss=1.0))
    city.driven[1] = False
    for _ in range(300):
        city.tick()
    assert city.drivers.s[0] + NIGEL.front > 1.2


def test_with_some_frames_lost_cars_still_keep_apart(eight):
    city = City(eight, [("east_loop", 0.3), ("east_loop", 1.2)], radio=RadioChannel(loss=0.3))
    city.driven[1] = False
    for _ in range(400):
        city.tick()
    assert touching(city) == []


@cache
def air_of(loss, receivers):
    return channel_of(RadioChannel(loss=loss), 20.0, receivers, np.zeros((0, 4)))


def reached(loss, seed, sender, receiver, frame):
    return has_arrived(air_of(loss, 1 + receiver), seed, sender, receiver, frame, 0.0, 0.0, 0)


def test_luck_takes_its_share_of_frames_evenly():
    frames = itertools.product(range(20), range(20), range(50))
    got = [reached(0.3, 5, sender, receiver, n) for sender, receiver, n in frames]
    assert np.mean(got) == pytest.approx(0.7, abs=0.01)


def test_luck_depends_on_sender_receiver_and_frame():
    def draw(seed=1, sender=2, receiver=3):
        return [reached(0.5, seed, sender, receiver, n) for n in range(64)]

    assert draw() == draw()
    assert draw() != draw(seed=9)
    assert draw() != draw(sender=9)
    assert draw() != draw(receiver=9)


def test_routes_sent_again_and_again_take_no_more_room(eight):
    drivers = DriverBatch(LaneGraph(eight), 2)
    for slot in range(2):
        drivers.enter(slot, NIGEL)
    drivers.send(1, ("east_loop", "crossing_south_west"), 0.5)
    for _ in range(2000):
        drivers.send(0, ("west_loop", "crossing_south_east", "east_loop"), 0.1)
    assert drivers.planned_lanes(1) == ("east_loop", "crossing_south_west")
    assert drivers.planned_lanes(0) == ("west_loop", "crossing_south_east", "east_loop")
    assert len(drivers._state.routes) < 200


def test_a_silent_car_is_forgotten(eight):
    city = City(eight, [("east_loop", 0.3), ("east_loop", 1.0)])
    city.driven[1] = False
    city.publish()
    city.now_ns += 4 * NS_PER_S
    city.decide()
    assert city.drivers.throttle[0] > 0.0


def test_where_frames_get_lost_a_silent_car_is_believed_to_stand_where_it_stood(grid):
    now_ns = 10 * NS_PER_S
    for air, after_s, is_known in (
        (RadioChannel(loss=0.3), 3.5, True),
        (RadioChannel(loss=0.3), 17.0, False),
    ):
        drivers = DriverBatch(LaneGraph(grid), 2, radio=air)
        drivers.enter(0, NIGEL, 0)
        drivers.show(1, 0.3, 0.175)
        for frame in range(16):
            cam = np.array([[1.0], [1.0], [0.0], [0.0], [0.0]])
            drivers.receive_cams(np.array([1]), now_ns + frame * NS_PER_MS, *cam)
        sent_ns = now_ns + round(after_s * NS_PER_S)
        known, x, *_ = plain(estimate_for)(drivers._received, 1, 0, sent_ns, 0)
        assert known == is_known
        assert x == (pytest.approx(0.85) if is_known else 0.0)
