"""A car that drives by a network stops at the lines of its map's signals."""

import numpy as np
import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Path, roads_of
from scm.records.signals import SignalGroup
from scm.v2x.etsi.convert import roadside_station, spatem_of
from scm.v2x.exchange import Incoming
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem import SpatemRx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.vehicles.drivers.limits import limits_of
from vehicle_agent.cloning.signal_rule import SignalRule

SCHOOL = load_map("driving_school")
JUNCTION = SCHOOL.junctions[0]
NIGEL = limits_of(load_car("nigel"))
THROTTLES = np.linspace(0.0, 1.0, len(NIGEL.speeds) + 1)
CRUISE, FULL = 0.25, 1.0  # m/s; the network's throttle
TICK_NS = 20 * NS_PER_MS


class Approach:
    """A car at constant throttle on the way to the line south_east, and what it receives.

    Args:
        gap_m: From its front bumper to the line.
        colour: Of its group; the other group has another one. None: no SPATEM arrives.
        left_m: Of its lane.
        mode: Of the SPATEM.
    """

    def __init__(self, gap_m, colour, left_m=0.0, mode="plan"):
        self.rule = SignalRule("n1", "nigel", SCHOOL)
        self._path = Path.circulation(roads_of(SCHOOL), "crossing_south_east")
        self._line_m, line = self._path.stop_lines[0]
        assert line.name == "south_east"
        self._s, self._left_m = self._line_m - NIGEL.front - gap_m, left_m
        self.colour, self.mode, self.has_pose = colour, mode, True
        self.speed, self._now_ns, self.throttles = CRUISE, 0, []

    @property
    def gap_m(self):
        return self._line_m - self._s - NIGEL.front

    def receive(self, message):
        self.rule.receive(Incoming(message, self._now_ns))

    def spatem(self):
        lasts_ns = self._now_ns + 10 * NS_PER_S
        other = "red" if self.colour == "green" else "green"
        groups = tuple(
            SignalGroup(group=one.name, colour=colour, since_ns=0, min_end_ns=lasts_ns)
            for one, colour in zip(JUNCTION.groups, (self.colour, other), strict=True)
        )
        spat = Spat(
            junction=JUNCTION.name, t_ns=self._now_ns, seq=1, mode=self.mode, plan="calm",
            groups=groups, revision=SCHOOL.revision,
        )  # fmt: skip
        body = spatem_of(spat, JUNCTION)
        station = roadside_station(JUNCTION.name)
        return SpatemRx(receiver="n1", station=station, t_ns=self._now_ns, body=body)

    def state(self):
        x, y, yaw = self._path.at(self._s) @ Pose2(0.0, self._left_m, 0.0)
        return VehicleState(
            vehicle="n1", t_ns=self._now_ns, seq=1, x_m=x, y_m=y, yaw_rad=yaw,
            speed_mps=self.speed, yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.0,
            source="simulated",
        )  # fmt: skip

    def run(self, lasts_s):
        for _ in range(round(lasts_s * NS_PER_S / TICK_NS)):
            if self.colour is not None and self._now_ns % (500 * NS_PER_MS) == 0:
                self.receive(self.spatem())
            if self.has_pose:
                self.receive(self.state())
            throttle = min(FULL, self.rule.max_throttle(self._now_ns))
            self.throttles.append(throttle)
            wanted = np.interp(throttle, THROTTLES, (0.0, *NIGEL.speeds))
            self.speed += (wanted - self.speed) * 0.3
            self._s += self.speed * TICK_NS / NS_PER_S
            self._now_ns += TICK_NS
        return self

    def stands(self):
        return self.speed < 0.005


def stops_at_line(car):
    """Return whether it stands in front of the line, and says that it waits for green."""
    is_near = 0.0 < car.gap_m < 0.08
    return (
        car.stands() and is_near and car.rule.detail == "waits for green at south_east of crossing"
    )


def test_red_stops_car_before_line_until_green():
    car = Approach(1.0, "red").run(8.0)
    assert stops_at_line(car)
    car.colour = "green"
    car.run(3.0)
    assert car.gap_m < -0.2
    assert car.rule.detail == ""


def test_green_limits_nothing_though_the_other_group_is_red():
    car = Approach(1.0, "green").run(6.0)
    assert min(car.throttles) == FULL
    assert car.gap_m < -0.2


def test_yellow_stops_car_that_can_stop_comfortably():
    assert stops_at_line(Approach(0.3, "yellow").run(6.0))


def test_yellow_lets_car_pass_that_is_too_near_to_stop():
    car = Approach(0.05, "green").run(0.04)
    car.colour = "yellow"
    car.receive(car.spatem())
    assert car.run(2.0).gap_m < -0.2
    assert min(car.throttles) == FULL


def test_without_spatem_car_stops():
    assert stops_at_line(Approach(1.0, None).run(8.0))


def test_green_of_old_spatem_stops_car():
    car = Approach(1.0, "green").run(0.1)
    car.colour = None
    assert stops_at_line(car.run(8.0))


def test_fault_of_monitor_stops_car_at_green():
    car = Approach(1.0, "green")
    car.receive(MonitorStatus(junction="crossing", t_ns=0, fault="conflict", since_ns=0))
    assert stops_at_line(car.run(8.0))


def test_flashing_red_is_a_stop_sign():
    car = Approach(0.5, "flashing_red", mode="flash").run(2.4)
    assert car.rule.detail == "gives way at flashing red at south_east of crossing"
    speeds = [car.run(0.5).speed for _ in range(20)]
    assert min(speeds) < 0.01
    assert car.gap_m < -0.2


def test_car_of_unknown_pose_stops():
    car = Approach(1.0, "green").run(0.2)
    car.has_pose = False
    car.run(1.0)
    assert car.throttles[-1] == 0.0
    assert car.rule.detail == "waits for n1's pose"


def test_car_beside_all_lanes_is_not_limited():
    car = Approach(0.2, "red", left_m=0.6).run(0.5)
    assert min(car.throttles) == FULL


def test_car_put_onto_another_lane_obeys_its_line():
    car = Approach(1.0, "green").run(0.2)
    lane = roads_of(SCHOOL).lane("crossing_south_west")
    x, y, yaw = lane.at(0.3987 - NIGEL.front - 0.1)
    there = replace(car.state(), x_m=x, y_m=y, yaw_rad=yaw, speed_mps=0.0)
    car.state = lambda: there
    car.run(0.1)
    assert car.rule.detail == "waits for green at south_west of crossing"


@pytest.mark.parametrize("colour", ["red", "green"])
def test_car_behind_line_is_not_limited(colour):
    car = Approach(-0.05, colour).run(1.0)
    assert min(car.throttles) == FULL
