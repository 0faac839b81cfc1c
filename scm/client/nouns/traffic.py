"""Operations on traffic of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection
from scm.records.traffic import Counts, Violations


class TrafficNoun:
    """Operations on traffic."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def counts(self) -> Counts:
        """Counts, delays, queues and level of service."""
        return self._connection.request("GET", "/api/v1/traffic", Counts)

    def violations(self, *, vehicle: str = "", limit: int = 100) -> Violations:
        """Violations, newest first, with their evidence.

        Args:
            vehicle: of this car alone
            limit: how many at most
        """
        return self._connection.request(
            "GET",
            "/api/v1/traffic/violations",
            Violations,
            query={"vehicle": vehicle, "limit": limit},
        )
