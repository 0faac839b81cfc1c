"""Operations on scans of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator

from scm.client.connection import Connection, part
from scm.client.stream import LiveEvent
from scm.records.scans import ScanRow


class ScansNoun:
    """Operations on scans."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def one(self, name: str) -> ScanRow:
        """The next turn of a car's LIDAR.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/vehicles/{part(name)}/scan", ScanRow)

    def every(self, name: str) -> Iterator[LiveEvent]:
        """Every turn, as server-sent events.

        Args:
            name: a name on the bus
        """
        return self._connection.events(f"/api/v1/vehicles/{part(name)}/scan/stream")
