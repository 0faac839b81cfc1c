"""Operations on map of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.city_map import CityMap


class MapNoun(Noun):
    """Operations on map."""

    @operation("GET", "/api/v1/map")
    def map_json(self) -> CityMap:
        """The map as JSON."""

    @operation("GET", "/api/v1/map.svg")
    def map_svg(self) -> bytes:
        """The map drawn."""
