"""A policy's observation, from what one car knows: of itself, its map, and others by radio.

Columns have the names that they have in training. Those of the true motion are the car's own
estimate here, and an observation is not complete before each of its columns is known.
"""

import zlib
from collections.abc import Callable

import numpy as np

from scm.arrays import Floats
from scm.errors import LearningError
from scm.geometry import Pose2
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.drivers.course import AHEAD_M, BENDS, BESIDE_M, LIMIT_MPS, TURNED_RAD, Course
from vehicle_agent.autonomy.control import Command

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


class Senses:
    """What one car knows.

    Args:
        names: Of the observation's columns.
        city_map: That it drives on.
        vehicle: Its name, which decides where it turns.

    Raises:
        LearningError: A car does not know one of them.
    """

    def __init__(self, names: tuple[str, ...], city_map: CityMap, vehicle: str) -> None:
        known = {*OF_STATE, *OF_ACTION, *OF_LANE}
        unknown = [name for name in names if name not in known]
        if unknown:
            wrong, right = ", ".join(unknown), ", ".join(sorted(known))
            raise LearningError(f"the policy observes {wrong}: a car knows {right}")
        self._names, self._roads = names, roads_of(city_map)
        self._course = Course(city_map, 1)
        self._branches = zlib.crc32(vehicle.encode()) / 2.0**32
        self._is_on_lane = False

    def look(self, state: VehicleState, action: Command) -> Floats | None:
        """Return the observation (columns,); None: the car is beside all lanes.

        Args:
            state: Of the car.
            action: In force.
        """
        pose = Pose2(state.x_m, state.y_m, state.yaw_rad)
        if not self._is_on_lane:
            on = self._roads.nearest(pose)
            if on is None:
                return None
            self._course.enter(0, on.lane, on.s, self._branches)
        self._course.follow(*(np.array([value]) for value in pose))
        lane = self._course.known[0]
        self._is_on_lane = abs(lane[BESIDE_M]) <= self._course.half_width[0]
        values = {name: read(state) for name, read in OF_STATE.items()}
        values |= {"throttle": action.throttle, "steering": action.steering}
        values |= {name: float(lane[column]) for name, column in OF_LANE.items()}
        return np.array([values[name] for name in self._names])
