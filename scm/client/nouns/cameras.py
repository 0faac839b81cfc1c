"""Operations on cameras of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator

from scm.client.connection import Connection, part
from scm.records.cameras import Cameras


class CamerasNoun:
    """Operations on cameras."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def still(self, name: str, camera: str) -> bytes:
        """One picture.

        Args:
            name: a name on the bus
            camera: a name on the bus
        """
        return self._connection.fetch(f"/api/v1/vehicles/{part(name)}/camera/{part(camera)}.jpg")

    def film(self, name: str, camera: str) -> Iterator[bytes]:
        """A film.

        Args:
            name: a name on the bus
            camera: a name on the bus
        """
        return self._connection.pieces(f"/api/v1/vehicles/{part(name)}/camera/{part(camera)}/film")

    def cameras(self, name: str) -> Cameras:
        """A car's cameras, and which are watched here.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/vehicles/{part(name)}/camera", Cameras)
