import math

import numpy as np
import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.records.city_map import Wall
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import load_car
from scm.vehicles.parked import TOLERANCE_M, TOLERANCE_RAD
from scm.world.part import WorldPart
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.navigation import OWN, PUBLISHED, Navigator
from vehicle_agent.autonomy.parking import Parking
from vehicle_agent.autonomy.perception import Whereabouts
from vehicle_agent.autonomy.plan import limits_of

NIGEL = load_car("nigel")
SCHOOL, OBSTACLES = load_map("parking_school"), load_map("parking_school_obstacles")
START, GOAL = (roads_of(OBSTACLES).spawn_pose(name) for name in ("start", "goal"))
ENDED = ("parked", "failed")


class Run:
    """A drive to a goal in a simulated room.

    Args:
        room: Where the car really is, at `at`.
        city_map: What it thinks where it is; None: the same.
        start: Where it thinks that it stands; None: it does not know.
        seen: What becomes of its messages on their way, by the time; None: lost.
    """

    def __init__(
        self, room, at, goal, *, city_map=None, start=None, seen=None, lasts_s=60.0, seed=1
    ):
        world = WorldPart(room, seed, ())
        self.reports, self.poses, self.commands = [], [], []
        with Lockstep([world]) as city:
            boxes = [
                city.subscribe(Subscription(kind, {"vehicle": "n1"}))
                for kind in (VehicleSensors, LidarScan)
            ]
            contacts = city.subscribe(Subscription(Contact))
            self.car = world.world.host("n1", "nigel", at, 0)
            lease = LeaseRequest(vehicle="n1", owner="script", verb="acquire", ttl_ms=60_000)
            epoch = city.call(lease).epoch
            self.parking = Parking(NIGEL, city_map or room, goal, start, seed)
            while city.now_ns < lasts_s * NS_PER_S and self.state not in ENDED:
                for item in [item for box in boxes for item in box.drain()]:
                    message = seen(item.message, city.now_ns) if seen else item.message
                    if isinstance(message, LidarScan):
                        self.parking.scan(message, city.now_ns)
                    elif message is not None:
                        self.parking.sensors(message)
                command = self.parking.step(city.now_ns)
                self._note(city.now_ns, command)
                city.publish(
                    DriveCommand(
                        vehicle="n1", t_ns=city.now_ns, epoch=epoch, seq=len(self.poses),
                        throttle=command.throttle, steering=command.steering,
                    )
                )  # fmt: skip
                city.run_for(0.02)
            self.contacts = contacts.drain()

    def _note(self, now_ns, command):
        if not self.reports or self.reports[-1][1] != self.parking.report:
            self.reports.append((now_ns / NS_PER_S, self.parking.report))
        self.poses.append(self.car.pose)
        self.commands.append(command[:2])

    @property
    def state(self):
        return self.reports[-1][1].state if self.reports else ""

    @property
    def reason(self):
        return self.reports[-1][1].reason

    def way_m(self):
        return float(np.hypot(*np.diff(np.array(self.poses)[:, :2], axis=0).T).sum())


def assert_parked(run, goal):
    """It is parked, and stands there."""
    off = goal.inverse() @ run.car.pose
    assert run.state == "parked", run.reports[-1]
    assert math.hypot(off.x, off.y) < TOLERANCE_M + 0.01
    assert abs(off.yaw) < TOLERANCE_RAD + 0.01
    assert not run.contacts
    assert run.commands[-1][0] == 0.0


@pytest.mark.parametrize(
    ("at", "start"),
    [(START, START @ Pose2(0.03, -0.03, 0.05)), (Pose2(0.0, -0.3, 2.5), None)],
)
def test_car_parks(at, start):
    run = Run(OBSTACLES, at, GOAL, start=start)
    assert_parked(run, GOAL)
    assert run.parking.attempts <= 3


def test_car_whose_lidar_dies_stops_and_goes_on_when_it_is_back():
    run = Run(
        OBSTACLES, START, GOAL, start=START, lasts_s=5.0,
        seen=lambda m, now: None if isinstance(m, LidarScan) and 1.5e9 < now < 3.8e9 else m,
    )  # fmt: skip
    assert "no LIDAR scan for" in " ".join(report.reason for _, report in run.reports)
    silent = np.array(run.poses)[round(50 * 3.3) : round(50 * 3.8)]
    assert np.ptp(silent[:, 0]) < 0.005
    assert run.state == "drive"
    assert run.poses[-1].x > silent[-1, 0] + 0.05


def walled_off():
    wall = Wall(points=((0.3, -0.65), (0.3, 0.65)), thickness_m=0.02)
    return replace(OBSTACLES, walls=(*OBSTACLES.walls, wall))


def test_way_that_something_unmapped_blocks_is_waited_for(monkeypatch):
    monkeypatch.setattr("vehicle_agent.autonomy.parking.BLOCKED_NS", NS_PER_S)
    run = Run(walled_off(), START, GOAL, city_map=OBSTACLES, start=START, lasts_s=30.0)
    waits = [t for t, report in run.reports if report.reason.startswith("waits: ")]
    assert run.state == "failed"
    assert run.reports[-1][0] - waits[0] > 0.9
    assert not run.contacts


