"""The trips of one car that drives itself: it circulates until it is sent somewhere."""

import zlib

from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.trip import Trip
from scm.vehicles.driver import CarLimits, RouteView
from scm.vehicles.drivers.alone import OWN, Alone
from scm.vehicles.drivers.errands import Errands


class Trips:
    """Where one car was sent, and the driver that takes it there.

    Attributes:
        driver: Of the present trip.
    """

    def __init__(
        self, vehicle: str, roads: Roads, limits: CarLimits, pose: Pose2, now_ns: int
    ) -> None:
        """Begin to circulate from where the car stands.

        Raises:
            MapError: when it stands beside all lanes, or on one that leads nowhere.
        """
        self._vehicle = vehicle
        self.driver = Alone(roads, limits, zlib.crc32(vehicle.encode()))
        self._errands = Errands(self.driver.crowd)
        self._errands.circulate(OWN, vehicle, pose, now_ns)

    def begin(self, request: RouteRequest, pose: Pose2, now_ns: int) -> RouteReply:
        """Send the car on a trip from where it is; a trip under way ends without arrival.

        Raises:
            MapError: when the lanes do not exist or cannot be reached.
        """
        return self._errands.begin(OWN, self._vehicle, request, pose, now_ns)

    def decide(self, view: RouteView) -> tuple[float, float]:
        """Return (throttle, steering); on arrival go on circulating where that was asked for."""
        commands = self.driver.decide(view)
        self._errands.look(view.now_ns)
        return commands

    def reports(self, now_ns: int) -> list[Trip]:
        """Return what is to be told of the trip now: twice a second, and when it ended."""
        return self._errands.reports(now_ns)
