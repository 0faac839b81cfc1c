"""A policy's observation, from what one car knows: of itself, its map, and others by radio.

Columns have the names that they have in training. Those of the true motion are the car's own
estimate here, and an observation is not complete before each of its columns is known.
"""

import re
import zlib
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats
from scm.errors import LearningError
from scm.geometry import Pose2
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.records.policy import PolicyMetadata
from scm.v2x.exchange import Incoming
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.vehicles.drivers.course import AHEAD_M, BENDS, BESIDE_M, LIMIT_MPS, TURNED_RAD, Course
from scm.vehicles.parked import is_parked
from vehicle_agent.autonomy.control import Command
from vehicle_agent.policy.ahead import Ahead
from vehicle_agent.policy.received import (
    Goal,
    Inertial,
    Lights,
    Now,
    Others,
    Pursued,
    Ranges,
    Received,
)

OF_STATE: dict[str, Callable[[VehicleState], float]] = {
    "speed_mps": lambda state: state.speed_mps,
    "lateral_speed_mps": lambda state: state.lateral_speed_mps,
    "yaw_rate_radps": lambda state: state.yaw_rate_radps,
    "steer_angle_rad": lambda state: state.steering_rad,
}
OF_ACTION = ("throttle", "steering")
OF_LANE = {
    "beside_m": BESIDE_M, "turned_rad": TURNED_RAD, "speed_limit_mps": LIMIT_MPS,
    **{f"lane_turn_{ahead:g}m_rad": BENDS + k for k, ahead in enumerate(AHEAD_M)},
}  # fmt: skip
KNOWN = (*OF_STATE, *OF_ACTION, *OF_LANE)
RECEIVED = {
    "inertial": r"(accel_[xyz]_mps2|gyro_[xyz]_radps|wheel_(left|right)_mps)(?P<number>)",
    "ranges": r"range_(?P<number>\d+)_m",
    "others": r"other_(?P<number>\d+)_(ahead_m|left_m|cos_turn|sin_turn|speed_mps|age_s)",
    "signals": r"(stop_line_m|signal_is_green|signal_change_s)(?P<number>)",
    "ahead": r"(leader|follower)_(gap_m|speed_mps)(?P<number>)",
    "pursued": r"pursued_(ahead_m|left_m|cos_turn|sin_turn|speed_mps)(?P<number>)",
    "goal": r"goal_(ahead_m|left_m|cos_turn|sin_turn)(?P<number>)",
}
"""Columns of what sensors and radio receive or the user names, and the number of beam or car."""
ON_LANES = ("signals", "ahead")


class Aim(NamedTuple):
    """Where a policy is to drive, as its user names it.

    Attributes:
        goal: A place of the map, or `X,Y,DEG`; empty: none.
        pursued: A car; empty: none.
    """

    goal: str = ""
    pursued: str = ""


NOWHERE = Aim()


def counts_of(policy: PolicyMetadata, aim: Aim) -> dict[str, int]:
    """Return how many beams or cars a policy observes of each part of `RECEIVED`; 0: not that part.

    Raises:
        LearningError: A car does not know one of the columns, or the user has to name something.
    """
    names = policy.observations
    unknown = [
        name for name in names
        if name not in KNOWN and not any(_count(one, [name]) for one in RECEIVED.values())
    ]  # fmt: skip
    if unknown:
        wrong, right = ", ".join(unknown), ", ".join((*KNOWN, *RECEIVED))
        raise LearningError(f"the policy observes {wrong}: a car knows {right}")
    counts = {part: _count(pattern, names) for part, pattern in RECEIVED.items()}
    for part, option, given in (
        ("goal", "--goal PLACE", aim.goal), ("pursued", "--pursue CAR", aim.pursued)
    ):  # fmt: skip
        if bool(counts[part]) != bool(given):
            got = repr(given) if given else "none"
            expected = option if counts[part] else f"no {option}"
            raise LearningError(f"a policy for {policy.task}: expected {expected}, got {got}")
    return counts