def mute(message, _):
    return None if isinstance(message, LidarScan) else message


def turned(message, _):
    if not isinstance(message, LidarScan):
        return message
    return replace(message, bearing_first_rad=message.bearing_first_rad + math.pi)


def jumped(by_s, after_s=1.25):
    """Return what moves the times of messages from then on."""
    return lambda m, now: replace(m, t_ns=m.t_ns + (now > after_s * 1e9) * by_s * NS_PER_S)


UNMAPPED = replace(OBSTACLES, boxes=OBSTACLES.boxes[:1])
OTHER_ROOM = load_map("driving_school")
BACKWARD = "looks backward"


@pytest.mark.parametrize(
    ("room", "city_map", "goal", "start", "seen", "state", "words"),
    [
        (OBSTACLES, OBSTACLES, GOAL, START, mute, "recover", "no LIDAR scan for 1 s"),
        (OBSTACLES, OTHER_ROOM, GOAL, START, None, "localise", "is it the map of this room"),
        (OBSTACLES, OTHER_ROOM, GOAL, None, None, "localise", "is it the map of this room"),
        (OBSTACLES, UNMAPPED, Pose2(0.75, 0.62, 0.0), START, None, "failed", "goal (0.750 m"),
        (walled_off(), walled_off(), GOAL, START, None, "failed", "no path found"),
        (OBSTACLES, OBSTACLES, GOAL, START, turned, "failed", BACKWARD),
        (SCHOOL, SCHOOL, GOAL, START, turned, "failed", BACKWARD),
    ],
)  # fmt: skip
def test_bad_input_is_noticed_within_2_s(room, city_map, goal, start, seen, state, words):
    run = Run(room, START, goal, city_map=city_map, start=start, seen=seen, lasts_s=2.0)
    assert run.state == state, run.reports
    assert words in run.reason
    assert run.way_m() < 0.003


def test_scanner_that_looks_backward_is_noticed_as_the_car_sets_out():
    run = Run(OBSTACLES, START, GOAL, seen=turned, lasts_s=4.0)
    assert run.state == "failed", run.reports
    assert "drive the other way than its wheels" in run.reason
    began = next(t for t, report in run.reports if report.state == "drive")
    assert run.reports[-1][0] - began < 2.0
    assert run.way_m() < 0.12


@pytest.mark.parametrize("by_s", [5, -5, 7200, -7200])
def test_clock_that_jumps_is_noticed_and_stops_the_car_for_a_sweep(by_s):
    run = Run(OBSTACLES, START, GOAL, start=START, seen=jumped(by_s), lasts_s=2.0)
    at, report = next((t, one) for t, one in run.reports if "clock" in one.reason)
    assert at < 1.5
    assert f"jumped by {by_s:+d} s" in report.reason
    assert run.state == "drive"
    assert run.commands[round(50 * at)][0] == 0.0
    assert not any(throttle for throttle, _ in run.commands[round(50 * at) : round(50 * at) + 5])


def test_map_of_another_room_is_given_up_after_a_while(monkeypatch):
    monkeypatch.setattr("vehicle_agent.autonomy.parking.UNFIT_NS", 2 * NS_PER_S)
    run = Run(OBSTACLES, START, GOAL, city_map=OTHER_ROOM, start=START, lasts_s=3.0)
    assert run.state == "failed"
    assert "is it the map of this room" in run.reason


def test_two_places_that_look_the_same_are_named():
    run = Run(SCHOOL, START, GOAL, lasts_s=5.0)
    assert run.state == "failed"
    assert run.way_m() < 0.003
    assert "-0.70,0.30,0" in run.reason
    assert "0.90,-0.30" in run.reason
    assert run.reason.endswith("give --start, or --eye")


def test_new_goal_begins_anew():
    run = Run(OBSTACLES, GOAL, Pose2(0.86, 0.31, 0.0), start=GOAL, lasts_s=3.0)
    assert run.state == "failed"
    run.parking.turn_to(GOAL)
    run.parking.step(10**10)
    assert run.parking.report.state != "failed"


def test_paths_leave_some_steering_for_control():
    paths = [
        Navigator(NIGEL).path_to(
            grid_of_city(OBSTACLES), Pose2(x, 0.0, 0.0), Pose2(x, 0.0, math.pi)
        )
        for x in (-0.3, 0.0)
    ]
    sharpest = max(np.abs(path.curvatures).max() for path in paths)
    limits = limits_of(NIGEL)
    angle = math.atan(sharpest * limits.wheelbase_m)
    assert angle == pytest.approx(0.95 * limits.steering_rad, rel=0.01)


@pytest.mark.parametrize(("stack", "stays"), [(OWN, False), (PUBLISHED, True)])
def test_published_stack_stays_within_the_published_tolerances(stack, stays):
    parking = Parking(NIGEL, OBSTACLES, GOAL, stack=stack)
    for off, is_near in ((0.045, stays), (0.055, False)):
        here = Whereabouts(0, GOAL @ Pose2(off, 0.0, 0.08), 0.0, 0.0, is_known=True)
        assert parking._is_parked(here) is is_near
