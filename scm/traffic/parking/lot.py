"""Which car has which bay and which one may drive, from what cars request and report.

One car at a time drives to its bay, in the order of requests; it may as long as it reports and has
neither parked nor given up. All knowledge comes from what cars report, so a manager that starts
anew learns it again before it gives out a bay.

As in ETSI TS 103 882 (automated vehicle marshalling), a permission to drive expires unless renewed.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from scm.clock import NS_PER_S
from scm.errors import nearest
from scm.geometry import Pose2, wrap_angle
from scm.records.city_map import Bay, CityMap
from scm.v2x.message import Message, Refused
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.bay_request import BayReply, BayRequest
from scm.v2x.messages.parking_status import BayState, ParkingStatus
from scm.v2x.messages.vehicle_state import VehicleState

LEARN_NS = 2 * NS_PER_S  # from its start; agents report five times a second
SILENT_NS = 5 * NS_PER_S  # after that a car is gone; longer than a permission and a lease together
STUCK_NS = 30 * NS_PER_S  # without driving, after which others go first; agents give up after 20 s
SAME_M, SAME_RAD = 0.01, 0.01  # between a bay and the goal of a car that is on its way there
ON_ITS_WAY = ("map", "localise", "plan", "drive", "recover")


@dataclass(slots=True)
class _Car:
    """What is known of a car.

    Attributes:
        received_ns: When its last report came.
        pose: The newest one reported.
        status: Of the agent that parks it; None: it has none, or that has been silent.
        status_ns: When that came.
    """

    received_ns: int
    pose: Pose2 | None = None
    status: AutonomyStatus | None = None
    status_ns: int = 0


@dataclass(slots=True)
class _Reservation:
    """A car's bay, until it has parked there.

    Attributes:
        since_ns: When it was made.
        is_confirmed: Whether the car has reported that it is on its way there.
        is_put_back: Whether it lost its turn.
    """

    bay: Bay
    since_ns: int
    is_confirmed: bool = False
    is_put_back: bool = False


class Lot:
    """The bays of a map. Pure: it has no bus and no clock.

    Args:
        city_map: Whose bays.
        now_ns: Its start.

    Attributes:
        driver: The car that may drive; empty: none.
    """

    def __init__(self, city_map: CityMap, now_ns: int) -> None:
        self._bays = {bay.name: bay for bay in city_map.bays}
        self._began_ns = now_ns
        self._cars: dict[str, _Car] = {}
        self._reserved: dict[str, _Reservation] = {}
        self.driver = ""
        self._reason = ""
        self._drove_ns = now_ns

    def receive_state(self, state: VehicleState, now_ns: int) -> None:
        """Take where a car is; odometry alone does not know that in the map frame."""
        car = self._car(state.vehicle, now_ns)
        if state.source != "odometry":
            car.pose = Pose2(state.x_m, state.y_m, state.yaw_rad)

    def receive_status(self, status: AutonomyStatus, now_ns: int) -> None:
        """Take what an agent reports; a goal that is a free bay becomes a reservation."""
        name, car = status.vehicle, self._car(status.vehicle, now_ns)
        car.status, car.status_ns = status, now_ns
        if status.x_m is not None and status.y_m is not None and status.yaw_rad is not None:
            car.pose = Pose2(status.x_m, status.y_m, status.yaw_rad)
        goal = self._goal_of(status)
        held = self._reserved.get(name)
        if held is None:
            if goal is not None and status.state in ON_ITS_WAY and self._is_free(goal, name):
                self._reserved[name] = _Reservation(goal, now_ns, is_confirmed=True)
        elif goal is held.bay:
            held.is_confirmed = True
            if status.state not in ON_ITS_WAY:
                del self._reserved[name]
        elif held.is_confirmed:
            del self._reserved[name]

    def reserve(self, request: BayRequest, now_ns: int) -> Message:
        """Return the reply to a request for a bay."""
        name, wanted = request.vehicle, request.bay
        if now_ns - self._began_ns < LEARN_NS:
            detail = "the parking manager has just started and learns which bays are taken"
            return Refused(code="offline", detail=detail)
        if not name:
            return Refused(code="invalid", detail="vehicle: got nothing, expected a car's name")
        if wanted and wanted not in self._bays:
            known = nearest(wanted, list(self._bays))
            detail = f"no bay {wanted!r}{known}; expected one of {', '.join(self._bays)}"
            return Refused(code="not_found", detail=detail)
        bay = self._bays[wanted] if wanted else self._any_for(name)
        if bay is None:
            holders = ", ".join(f"{row.name} by {row.vehicle}" for row in self._rows())
            detail = f"all {len(self._bays)} bays are taken: {holders}"
            return Refused(code="full", detail=detail)
        if not self._is_free(bay, name):
            detail = f"bay {bay.name} is taken by {self._row(bay).vehicle}"
            return Refused(code="occupied", detail=detail)
        self._car(name, now_ns)
        held = self._reserved.get(name)
        if held is None:
            self._reserved[name] = _Reservation(bay, now_ns)
        elif held.bay is not bay:
            held.bay, held.since_ns, held.is_confirmed = bay, now_ns, False
        x, y, yaw = bay.pose
        return BayReply(vehicle=name, bay=bay.name, x_m=x, y_m=y, yaw_rad=yaw)

    def step(self, now_ns: int) -> None:
        """Forget who is silent, and give the permission to drive to whose turn it is."""
        for name, car in list(self._cars.items()):
            if now_ns - car.received_ns > SILENT_NS:
                del self._cars[name]
            elif now_ns - car.status_ns > SILENT_NS:
                car.status = None
        for name, held in list(self._reserved.items()):
            known = self._cars.get(name)
            is_valid = known is not None and known.status is not None and held.is_confirmed
            if not is_valid and now_ns - held.since_ns > SILENT_NS:
                del self._reserved[name]
        self._put_back(now_ns)
        if now_ns - self._began_ns >= LEARN_NS and self.driver not in self._reserved:
            self.driver, self._drove_ns = self._next(), now_ns

    def report(self, now_ns: int) -> ParkingStatus:
        """Return what is to be published."""
        waiting = sorted((name for name in self._reserved if name != self.driver), key=self._rank)
        return ParkingStatus(
            t_ns=now_ns, bays=tuple(self._rows()), driver=self.driver, waiting=tuple(waiting),
            reason=self._reason if waiting and not self.driver else "",
        )  # fmt: skip

    def _put_back(self, now_ns: int) -> None:
        """Take the permission from a car that does not use it: its turn comes after all others."""
        car = self._cars.get(self.driver)
        if car is not None and car.status is not None and car.status.state == "drive":
            self._drove_ns = now_ns
        if self.driver in self._reserved and now_ns - self._drove_ns > STUCK_NS:
            held = self._reserved.pop(self.driver)
            held.is_put_back = True
            self._reserved[self.driver] = held
            self.driver = ""

    def _next(self) -> str:
        """Return whose turn it is; empty: nobody's."""
        self._reason = "the parking manager learns who drives"
        strays = [
            name
            for name, car in self._cars.items()
            if car.status is not None and car.status.state == "drive" and name not in self._reserved
        ]
        if strays:
            self._reason = f"{strays[0]} drives without a bay"
            return ""
        return min(self._reserved, key=self._rank, default="")

    def _rank(self, name: str) -> int:
        """Return 0 for a car that stands on its way to its bay, else 1.

        Sorted by rank, cars of the same rank stay in the order of their requests.
        """
        car, held = self._cars.get(name), self._reserved[name]
        if car is None or car.status is None or not held.is_confirmed or held.is_put_back:
            return 1
        return 0 if car.status.attempts > 0 else 1

    def _car(self, name: str, now_ns: int) -> _Car:
        car = self._cars.setdefault(name, _Car(now_ns))
        car.received_ns = now_ns
        return car

    def _goal_of(self, status: AutonomyStatus) -> Bay | None:
        """Return the bay that is a car's goal."""
        if status.goal_x_m is None or status.goal_y_m is None or status.goal_yaw_rad is None:
            return None
        goal = Pose2(status.goal_x_m, status.goal_y_m, status.goal_yaw_rad)
        return self._find(lambda bay: _is_same(Pose2(*bay.pose), goal))

    def _any_for(self, name: str) -> Bay | None:
        """Return the bay that a car has, else the first free one; None: there is none."""
        held = self._reserved.get(name)
        if held is not None:
            return held.bay
        stands = self._find(lambda bay: self._row(bay).vehicle == name)
        return stands or self._find(lambda bay: self._is_free(bay, name))

    def _find(self, condition: Callable[[Bay], bool]) -> Bay | None:
        return next((bay for bay in self._bays.values() if condition(bay)), None)

    def _is_free(self, bay: Bay, name: str) -> bool:
        """Return whether no other car has a bay."""
        return self._row(bay).vehicle in ("", name)

    def _rows(self) -> list[BayState]:
        return [self._row(bay) for bay in self._bays.values()]

    def _row(self, bay: Bay) -> BayState:
        for name, held in self._reserved.items():
            if held.bay is bay:
                return BayState(name=bay.name, state="reserved", vehicle=name)
        for name, car in self._cars.items():
            if car.pose is not None and _is_inside(car.pose, bay):
                return BayState(name=bay.name, state="occupied", vehicle=name)
        return BayState(name=bay.name, state="free")


def _is_same(one: Pose2, other: Pose2) -> bool:
    off = one.inverse() @ other
    return math.hypot(off.x, off.y) < SAME_M and abs(wrap_angle(off.yaw)) < SAME_RAD


def _is_inside(pose: Pose2, bay: Bay) -> bool:
    """Return whether a rear axle is in a bay, whichever way the car stands there."""
    off = Pose2(*bay.pose).inverse() @ pose
    return abs(off.x) < bay.length_m / 2.0 and abs(off.y) < bay.width_m / 2.0
