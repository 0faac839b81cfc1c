"""Who goes first where there are no lights: stop signs, give-way signs, right before left."""

import math

import msgspec
import numpy as np
import pytest

from scm.clock import NS_PER_MS
from scm.maps.grid_city import grid_city
from scm.maps.route import Roads
from scm.records.city_map import RadioChannel, Sign
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.channel import POOR_RECEPTION
from scm.vehicles.drivers.driver_batch import DriverBatch
from scm.vehicles.drivers.driver_state import WAITING_FOR
from scm.vehicles.drivers.lane_graph import LaneGraph

NIGEL = CarLimits(
    wheelbase=0.14154, steer_limit=0.5235988, steer_rate=0.42, front=0.23, rear=0.07, width=0.175,
    speeds=(0.02867, 0.05685, 0.08457, 0.11185, 0.13871, 0.16516, 0.19122, 0.21688, 0.24215,
            0.26703),
)  # fmt: skip
TICK_NS = 20 * NS_PER_MS
LINE_M = 6.0 - 2 * 0.54 - 0.14
ARMS = {"e": "j0_1_e", "n": "j1_0_n", "w": "j2_1_w", "s": "j1_2_s"}
LEFT = {"e": "n", "n": "w", "w": "s", "s": "e"}


def crossing(*kinds):
    """Roads of a 3 x 3 city whose middle junction has these signs, by approach: `e stop`."""
    city = grid_city(3, 3, block_m=6.0, signs=True)
    signs = []
    for number, (arm, kind) in enumerate((k.split() for k in kinds), start=1):
        signs.append(
            Sign(sign_id=number, kind=kind, x_m=0.0, y_m=0.0, yaw_rad=0.0, lane=ARMS[arm],
                 at_m=LINE_M)
        )  # fmt: skip
    return Roads(msgspec.structs.replace(city, signs=tuple(signs)))


def way(arm, to):
    return (ARMS[arm], f"j1_1_{arm}{to}", f"j1_1_{to}")


class Drive:
    """Bicycles that drive over the middle junction; everybody tells all every 100 ms.

    `cars` are (arm, to, how far the front is from the line [m]).
    """

    def __init__(self, roads, cars, **options):
        n = len(cars)
        self.drivers = DriverBatch(LaneGraph(roads), n, **options)
        self.x, self.y, self.yaw, self.speed, self.angle = np.zeros((5, n))
        self.driven, self.heard = np.ones(n, np.bool_), np.ones(n, np.bool_)
        self.now_ns = 0
        self.crossed_s = [None] * n
        self.stood_s = np.zeros(n)
        for slot, (arm, to, before) in enumerate(cars):
            s = LINE_M - before - NIGEL.front
            self.x[slot], self.y[slot], self.yaw[slot] = roads.lane(ARMS[arm]).at(s)
            self.drivers.enter(slot, NIGEL, slot)
            self.drivers.send(slot, way(arm, to), s)
        self.names = self.drivers.lane_graph.names

    def tick(self):
        if self.now_ns % (100 * NS_PER_MS) == 0:
            slots = np.flatnonzero(self.heard)
            x = self.x + NIGEL.front * np.cos(self.yaw)
            y = self.y + NIGEL.front * np.sin(self.yaw)
            told = (x[slots], y[slots], self.yaw[slots], self.speed[slots], np.zeros(len(slots)))
            self.drivers.receive_cams(slots, self.now_ns, *told)
        drivers = self.drivers
        drivers.decide(self.now_ns, self.x, self.y, self.yaw, self.speed, self.driven)
        step = 1e-9 * TICK_NS
        wished = np.where(self.driven, drivers.steering, 0.0) * NIGEL.steer_limit
        most = NIGEL.steer_rate * step
        self.angle += np.clip(wished - self.angle, -most, most)
        throttle = np.where(self.driven, np.maximum(0.0, drivers.throttle), 0.0)
        self.speed += (0.267 * throttle - self.speed) * 0.28
        self.x += self.speed * np.cos(self.yaw) * step
        self.y += self.speed * np.sin(self.yaw) * step
        self.yaw += self.speed * np.tan(self.angle) / NIGEL.wheelbase * step
        self.now_ns += TICK_NS
        self._note(step)

    def _note(self, step):
        for slot in range(len(self.x)):
            lane, s = self.names[self.drivers.lane[slot]], self.drivers.s[slot]
            is_before = lane in ARMS.values() and s + NIGEL.front < LINE_M
            if is_before and self.speed[slot] < 0.01:
                self.stood_s[slot] += step
            if not is_before and self.crossed_s[slot] is None:
                self.crossed_s[slot] = 1e-9 * self.now_ns

    def run(self, span_s):
        for _ in range(round(span_s / 0.02)):
            self.tick()
            assert not self.touching()
        return self

    def touching(self):
        """Whether two cars overlap: corners of one in the other."""
        for a in range(len(self.x)):
            for b in range(len(self.x)):
                if a != b and self._holds_corner(a, b):
                    return True
        return False

    def _holds_corner(self, a, b):
        for ahead in (NIGEL.front, 0.08, -NIGEL.rear):
            for side in (-0.0875, 0.0875):
                x = self.x[b] + ahead * math.cos(self.yaw[b]) - side * math.sin(self.yaw[b])
                y = self.y[b] + ahead * math.sin(self.yaw[b]) + side * math.cos(self.yaw[b])
                dx, dy = x - self.x[a], y - self.y[a]
                u = dx * math.cos(self.yaw[a]) + dy * math.sin(self.yaw[a])
                v = dy * math.cos(self.yaw[a]) - dx * math.sin(self.yaw[a])
                if -NIGEL.rear <= u <= NIGEL.front and abs(v) <= 0.0875:
                    return True
        return False

    def reason(self, slot):
        return WAITING_FOR[self.drivers.waiting[slot]]


