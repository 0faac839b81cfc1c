"""Bays go to cars that report, one car drives at a time, and nothing is given twice."""

import math

import pytest

from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.traffic.parking.lot import LEARN_NS, SILENT_NS, STUCK_NS, Lot
from scm.v2x.message import Refused
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.bay_request import BayReply, BayRequest
from scm.v2x.messages.vehicle_state import VehicleState

LOT = load_map("parking_lot")
NAMES = [bay.name for bay in LOT.bays]
POSES = {bay.name: Pose2(*bay.pose) for bay in LOT.bays}
ENTRANCE = Pose2(-1.8, 0.0, 0.0)


class Cars:
    """A lot and cars that report to it; time is that of the test."""

    def __init__(self, now_s=0.0):
        self.now_ns = round(now_s * NS_PER_S)
        self.lot = Lot(LOT, self.now_ns)
        self.reports = {}

    def ask(self, name, bay=""):
        return self.lot.reserve(BayRequest(vehicle=name, bay=bay), self.now_ns)

    def report(self, name, state, bay="", pose=ENTRANCE, attempts=0):
        """From now on a car reports this at every step."""
        goal = POSES.get(bay)
        self.reports[name] = AutonomyStatus(
            vehicle=name, t_ns=0, state=state, attempts=attempts,
            goal_x_m=goal and goal.x, goal_y_m=goal and goal.y, goal_yaw_rad=goal and goal.yaw,
            x_m=pose.x, y_m=pose.y, yaw_rad=pose.yaw,
        )  # fmt: skip

    def stand(self, name, pose, source="simulated"):
        """From now on the car itself reports where it is."""
        self.reports[name, "state"] = VehicleState(
            vehicle=name, t_ns=0, seq=0, x_m=pose.x, y_m=pose.y, yaw_rad=pose.yaw, speed_mps=0.0,
            yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.0, source=source,
        )  # fmt: skip

    def run(self, span_s):
        for _ in range(round(span_s * 5)):
            self.now_ns += NS_PER_S // 5
            for report in self.reports.values():
                if isinstance(report, AutonomyStatus):
                    self.lot.receive_status(report, self.now_ns)
                else:
                    self.lot.receive_state(report, self.now_ns)
            self.lot.step(self.now_ns)
        return self.lot.report(self.now_ns)

    def come(self, *names):
        """Cars ask and wait; return their bays."""
        bays = [self.ask(name).bay for name in names]
        for name, bay in zip(names, bays, strict=True):
            self.report(name, "plan", bay)
        return bays

    def bay(self, name):
        row = next(row for row in self.lot.report(self.now_ns).bays if row.name == name)
        return row.state, row.vehicle


@pytest.fixture
def cars():
    cars = Cars()
    cars.run(LEARN_NS / NS_PER_S)
    return cars


def test_two_requests_at_once_get_two_bays_in_the_order_of_the_map(cars):
    assert cars.come("n1", "n2") == NAMES[:2]
    assert cars.bay(NAMES[0]) == ("reserved", "n1")
    assert cars.bay(NAMES[2]) == ("free", "")


def test_reply_has_the_pose_of_the_bay(cars):
    reply = cars.ask("n1", "b3")
    assert isinstance(reply, BayReply)
    assert Pose2(reply.x_m, reply.y_m, reply.yaw_rad) == POSES["b3"]


def test_request_that_is_repeated_gets_the_same_bay(cars):
    assert cars.ask("n1") == cars.ask("n1")
    assert [row.vehicle for row in cars.run(0.2).bays].count("n1") == 1


def test_cars_drive_one_at_a_time_in_the_order_of_their_requests(cars):
    names = ["n3", "n1", "n2"]
    bays = cars.come(*names)
    for k, (name, bay) in enumerate(zip(names, bays, strict=True)):
        status = cars.run(0.4)
        assert (status.driver, status.waiting) == (name, tuple(names[k + 1 :]))
        cars.report(name, "drive", bay, attempts=1)
        assert cars.run(3.0).driver == name
        cars.report(name, "parked", bay, POSES[bay])
    assert cars.run(0.4).driver == ""
    assert [cars.bay(bay) for bay in bays] == [("occupied", name) for name in names]


def test_car_that_gives_up_frees_its_bay_and_lets_the_next_one_drive(cars):
    first, _ = cars.come("n1", "n2")
    assert cars.run(0.4).driver == "n1"
    cars.report("n1", "failed", first)
    assert cars.run(0.4).driver == "n2"
    assert cars.bay(first) == ("free", "")


