"""Operations on vehicles of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator
from typing import Literal

from scm.client.connection import Connection, part
from scm.client.stream import LiveEvent
from scm.records.vehicles import LinkRow, PathRow, VehicleRow, VehiclesTopic
from scm.v2x.messages.light_request import LightReply
from scm.v2x.messages.remove_request import RemoveReply
from scm.v2x.messages.route_request import RouteReply
from scm.v2x.messages.spawn_request import SpawnReply


class VehiclesNoun:
    """Operations on vehicles."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def reports(self, name: str, *, scan: bool = False) -> Iterator[LiveEvent]:
        """All that a car reports, as server-sent events `reports`.

        Args:
            name: a name on the bus
            scan: each turn of its LIDAR too, as `scan`; null: it has none
        """
        return self._connection.events(
            f"/api/v1/vehicles/{part(name)}/reports", query={"scan": scan}
        )

    def link(self, name: str) -> LinkRow:
        """How long the way to a car and back is now.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/vehicles/{part(name)}/link", LinkRow)

    def path(self, name: str) -> PathRow:
        """A car's way ahead, at most 12 m of it.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/vehicles/{part(name)}/path", PathRow)

    def all_vehicles(self) -> VehiclesTopic:
        """All cars on the map."""
        return self._connection.request("GET", "/api/v1/vehicles", VehiclesTopic)

    def spawn(
        self, *, vehicle: str = "", car: str = "nigel", spawn: str = "", idempotency_key: str = ""
    ) -> SpawnReply:
        """Spawn a hosted car.

        Args:
            vehicle: its name; empty: the world names it
            car: name of its car file
            spawn: a spawn place, or X,Y,DEG (metres, degrees, map frame); empty: any free one
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            "/api/v1/vehicles",
            SpawnReply,
            body={"vehicle": vehicle, "car": car, "spawn": spawn},
            key=idempotency_key,
        )

    def one_car(self, name: str) -> VehicleRow:
        """One car.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/vehicles/{part(name)}", VehicleRow)

    def remove(self, name: str, *, reason: str = "", idempotency_key: str = "") -> RemoveReply:
        """Take a car off the map.

        Args:
            name: a name on the bus
            reason: why, for the log
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "DELETE",
            f"/api/v1/vehicles/{part(name)}",
            RemoveReply,
            query={"reason": reason},
            key=idempotency_key,
        )

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
            name: a name on the bus
            via: lanes to pass, in this order
            laps: how often to pass them
            speed_mps: target speed on a free road; null: the limits
            then: at the end of the last lane: stand, or drive on without end
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/vehicles/{part(name)}/route",
            RouteReply,
            body={"via": via, "laps": laps, "speed_mps": speed_mps, "then": then},
            key=idempotency_key,
        )

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
            name: a name on the bus
            headlights: null: as they are
            indicators: null: as they are
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/vehicles/{part(name)}/lights",
            LightReply,
            body={"headlights": headlights, "indicators": indicators},
            key=idempotency_key,
        )