def test_a_car_rests_half_a_second_at_a_stop_sign_and_then_goes():
    drive = Drive(crossing("e stop"), [("e", "e", 0.8)]).run(7.0)
    assert 0.5 <= drive.stood_s[0] <= 1.2
    assert drive.crossed_s[0] is not None


def test_a_car_reports_that_it_waits_at_a_sign():
    drive = Drive(crossing("e stop"), [("e", "e", 0.3)])
    reasons = set()
    for _ in range(160):
        drive.tick()
        reasons.add(drive.reason(0))
    assert "sign" in reasons


@pytest.mark.parametrize("kinds", [(), ("e give_way",)])
def test_no_car_waits_without_crossing_traffic(kinds):
    drive = Drive(crossing(*kinds), [("e", "e", 0.8)]).run(5.0)
    assert drive.stood_s[0] == 0.0
    assert drive.crossed_s[0] < 4.5


def test_where_all_stop_those_go_first_who_stood_there_first():
    kinds = ("e stop", "n stop", "w stop", "s stop")
    cars = [("e", "e", 0.9), ("n", "n", 0.5), ("w", "s", 0.7), ("s", "s", 1.1)]
    drive = Drive(crossing(*kinds), cars).run(40.0)
    assert sorted(range(4), key=lambda slot: drive.crossed_s[slot]) == [1, 2, 0, 3]


def test_two_that_come_to_stop_signs_together_both_go_on_one_after_the_other():
    drive = Drive(crossing("e stop", "n stop", "w stop", "s stop"),
                  [("e", "e", 0.6), ("n", "n", 0.6)]).run(20.0)  # fmt: skip
    first, second = sorted(drive.crossed_s)
    assert second - first > 1.5


def test_right_comes_before_left():
    drive = Drive(crossing(), [("e", "e", 0.8), ("n", "n", 0.8)]).run(20.0)
    # who heads north comes from the right of who heads east
    assert drive.stood_s[0] > 0.5
    assert drive.stood_s[1] == 0.0
    assert drive.crossed_s[1] < drive.crossed_s[0]


def test_a_left_turner_lets_oncoming_cars_pass():
    drive = Drive(crossing(), [("e", "n", 0.6), ("w", "w", 0.9)]).run(20.0)
    assert drive.crossed_s[1] < drive.crossed_s[0]
    assert drive.stood_s[1] == 0.0


def test_cars_straight_on_do_not_wait_for_oncoming_ones():
    drive = Drive(crossing(), [("e", "e", 0.8), ("w", "w", 0.8)]).run(8.0)
    assert list(drive.stood_s) == [0.0, 0.0]


