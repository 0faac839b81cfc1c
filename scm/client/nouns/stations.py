"""Operations on stations of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.stations import StationEvents, Stations


class StationsNoun(Noun):
    """Operations on stations."""

    @operation("GET", "/api/v1/stations")
    def all_stations(self) -> Stations:
        """All stations."""

    @operation("GET", "/api/v1/stations/{name}")
    def one_station(self, name: str) -> Stations:
        """One station."""

    @operation("GET", "/api/v1/stations/{name}/events")
    def station_events(self, name: str) -> StationEvents:
        """The last events that a station reported, or that are about it."""
