"""The driver of one car that drives itself: a batch of one, with the same compiled controller.

It knows only what each `RouteView` shows it.
"""

import math
import zlib

import numpy as np

from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.trip import Trip
from scm.vehicles.driver import CarLimits, Other, RouteView
from scm.vehicles.drivers.channel import POOR_RECEPTION
from scm.vehicles.drivers.driver_batch import DriverBatch
from scm.vehicles.drivers.driver_state import WAITING_FOR
from scm.vehicles.drivers.lane_graph import lane_graph_of
from scm.vehicles.drivers.trips import Trips

OWN = 0
MAX_OTHERS = 63  # more cannot stand within the driver's reach


class SingleDriver:
    """The driver of one car.

    Attributes:
        batch: Where it is sent, as vehicle index `OWN`; the other indices show the others.
    """

    def __init__(self, roads: Roads, limits: CarLimits, seed: int = 0) -> None:
        self.batch = DriverBatch(lane_graph_of(roads), 1 + MAX_OTHERS)
        self.batch.enter(OWN, limits, seed)
        self._shown = 0

    @property
    def done_m(self) -> float:
        """Distance driven since it was sent [m]."""
        return float(self.batch.done_m[OWN])

    @property
    def cross_track(self) -> float:
        """Lateral offset of the rear axle from the route [m], + = left."""
        return float(self.batch.cross_track[OWN])

    @property
    def waiting_for(self) -> str | None:
        """What the car is waiting for at rest: `signal`, `vehicle`, `stop`, `sign`, or None."""
        return WAITING_FOR[self.batch.waiting[OWN]]

    @property
    def at_signals(self) -> str | None:
        """What keeps it from passing the signals ahead, moving or at rest; see `waiting_for`."""
        return WAITING_FOR[self.batch.at_signals[OWN]]

    @property
    def arrived(self) -> bool:
        """Whether the route is done."""
        return bool(self.batch.arrived[OWN])

    def decide(self, view: RouteView) -> tuple[float, float]:
        """Return (throttle, steering), both -1 to 1: + forward, + left."""
        self._show(_nearest(view), view.now_ns)
        self.batch.channel.numbers[POOR_RECEPTION] = 0.0 if view.reception_is_good else 1.0
        pose = (*view.pose, view.speed)
        return self.batch.decide_one(OWN, view.now_ns, pose, view.signals, stop=view.stop)

    def _show(self, others: tuple[Other, ...], now_ns: int) -> None:
        """Show the others to the batch as if each had just sent a CAM."""
        batch = self.batch
        for index in range(1 + len(others), 1 + self._shown):
            batch.show(index, 0.0, 0.0)
        self._shown = len(others)
        if others:
            for index, other in enumerate(others, start=1):
                batch.show(index, other.length, other.width)
            cams = np.array([_cam(other) for other in others])
            batch.receive_cams(np.arange(1, 1 + len(others)), now_ns, *cams.T)


class TripDriver:
    """Drives one car on trips; it circulates until it is sent somewhere.

    Attributes:
        driver: The driver of the present trip.
        off_lane: Why it cannot drive from where it stands: beside all lanes, or on a lane that
            leads nowhere. Empty if it can.
    """

    def __init__(
        self, vehicle: str, roads: Roads, limits: CarLimits, pose: Pose2, now_ns: int
    ) -> None:
        """Start to circulate from where the car stands."""
        self._vehicle = vehicle
        self.driver = SingleDriver(roads, limits, zlib.crc32(vehicle.encode()))
        self._trips = Trips(self.driver.batch)
        self.off_lane = ""
        try:
            self._trips.circulate(OWN, vehicle, pose, now_ns)
        except MapError as error:
            self.off_lane = str(error)

    def use_limits(self, limits: CarLimits) -> None:
        """Drive by other limits from now on."""
        self.driver.batch.use_limits(OWN, limits)

    def begin(self, request: RouteRequest, pose: Pose2, now_ns: int) -> RouteReply:
        """Send the car on a trip from where it is; a trip under way ends without arrival.

        Raises:
            MapError: when the lanes do not exist or cannot be reached.
            LeaseError: when the request may replace only a trip that the car is not on.
        """
        reply = self._trips.begin(OWN, self._vehicle, request, pose, now_ns)
        self.off_lane = ""
        return reply

    def decide(self, view: RouteView) -> tuple[float, float]:
        """Return (throttle, steering); after arrival circulate if the request asked for it."""
        if self.off_lane:
            return 0.0, 0.0
        commands = self.driver.decide(view)
        self._trips.check_arrivals(view.now_ns)
        return commands

    def reports(self, now_ns: int) -> list[Trip]:
        """Return the trip messages that are due: twice a second, and when a trip ends."""
        return self._trips.reports(now_ns)


def _nearest(view: RouteView) -> tuple[Other, ...]:
    if len(view.others) <= MAX_OTHERS:
        return view.others
    x, y, _ = view.pose
    return tuple(sorted(view.others, key=lambda o: math.hypot(o.x - x, o.y - y))[:MAX_OTHERS])


def _cam(other: Other) -> tuple[float, float, float, float, float]:
    """Return the CAM columns of a car: front bumper x and y, heading, speed, yaw rate."""
    ahead = 0.5 * other.length
    x, y = other.x + ahead * math.cos(other.yaw), other.y + ahead * math.sin(other.yaw)
    return x, y, other.yaw, other.speed, 0.0