class Senses:
    """What one car knows.

    Args:
        policy: Whose observation it is.
        city_map: That the car drives on.
        vehicle: Its name, which decides where it turns.
        aim: Where it is to drive.

    Attributes:
        missing: What the observation waits for, in words; empty: for nothing.
        goal: Where it is to park; None: nowhere.

    Raises:
        LearningError: A car does not know one of the columns, or the user has to name something.
        MapError: The map lacks the goal, or lanes.
        CarError: The car file cannot be used.
    """

    def __init__(
        self, policy: PolicyMetadata, city_map: CityMap, vehicle: str, aim: Aim = NOWHERE
    ) -> None:
        self._names = policy.observations
        self._low, self._high = np.array(policy.low), np.array(policy.high)
        counts, self._roads = counts_of(policy, aim), roads_of(city_map)
        is_on_lanes = any(counts[part] for part in ON_LANES) or set(self._names) & set(OF_LANE)
        self._course = Course(city_map, 1) if is_on_lanes else None
        self._vehicle, self._branches = vehicle, zlib.crc32(vehicle.encode()) / 2.0**32
        self._is_on_lane = False
        self.missing = ""
        self.goal = self._roads.spawn_pose(aim.goal) if aim.goal else None
        self._received = list(self._parts(policy, counts, city_map, aim))

    def _parts(
        self, policy: PolicyMetadata, counts: dict[str, int], city_map: CityMap, aim: Aim
    ) -> Iterable[Received]:
        """Yield what has to be received, or was named, for the columns."""
        car = load_car(policy.car)
        if counts["inertial"]:
            yield Inertial(car)
        if counts["ranges"]:
            yield Ranges(counts["ranges"])
        if counts["others"]:
            yield Others(counts["others"], car, self._vehicle)
        if counts["signals"]:
            reach_m = dict(zip(self._names, policy.high, strict=True)).get("stop_line_m", np.inf)
            yield Lights(city_map, self._roads, car, reach_m)
        if counts["ahead"]:
            yield Ahead(self._roads, car, self._vehicle)
        if counts["pursued"]:
            yield Pursued(aim.pursued, car)
        if self.goal is not None:
            yield Goal(self.goal)

    def receive(self, item: Incoming) -> None:
        """Receive a message, whatever it is."""
        for one in self._received:
            one.receive(item)

    def is_parked(self, state: VehicleState) -> bool:
        """Return whether a car is parked at the goal; False where there is none."""
        if self.goal is None:
            return False
        ahead, left, turn = Pose2(state.x_m, state.y_m, state.yaw_rad).inverse() @ self.goal
        return bool(is_parked(np.hypot(ahead, left), turn, state.speed_mps))

    def look(self, state: VehicleState, action: Command, now_ns: int) -> Floats | None:
        """Return the observation (columns,); None: something of it is not known, see `missing`.

        Args:
            state: Of the car.
            action: In force.
            now_ns: On the clock by which messages arrive.
        """
        pose = Pose2(state.x_m, state.y_m, state.yaw_rad)
        values = {name: read(state) for name, read in OF_STATE.items()}
        values |= {"throttle": action.throttle, "steering": action.steering}
        ahead: tuple[tuple[str, ...], float] = (), 0.0
        if self._course is not None:
            if not self._follow(self._course, pose):
                self.missing = "a lane: it is beside all of them"
                return None
            lane, ahead = self._course.known[0], self._course.lanes_ahead(0)
            values |= {name: float(lane[column]) for name, column in OF_LANE.items()}
        now = Now(now_ns, pose, *ahead, state.speed_mps)
        for one in self._received:
            columns = one.columns(now)
            if isinstance(columns, str):
                self.missing = columns
                return None
            values |= columns
        self.missing = ""
        return np.clip([values[name] for name in self._names], self._low, self._high)

    def _follow(self, course: Course, pose: Pose2) -> bool:
        """Follow the lanes to where the car is; return whether it is on one."""
        if not self._is_on_lane:
            on = self._roads.nearest(pose)
            if on is None:
                return False
            course.enter(0, on.lane, on.s, self._branches)
        course.follow(*(np.array([value]) for value in pose))
        self._is_on_lane = abs(course.known[0, BESIDE_M]) <= course.half_width[0]
        return True


def _count(pattern: str, names: Iterable[str]) -> int:
    """Return how many beams or cars some columns are of; 0: none is of this part."""
    found = (re.fullmatch(pattern, name) for name in names)
    return max((1 + int(one["number"] or 0) for one in found if one is not None), default=0)
