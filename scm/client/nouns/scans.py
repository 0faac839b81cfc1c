"""Operations on scans of a city.

Written by docs/make/client.py: do not change it here.
"""

from typing import Any

from scm.client.connection import Connection, part


class ScansNoun:
    """Operations on scans."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def one(self, name: str) -> Any:
        """The next turn of a car's LIDAR.

        Args:
            name: a name on the bus
        """
        return self._connection.ask("GET", f"/api/v1/vehicles/{part(name)}/scan", Any)

    def every(self, name: str) -> Any:
        """Every turn, as server-sent events.

        Args:
            name: a name on the bus
        """
        return self._connection.ask("GET", f"/api/v1/vehicles/{part(name)}/scan/stream", Any)
