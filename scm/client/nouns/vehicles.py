"""Operations on vehicles of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator
from typing import Literal

from scm.client.operation import Noun, operation
from scm.client.stream import LiveEvent
from scm.records.room_maps import RoomMapRow
from scm.records.vehicles import LinkRow, PathRow, VehicleRow, VehiclesTopic
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.light_request import LightReply
from scm.v2x.messages.park_request import ParkReply
from scm.v2x.messages.remove_request import RemoveReply
from scm.v2x.messages.route_request import RouteReply
from scm.v2x.messages.spawn_request import SpawnReply


class VehiclesNoun(Noun):
    """Operations on vehicles."""

    @operation("POST", "/api/v1/vehicles/{name}/goal")
    def park(self, name: str, *, goal: str, idempotency_key: str = "") -> ParkReply:
        """Send a car that parks itself to a goal.

        Args:
            goal: a spawn place or bay of the map, `any` for any bay, or X,Y,DEG (metres, degrees,
                map frame) of the rear axle's centre
        """

    @operation("GET", "/api/v1/vehicles/{name}/goal")
    def autonomy(self, name: str) -> AutonomyStatus:
        """A parking car's goal, what it does, and where it thinks that it is."""

    @operation("GET", "/api/v1/vehicles/{name}/plan")
    def plan(self, name: str) -> AutonomyPlan:
        """A parking car's path, candidates, particles, and obstacles that the map has not."""

    @operation("GET", "/api/v1/vehicles/{name}/costmap")
    def costmap(self, name: str) -> Costmap:
        """How far each place is from the nearest obstacle, as a parking car's planners see."""

    @operation("GET", "/api/v1/vehicles/{name}/map")
    def room_map(self, name: str) -> RoomMapRow:
        """The map that a car makes of an unknown room."""

    @operation("GET", "/api/v1/vehicles/{name}/reports")
    def reports(
        self, name: str, *, scan: bool = False, network: bool = False
    ) -> Iterator[LiveEvent]:
        """All that a car reports, as server-sent events `reports`.

        Args:
            scan: each turn of its LIDAR too, as `scan`; null: it has none
            network: what a network that drives it makes of a frame too, as `network`
        """

    @operation("GET", "/api/v1/vehicles/{name}/link")
    def link(self, name: str) -> LinkRow:
        """How long the way to a car and back is now."""

    @operation("GET", "/api/v1/vehicles/{name}/path")
    def path(self, name: str) -> PathRow:
        """A car's path ahead, at most 12 m of it."""

    @operation("GET", "/api/v1/vehicles")
    def all_vehicles(self) -> VehiclesTopic:
        """All cars on the map."""

    @operation("POST", "/api/v1/vehicles")
    def spawn(
        self, *, vehicle: str = "", car: str = "nigel", spawn: str = "", idempotency_key: str = ""
    ) -> SpawnReply:
        """Spawn a hosted car.

        Args:
            vehicle: its name; empty: the world names it
            car: name of its car file
            spawn: a spawn place, or X,Y,DEG (metres, degrees, map frame); empty: any free one
        """

    @operation("GET", "/api/v1/vehicles/{name}")
    def one_car(self, name: str) -> VehicleRow:
        """One car."""

    @operation("DELETE", "/api/v1/vehicles/{name}")
    def remove(self, name: str, *, reason: str = "", idempotency_key: str = "") -> RemoveReply:
        """Take a car off the map.

        Args:
            reason: why, for the log
        """

    @operation("POST", "/api/v1/vehicles/{name}/route")
    def route(
        self,
        name: str,
        *,
        via: tuple[str, ...] = (),
        laps: int = 1,
        speed_mps: float | None = None,
        then: Literal["circulate", "stop"] = "stop",
        idempotency_key: str = "",
    ) -> RouteReply:
        """Send a car on a route.

        Args:
            via: lanes to pass, in this order
            laps: how often to pass them
            speed_mps: target speed on a free road; null: the limits
            then: at the end of the last lane: stand, or drive on without end
        """

    @operation("PUT", "/api/v1/vehicles/{name}/lights")
    def lights(
        self,
        name: str,
        *,
        headlights: Literal["high", "low", "off"] | None = None,
        indicators: Literal["hazard", "left", "off", "right"] | None = None,
        idempotency_key: str = "",
    ) -> LightReply:
        """Switch a car's headlights and indicators.

        Args:
            headlights: null: as they are
            indicators: null: as they are
        """
