"""A policy drives a real Nigel's agent: its poses are the Eye's, its commands go over the cable.

The board runs the published firmware, byte for byte in virtual time.
"""

import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.route import roads_of
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Subscription
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.part_status import PartStatus
from scm.vehicles.car import load_car
from scm.world.part import WorldPart
from tests.unit.calibrate.cable import Line
from tests.unit.calibrate.rig import T0
from tests.unit.test_real_guard import track
from tests.unit.vehicle_agent.policy.test_policy_driving import OPEN
from vehicle_agent.agent import AgentPart
from vehicle_agent.bodies.nigel import NigelBody
from vehicle_agent.body import BodyKind
from vehicle_agent.emulate.part import EmulatorPart
from vehicle_agent.policy.driving import PolicyPart

SETTLED_S = 6.0  # the board has begun, and the policy has the lease
STD_M, STD_RAD = 0.001, 0.003


class Overhead(BasePart):
    """An Eye that sees the car 20 times a second, 20 ms late and a little wrong."""

    name, role, period_ns = "eye", "part", 50 * NS_PER_MS
    subscriptions = (Subscription(EmulatedPose),)

    def __init__(self):
        self.is_blind, self._rng = False, np.random.default_rng(1)

    def step(self, now_ns, inbox):
        if not inbox or self.is_blind:
            return []
        seen = inbox[max(0, len(inbox) - 2)].message
        dx, dy, turn = (self._rng.normal(size=3) * (STD_M, STD_M, STD_RAD)).tolist()
        variances = (STD_M**2, STD_M**2, STD_RAD**2)
        pose = seen.x_m + dx, seen.y_m + dy, seen.yaw_rad + turn
        return [track(now_ns, *pose, seen.speed_mps, variances, age_s=0.02)]


class Wired(Line):
    """The serial line of a car whose firmware reports nothing."""

    report = None


class Street:
    """A city with an emulated Nigel, its agent, and a policy that drives it."""

    def __init__(self, policy, folder):
        line, self.eye = Wired(), Overhead()
        board = SimpleNamespace(firmware=line.board, step=line.run_to, close=lambda: None)
        text = load_car("nigel").path.read_text(encoding="utf-8")
        known = 'deadband = { value = 0.2, source = "the emulated car\'s" }'
        car = folder / "car.toml"
        car.write_text(text.replace("\n[drive]", f"\n[drive]\n{known}\n#"), encoding="utf-8")
        body = BodyKind("real", lambda *_: NigelBody(load_car(car), line))
        self.policy = PolicyPart("policy", "n7", policy)
        self.agent = AgentPart("n7", body=body)
        emulator = EmulatorPart("n7", board, line.wheels)
        parts = WorldPart(OPEN, 1), emulator, self.eye, self.agent, self.policy
        self.city = Lockstep(parts, start_ns=T0)
        self._truth = self.city.subscribe(Subscription(EmulatedPose))
        self._status = self.city.subscribe(Subscription(PartStatus, {"station": "n7"}))

    def run_for(self, span_s):
        """Return the true poses of that time."""
        self.city.run_for(span_s)
        return [item.message for item in self._truth.drain()]

    def detail(self):
        """Return the newest status of the car's agent."""
        return self._status.drain()[-1].message.detail


@pytest.fixture
def street(policy, tmp_path):
    made = Street(policy, tmp_path)
    with made.city:
        made.run_for(SETTLED_S)
        yield made


def off_lane_m(pose):
    return abs(roads_of(OPEN).nearest(Pose2(pose.x_m, pose.y_m, pose.yaw_rad)).lateral)


def test_policy_keeps_a_nigel_in_its_lane_by_the_poses_of_the_eye(street):
    way = street.run_for(8.0)
    assert way[-1].speed_mps > 0.15
    came_m = sum(math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) for a, b in pairwise(way))
    assert came_m == pytest.approx(8.0 * 0.21, rel=0.1)
    assert max(map(off_lane_m, way)) < 0.04
    assert street.detail() == "driven by somebody else"


def test_nigel_stops_when_its_policy_is_killed(street):
    street.city.kill(street.policy)
    way = street.run_for(3.0)
    assert max(pose.speed_mps for pose in way[20:]) < 0.005  # 0.4 s
    assert way[0].speed_mps > 0.15


def test_nigel_stands_while_the_eye_does_not_see_it_and_drives_on_after(street):
    street.eye.is_blind = True
    way = street.run_for(2.0)
    assert max(pose.speed_mps for pose in way[25:]) < 0.005  # 0.5 s
    assert "has not seen it for" in street.detail()
    street.eye.is_blind = False
    way = street.run_for(3.0)
    assert way[-1].speed_mps > 0.15
    assert max(map(off_lane_m, way)) < 0.04