def test_silent_car_loses_turn_and_bay_only_after_its_permission_has_ended(cars):
    first, _ = cars.come("n1", "n2")
    cars.report("n1", "drive", first)
    status = cars.run(1.0)
    assert status.permission_ms * 1_000_000 + NS_PER_S < SILENT_NS
    del cars.reports["n1"]
    assert cars.run(SILENT_NS / NS_PER_S - 0.4).driver == "n1"
    assert cars.run(0.8).driver == "n2"
    assert cars.bay(first) == ("free", "")


def test_reservation_of_a_car_that_never_reports_expires(cars):
    bay = cars.ask("n1").bay
    cars.run(SILENT_NS / NS_PER_S + 0.4)
    assert cars.bay(bay) == ("free", "")


def test_car_that_stands_for_long_goes_last_and_keeps_its_bay(cars):
    first, _ = cars.come("n1", "n2")
    cars.report("n1", "recover", first, attempts=1)
    assert cars.run(STUCK_NS / NS_PER_S).driver == "n1"
    status = cars.run(1.0)
    assert (status.driver, status.waiting) == ("n2", ("n1",))
    assert cars.bay(first) == ("reserved", "n1")


def test_full_lot_refuses_in_words_until_a_car_leaves(cars):
    for k, bay in enumerate(NAMES):
        cars.stand(f"c{k}", POSES[bay])
    cars.run(0.4)
    refused = cars.ask("n1")
    assert refused.code == "full"
    assert f"all {len(NAMES)} bays are taken: {NAMES[0]} by c0" in refused.detail
    cars.stand("c4", ENTRANCE)
    cars.run(0.4)
    assert cars.ask("n1").bay == NAMES[4]


def test_bay_is_occupied_by_a_car_without_an_agent_whichever_way_it_stands(cars):
    cars.stand("n9", POSES["a1"] @ Pose2(0.16, 0.05, math.pi))
    cars.run(0.2)
    assert cars.bay("a1") == ("occupied", "n9")
    refused = cars.ask("n1", "a1")
    assert (refused.code, refused.detail) == ("occupied", "bay a1 is taken by n9")
    assert cars.ask("n1").bay != "a1"


def test_parked_car_keeps_its_bay_after_its_agent_has_left_and_until_it_is_gone(cars):
    (bay,) = cars.come("n1")
    cars.report("n1", "parked", bay, POSES[bay])
    cars.stand("n1", Pose2(0.0, 0.0, 0.0), source="odometry")
    cars.run(1.0)
    del cars.reports["n1"]
    cars.run(60.0)
    assert cars.bay(bay) == ("occupied", "n1")
    cars.reports.clear()
    cars.run(SILENT_NS / NS_PER_S + 0.4)
    assert cars.bay(bay) == ("free", "")


def test_car_changes_its_bay_and_keeps_its_turn(cars):
    first, _ = cars.come("n1", "n2")
    cars.run(0.4)
    assert cars.ask("n1", "b5").bay == "b5"
    cars.report("n1", "drive", "b5")
    assert cars.run(1.0).driver == "n1"
    assert cars.bay(first) == ("free", "")


def test_car_that_turns_to_another_goal_gives_up_its_bay(cars):
    (bay,) = cars.come("n1")
    cars.run(0.4)
    cars.report("n1", "plan")
    cars.run(0.4)
    assert cars.bay(bay) == ("free", "")


def test_nobody_drives_while_a_car_without_a_bay_does(cars):
    cars.report("n9", "drive")
    cars.run(0.4)
    cars.come("n1")
    status = cars.run(1.0)
    assert (status.driver, status.reason) == ("", "n9 drives without a bay")
    cars.report("n9", "parked")
    assert cars.run(0.4).driver == "n1"


def test_new_manager_learns_who_has_which_bay_before_it_gives_one():
    cars = Cars()
    cars.report("n2", "plan", "a2")
    cars.report("n3", "plan", "b2", Pose2(0.0, 0.0, 0.0), attempts=1)
    cars.report("n1", "parked", "a1", POSES["a1"])
    cars.stand("n4", POSES["b1"])
    assert cars.run(1.0).driver == ""
    refused = cars.ask("n5")
    assert isinstance(refused, Refused)
    assert refused.code == "offline"
    status = cars.run(1.2)
    assert (status.driver, status.waiting) == ("n3", ("n2",))  # n3 stands in the way of others
    taken = {row.name: (row.state, row.vehicle) for row in status.bays if row.vehicle}
    assert taken == {
        "a1": ("occupied", "n1"), "b1": ("occupied", "n4"),
        "a2": ("reserved", "n2"), "b2": ("reserved", "n3"),
    }  # fmt: skip
    assert cars.ask("n5").bay == "a3"


@pytest.mark.parametrize(
    ("name", "bay", "said"),
    [("n1", "a77", "no bay 'a77' (did you mean"), ("", "", "expected a car's name")],
)
def test_request_that_makes_no_sense_is_refused_in_words(cars, name, bay, said):
    assert said in cars.ask(name, bay).detail
