"""A policy's observation, from what one car knows: of itself, its map, and others by radio.

Columns have the names that they have in training. Those of the true motion are the car's own
estimate here, and an observation is not complete before each of its columns is known.
"""

import re
import zlib
from collections.abc import Callable, Iterable

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
from vehicle_agent.autonomy.control import Command
from vehicle_agent.policy.received import Inertial, Lights, Now, Others, Ranges, Received

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
}
"""Columns of what sensors and radio receive, and the number of their beam or car."""


class Senses:
    """What one car knows.

    Args:
        policy: Whose observation it is.
        city_map: That the car drives on.
        vehicle: Its name, which decides where it turns.

    Attributes:
        missing: What the observation waits for, in words; empty: for nothing.

    Raises:
        LearningError: A car does not know one of the columns.
        CarError: The car file cannot be used.
    """

    def __init__(self, policy: PolicyMetadata, city_map: CityMap, vehicle: str) -> None:
        self._names = policy.observations
        self._low, self._high = np.array(policy.low), np.array(policy.high)
        self._roads, self._course = roads_of(city_map), Course(city_map, 1)
        self._vehicle, self._branches = vehicle, zlib.crc32(vehicle.encode()) / 2.0**32
        self._is_on_lane = False
        self.missing = ""
        unknown = [
            name for name in self._names
            if name not in KNOWN and not any(_count(one, [name]) for one in RECEIVED.values())
        ]  # fmt: skip
        if unknown:
            wrong, right = ", ".join(unknown), ", ".join((*KNOWN, *RECEIVED))
            raise LearningError(f"the policy observes {wrong}: a car knows {right}")
        self._received = list(self._parts(policy, city_map))

    def _parts(self, policy: PolicyMetadata, city_map: CityMap) -> Iterable[Received]:
        """Yield what has to be received for the columns."""
        car = load_car(policy.car)
        counts = {part: _count(pattern, self._names) for part, pattern in RECEIVED.items()}
        if counts["inertial"]:
            yield Inertial(car)
        if counts["ranges"]:
            yield Ranges(counts["ranges"])
        if counts["others"]:
            yield Others(counts["others"], car, self._vehicle)
        if counts["signals"]:
            reach_m = dict(zip(self._names, policy.high, strict=True)).get("stop_line_m", np.inf)
            yield Lights(city_map, self._roads, car, reach_m)

    def receive(self, item: Incoming) -> None:
        """Receive a message, whatever it is."""
        for one in self._received:
            one.receive(item)

    def look(self, state: VehicleState, action: Command, now_ns: int) -> Floats | None:
        """Return the observation (columns,); None: something of it is not known, see `missing`.

        Args:
            state: Of the car.
            action: In force.
            now_ns: On the clock by which messages arrive.
        """
        pose = Pose2(state.x_m, state.y_m, state.yaw_rad)
        if not self._is_on_lane:
            on = self._roads.nearest(pose)
            if on is None:
                self.missing = "a lane: it is beside all of them"
                return None
            self._course.enter(0, on.lane, on.s, self._branches)
        self._course.follow(*(np.array([value]) for value in pose))
        lane = self._course.known[0]
        self._is_on_lane = abs(lane[BESIDE_M]) <= self._course.half_width[0]
        values = {name: read(state) for name, read in OF_STATE.items()}
        values |= {"throttle": action.throttle, "steering": action.steering}
        values |= {name: float(lane[column]) for name, column in OF_LANE.items()}
        now = Now(now_ns, pose, *self._course.lanes_ahead(0))
        for one in self._received:
            columns = one.columns(now)
            if isinstance(columns, str):
                self.missing = columns
                return None
            values |= columns
        self.missing = ""
        return np.clip([values[name] for name in self._names], self._low, self._high)


def _count(pattern: str, names: Iterable[str]) -> int:
    """Return how many beams or cars some columns are of; 0: none is of this part."""
    found = (re.fullmatch(pattern, name) for name in names)
    return max((1 + int(one["number"] or 0) for one in found if one is not None), default=0)
