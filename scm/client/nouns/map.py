"""Operations on map of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection
from scm.records.city_map import CityMap


class MapNoun:
    """Operations on map."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def map_json(self) -> CityMap:
        """The map as JSON."""
        return self._connection.request("GET", "/api/v1/map", CityMap)

    def map_svg(self) -> bytes:
        """The map drawn."""
        return self._connection.fetch("/api/v1/map.svg")
