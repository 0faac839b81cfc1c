"""Signals for a program that sees only its camera: how much throttle they allow.

The city's own driver (`scm/vehicles/drivers`) follows the car along its lanes, by the car's own
pose and what its radio receives. While the signals ahead keep that driver from passing, the
program gets no more throttle than it; else all. So yellow, missing or old SPATEMs, a fault of the
monitor, flashing red, and a junction without room behind it mean what they mean for every car.

A car beside all lanes has no signals ahead: it is not limited. One whose pose is not known is.
"""

import math

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.route import roads_of
from scm.records.city_map import CityMap, StopLine
from scm.v2x.exchange import Incoming
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spatem import SpatemRx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.vehicles.driver import RouteView
from scm.vehicles.drivers.cam_tracker import CamTracker
from scm.vehicles.drivers.channel import is_ideal
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.drivers.signal_table import SignalTable
from scm.vehicles.drivers.single_car import OWN, SingleDriver

MAX_STATE_AGE_NS = 500 * NS_PER_MS  # of the car's own pose
MAX_OFF_PLACE_M = 0.1  # from where the driver follows it; more: it took another branch
WAITS = {
    "signal": "waits for green",
    "vehicle": "waits for room behind the junction",
    "sign": "gives way at flashing red",
}


class SignalRule:
    """Limits one car's throttle.

    Args:
        vehicle: The car.
        car: Its car file's name.
        city_map: With signals.

    Attributes:
        detail: Why it limits, in words; empty: it does not.

    Raises:
        CarError: when the car file cannot be used.
    """

    def __init__(self, vehicle: str, car: str, city_map: CityMap) -> None:
        self._vehicle, self._roads = vehicle, roads_of(city_map)
        self._limits = limits_of(load_car(car))
        self._driver = SingleDriver(self._roads, self._limits)
        self._driver.batch.warm_up()
        self._signals, self._cars = SignalTable(city_map), CamTracker()
        self._is_lossless = is_ideal(city_map.radio)
        self._state: VehicleState | None = None
        self._state_ns = 0
        self.detail = ""

    def receive(self, item: Incoming) -> None:
        """Receive what the car's radio does, and its state."""
        message = item.message
        if isinstance(message, VehicleState):
            self._state, self._state_ns = message, item.t_ns
        elif isinstance(message, SpatemRx):
            self._signals.receive_spatem(message.body, item.t_ns)
        elif isinstance(message, CamRx) and message.station != self._vehicle:
            self._cars.receive(message.body, item.t_ns)
        elif isinstance(message, MonitorStatus):
            self._signals.receive_monitor_status(message)

    def max_throttle(self, now_ns: int) -> float:
        """Return the highest throttle that is allowed now, -1 to 1."""
        state, self.detail = self._state, ""
        if state is None or now_ns - self._state_ns > MAX_STATE_AGE_NS:
            self.detail = f"waits for {self._vehicle}'s pose"
            return 0.0
        pose = Pose2(state.x_m, state.y_m, state.yaw_rad)
        if not self._follow(pose):
            return 1.0
        view = RouteView(
            now_ns=now_ns, pose=pose, speed=state.speed_mps, signals=self._signals,
            others=self._cars.others(now_ns, pose),
            reception_is_good=self._is_lossless or self._cars.reception_is_good(now_ns),
        )  # fmt: skip
        throttle, _ = self._driver.decide(view)
        reason = self._driver.at_signals
        if reason is None:
            return 1.0
        line = self._line_ahead()
        self.detail = WAITS[reason] + (f" at {line.name} of {line.junction}" if line else "")
        return throttle

    def _follow(self, pose: Pose2) -> bool:
        """Return whether the car is on a lane; put the driver there if it follows another one."""
        place = self._roads.nearest(pose)
        if place is None:
            return False
        batch, lanes = self._driver.batch, self._roads.lanes
        off_m = math.inf
        if batch.lane[OWN] >= 0:
            at = lanes[batch.lane_graph.names[batch.lane[OWN]]].at(float(batch.s[OWN]))
            off_m = math.hypot(at.x - pose.x, at.y - pose.y)
        if off_m > abs(place.lateral) + MAX_OFF_PLACE_M:
            batch.send(OWN, (place.lane,), place.s, "circulate")
        return True

    def _line_ahead(self) -> StopLine | None:
        """Return the next stop line with signals on the driver's way."""
        batch = self._driver.batch
        front_m = float(batch.s[OWN]) + self._limits.front
        found = self._roads.line_ahead(batch.planned_lanes(OWN), front_m)
        return None if found is None else found[0]