@pytest.mark.parametrize(("before", "waits"), [(1.0, True), (3.6, False)])
def test_who_gives_way_goes_into_a_gap_that_is_large_enough(before, waits):
    drive = Drive(crossing("n give_way", "s give_way"),
                  [("n", "n", 0.8), ("e", "e", before)]).run(25.0)  # fmt: skip
    assert (drive.crossed_s[0] > drive.crossed_s[1]) == waits
    assert drive.stood_s[1] == 0.0


def test_four_that_all_wait_for_their_right_come_through():
    cars = [(arm, arm, 0.6) for arm in "enws"]
    drive = Drive(crossing(), cars).run(45.0)
    assert None not in drive.crossed_s


def test_a_car_with_the_right_of_way_is_remembered_while_its_cams_are_lost():
    drive = Drive(crossing("n give_way", "s give_way"), [("n", "n", 0.6), ("e", "e", 1.1)])
    drive.tick()
    drive.heard[1] = False
    drive.run(2.5)
    assert drive.crossed_s[0] is None


@pytest.mark.parametrize("seed", [3, 4])
def test_no_contact_with_a_third_of_all_frames_lost(seed):
    kinds = ("e stop", "n stop", "w stop", "s stop")
    cars = [("e", "e", 0.6), ("n", "w", 0.6), ("w", "s", 0.6), ("s", "s", 0.6)]
    air = RadioChannel(loss=0.3)
    drive = Drive(crossing(*kinds), cars, radio=air, seed=seed).run(45.0)
    assert None not in drive.crossed_s


def test_with_poor_reception_a_car_waits_at_its_stop_line():
    for arm, to, goes in (("n", "n", False), ("e", "e", True)):
        drive = Drive(crossing("n give_way", "s give_way"), [(arm, to, 0.6)])
        drive.drivers.channel.numbers[POOR_RECEPTION] = 1.0
        drive.run(10.0)
        assert (drive.crossed_s[0] is not None) == goes
        drive.drivers.channel.numbers[POOR_RECEPTION] = 0.0
        drive.run(5.0)
        assert drive.crossed_s[0] is not None


def test_a_driver_alone_with_a_lossy_radio_waits_until_it_receives_a_cam():
    air, far = RadioChannel(loss=0.2), ("w", "w", 4.0)
    roads = crossing("n give_way", "s give_way")
    drive = Drive(roads, [("n", "n", 0.6), far], radio=air)
    drive.driven[1], drive.heard[1] = False, False
    drive.run(12.0)
    assert drive.crossed_s[0] is None
    drive.heard[1] = True
    drive.run(8.0)
    assert drive.crossed_s[0] is not None


def test_who_stood_for_long_has_its_turn_before_those_with_the_right_of_way():
    drive = Drive(crossing("n give_way", "s give_way"), [("n", "n", 0.05), ("e", "e", 0.8)])
    drive.driven[:] = False
    drive.run(19.0)
    drive.driven[1] = True
    drive.run(13.0)
    # the turn ends 27 s after the first CAM: by then who does not go has lost it
    assert drive.stood_s[1] > 19.0 + 2.0
    assert 27.0 < drive.crossed_s[1] < 31.0


def test_a_car_that_stays_before_its_line_does_not_block_the_junction_for_ever():
    drive = Drive(crossing("n give_way", "s give_way"), [("n", "n", 0.6), ("e", "e", 0.05)])
    drive.driven[1] = False
    drive.run(12.0)
    assert drive.crossed_s[0] is not None


def mirrored(lane):
    x, y, yaw = lane.start
    segments = tuple(
        msgspec.structs.replace(s, angle_rad=-s.angle_rad) if s.angle_rad else s
        for s in lane.segments
    )
    return msgspec.structs.replace(lane, start=(x, -y, -yaw), segments=segments)


def test_where_cars_drive_on_the_left_they_yield_in_the_mirror_image():
    city = msgspec.structs.replace(grid_city(3, 3, block_m=6.0, signs=True), signs=())
    lanes = tuple(map(mirrored, city.lanes))
    right = LaneGraph(Roads(city)).arrays.rules
    left = LaneGraph(
        Roads(msgspec.structs.replace(city, lanes=lanes, drives_on="left"))
    ).arrays.rules
    assert right.pair_way.tolist() == left.pair_way.tolist()
    assert right.pair_yields.tolist() == left.pair_yields.tolist()
    assert any(right.pair_yields)
