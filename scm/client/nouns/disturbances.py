"""Operations on disturbances of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection
from scm.records.disturbances import DisturbanceList


class DisturbancesNoun:
    """Operations on disturbances."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def disturbances(self) -> DisturbanceList:
        """What made measurements void in the last hour, and does so now."""
        return self._connection.request("GET", "/api/v1/disturbances", DisturbanceList)
