"""Operations on stations of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection, part
from scm.records.stations import StationEvents, Stations


class StationsNoun:
    """Operations on stations."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def all_stations(self) -> Stations:
        """All stations."""
        return self._connection.request("GET", "/api/v1/stations", Stations)

    def one_station(self, name: str) -> Stations:
        """One station.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/stations/{part(name)}", Stations)

    def station_events(self, name: str) -> StationEvents:
        """The last events that a station told, or that are about it.

        Args:
            name: a name on the bus
        """
        return self._connection.request(
            "GET", f"/api/v1/stations/{part(name)}/events", StationEvents
        )
