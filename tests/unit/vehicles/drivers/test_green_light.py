"""Speed advice: a car comes to a red light as it turns green, and never by breaking a rule."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.grid_city import grid_city
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.city_map import RadioChannel
from scm.records.signals import SignalGroup
from scm.v2x.etsi.convert import spatem_of
from scm.v2x.etsi.topology import mapem_of, topology_of
from scm.v2x.messages.spat import Spat
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.driver_batch import DriverBatch
from scm.vehicles.drivers.green_advisor import GreenAdvisor
from scm.vehicles.drivers.green_light import advised_speed, arriving_speed, red_for
from scm.vehicles.drivers.lane_graph import LaneGraph
from scm.vehicles.drivers.speed_control import stopping_speed

NIGEL = CarLimits(
    wheelbase=0.14154, steer_limit=0.5235988, steer_rate=0.42, front=0.23, rear=0.07, width=0.175,
    speeds=(0.02867, 0.05685, 0.08457, 0.11185, 0.13871, 0.16516, 0.19122, 0.21688, 0.24215,
            0.26703),
)  # fmt: skip
TICK_NS = 20 * NS_PER_MS
LINE_LANE = "south_west"


class Approach:
    """One car on the Driving School, `far_m` before a stop line whose light the test sets."""

    def __init__(self, far_m, *, is_advised=True, radio=None):
        city_map = load_map("driving_school")
        city_map = replace(city_map, speed_advice=is_advised, radio=radio or RadioChannel())
        self.roads = Roads(city_map)
        self.junction = city_map.junctions[0]
        self.drivers = DriverBatch(LaneGraph(self.roads), 1)
        (self.line,) = (one for one in city_map.stop_lines if one.group == LINE_LANE)
        self.lanes, s = self._back(self.line.lane, self.line.at_m - NIGEL.front - far_m)
        self.x, self.y, self.yaw = self.roads.lane(self.lanes[0]).at(s)
        self.speed, self.now_ns, self.sent_ns = 0.2, 0, None
        self.drivers.enter(0, NIGEL)
        self.drivers.circulate(0, self.lanes[0], s)
        self.speeds, self.crossed_at = [], None

    def _back(self, lane, s):
        lanes = [lane]
        while s < 0.0:
            (before,) = (n for n in self.roads.lanes if lanes[0] in self.roads.successors(n))
            lanes.insert(0, before)
            s += self.roads.length_of(before)
        return lanes, s

    def tell(self, colour, end_ns):
        groups = tuple(
            SignalGroup(group=g.name, colour=colour, since_ns=0, min_end_ns=end_ns)
            for g in self.junction.groups
        )
        spat = Spat(
            junction=self.junction.name, t_ns=self.now_ns, seq=0, mode="plan", plan="calm",
            revision=self.roads.city_map.revision, groups=groups,
        )  # fmt: skip
        self.drivers.receive_spatem(spatem_of(spat, self.junction), self.now_ns)

    def left(self):
        """Return how far the front is from the line [m], negative behind it."""
        if self.crossed_at is not None:
            return self.crossed_done - float(self.drivers.done_m[0])
        lane = self.drivers.lane_graph.names[self.drivers.lane[0]]
        if lane not in self.lanes:
            return -math.inf
        ahead = self.lanes[self.lanes.index(lane) : -1]
        between = sum(self.roads.length_of(name) for name in ahead)
        return between + self.line.at_m - self.drivers.s[0] - NIGEL.front

    def drive(self, seconds, green_at_s, promised_s=None):
        """Drive on; the light is red until then, and SPATEM promises it until `promised_s`."""
        promised_ns = round(1e9 * (green_at_s if promised_s is None else promised_s))
        for _ in range(round(seconds / 0.02)):
            is_green = self.now_ns >= green_at_s * 1e9
            if self.now_ns % (500 * NS_PER_MS) == 0 or (is_green and self.sent_ns is None):
                self.sent_ns = self.now_ns if is_green else None
                end_ns = self.now_ns + 10**10 if is_green else max(promised_ns, self.now_ns)
                self.tell("green" if is_green else "red", end_ns)
            self.tick()
            self.speeds.append(self.speed)
            if self.crossed_at is None and self.left() < 0.0:
                self.crossed_done = float(self.drivers.done_m[0])
                self.crossed_at = 1e-9 * self.now_ns
        return self

    def tick(self):
        row = (np.array([value]) for value in (self.x, self.y, self.yaw, self.speed))
        self.drivers.decide(self.now_ns, *row, np.ones(1, np.bool_))
        wanted = np.interp(self.drivers.throttle[0], np.linspace(0, 1, 11), (0.0, *NIGEL.speeds))
        self.speed += float(wanted - self.speed) * 0.28
        angle = float(self.drivers.steering[0]) * NIGEL.steer_limit
        self.x += self.speed * math.cos(self.yaw) * 0.02
        self.y += self.speed * math.sin(self.yaw) * 0.02
        self.yaw += self.speed * math.tan(angle) / NIGEL.wheelbase * 0.02
        self.now_ns += TICK_NS


@pytest.mark.parametrize(("distance", "wait"), [(2.5, 15.0), (1.0, 6.0), (0.4, 2.0)])
def test_who_drives_at_the_advised_speed_has_just_not_begun_to_brake_when_the_time_comes(
    distance, wait
):
    speed = arriving_speed(distance, wait, 0.5)
    assert stopping_speed(distance - speed * wait, 0.5) == pytest.approx(speed, abs=1e-9)


def test_advice_is_never_above_what_is_allowed_nor_below_the_floor():
    for wait in np.linspace(-5.0, 100.0, 43):
        for distance in (0.0, 0.3, 1.0, 4.0):
            speed = advised_speed(distance, wait, 0.5, 0.25, 0.1)
            assert 0.1 <= speed <= 0.25
    assert advised_speed(1.0, 0.0, 0.5, 0.25, 0.1) == 0.25
    assert advised_speed(1.0, 8.0, 0.5, 0.05, 0.1) == 0.05


def test_an_advised_car_rolls_through_the_green_that_stops_another_one():
    with_it = Approach(2.5).drive(18.0, 14.0)
    without = Approach(2.5, is_advised=False).drive(18.0, 14.0)
    assert min(without.speeds) < 0.01
    assert min(with_it.speeds) > 0.1
    assert 14.0 <= with_it.crossed_at <= without.crossed_at + 0.1
    assert with_it.left() < without.left() + 0.03
    assert max(with_it.speeds) <= max(without.speeds) + 0.002


def test_it_slows_down_gently():
    changes = np.diff(Approach(2.5).drive(12.0, 14.0).speeds) / 0.02
    assert changes.min() > -0.6


@pytest.mark.parametrize("promised_s", [8.0, 1.0])
def test_a_red_that_lasts_longer_than_its_earliest_end_still_stops_the_car(promised_s):
    late = Approach(2.5).drive(30.0, math.inf, promised_s)
    assert late.crossed_at is None
    assert late.speeds[-1] < 0.01
    assert late.left() > 0.0


def test_a_light_that_falls_silent_stops_the_car():
    silent = Approach(2.5).drive(4.0, 14.0)
    for _ in range(1500):
        silent.tick()
    assert silent.left() > 0.0
    assert silent.speed < 0.01


def test_a_promise_counts_even_when_most_frames_get_lost():
    lossy = Approach(2.5, radio=RadioChannel(loss=0.6)).drive(12.0, 14.0)
    assert 0.1 < lossy.speeds[-1] < 0.2


def test_a_flashing_or_accused_junction_promises_nothing():
    car = Approach(2.0)
    car.tell("red", 8 * 10**9)
    told, group = car.drivers.signals.received, car.drivers.lane_graph.arrays.line_links[0, 0]
    place = told.newest[0]
    assert red_for(told, group, 0, place, 0) == pytest.approx(8.0, abs=0.11)
    assert red_for(told, group, 0, place, 9 * 10**9) < 0.0
    told.fault[0] = True
    assert red_for(told, group, 0, place, 0) == 0.0
    told.fault[0], told.flashing[place, 0] = False, True
    assert red_for(told, group, 0, place, 0) == 0.0


def test_a_car_without_a_map_is_advised_by_mapem_and_spatem():
    roads, now_ns = Roads(grid_city(3, 3)), 3 * 10**9
    advisor, junction = GreenAdvisor(NIGEL), roads.city_map.junctions[4]
    line = next(one for one in roads.city_map.stop_lines if one.junction == junction.name)
    pose = Pose2(*roads.lane(line.lane).at(line.at_m - NIGEL.front - 1.6))
    spat = Spat(
        junction=junction.name, t_ns=now_ns, seq=0, mode="plan", plan="calm",
        revision=roads.city_map.revision,
        groups=tuple(
            SignalGroup(
                group=g.name, colour="red", since_ns=0, min_end_ns=now_ns + 9 * 10**9,
                max_end_ns=now_ns + 12 * 10**9, likely_end_ns=now_ns + 10**10,
                likely_confidence=0.78,
            )
            for g in junction.groups
        ),
    )  # fmt: skip
    advisor.receive_spatem(spatem_of(spat, junction), now_ns)
    assert advisor.advise(pose, now_ns) is None
    advisor.receive_mapem(mapem_of(roads, junction))
    told = advisor.advise(pose, now_ns)
    assert told.lane == topology_of(roads, junction).lane_in(line.group)
    assert told.distance_m == pytest.approx(1.6, abs=0.005)
    assert (told.earliest_s, told.latest_s) == pytest.approx((9.0, 12.0), abs=0.11)
    assert told.likely_s == pytest.approx(10.0, abs=0.11)
    assert (told.confidence, told.is_green) == (0.77, False)
    assert told.speed_mps == pytest.approx(arriving_speed(1.56, told.earliest_s, 0.5), abs=0.001)
    assert advisor.advise(pose, now_ns + 2 * 10**9) is None
    assert advisor.advise(Pose2(pose.x, pose.y, pose.yaw + math.pi), now_ns) is None
