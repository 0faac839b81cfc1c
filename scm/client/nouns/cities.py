"""Operations on cities of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.cities import Cities, CityRow


class CitiesNoun(Noun):
    """Operations on cities."""

    @operation("GET", "/api/v1/cities")
    def all_cities(self) -> Cities:
        """The cities that this server shows: its own."""

    @operation("GET", "/api/v1/cities/{name}")
    def one_city(self, name: str) -> CityRow:
        """One city."""
