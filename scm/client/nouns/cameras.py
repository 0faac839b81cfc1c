"""Operations on cameras of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator

from scm.client.operation import Noun, operation
from scm.records.cameras import Cameras


class CamerasNoun(Noun):
    """Operations on cameras."""

    @operation("GET", "/api/v1/vehicles/{name}/camera/{camera}.jpg")
    def still(self, name: str, camera: str) -> bytes:
        """One picture."""

    @operation("GET", "/api/v1/vehicles/{name}/camera/{camera}/film")
    def film(self, name: str, camera: str) -> Iterator[bytes]:
        """A film."""

    @operation("GET", "/api/v1/vehicles/{name}/camera")
    def cameras(self, name: str) -> Cameras:
        """A car's cameras, and which are watched here."""
