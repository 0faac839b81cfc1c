"""Operations on cities of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection, part
from scm.records.cities import Cities, CityRow


class CitiesNoun:
    """Operations on cities."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def all_cities(self) -> Cities:
        """The cities that this server shows: its own."""
        return self._connection.request("GET", "/api/v1/cities", Cities)

    def one_city(self, name: str) -> CityRow:
        """One city.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/cities/{part(name)}", CityRow)
