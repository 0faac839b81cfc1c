"""Operations on scans of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator

from scm.client.operation import Noun, operation
from scm.client.stream import LiveEvent
from scm.records.scans import ScanRow


class ScansNoun(Noun):
    """Operations on scans."""

    @operation("GET", "/api/v1/vehicles/{name}/scan")
    def one(self, name: str) -> ScanRow:
        """The next turn of a car's LIDAR."""

    @operation("GET", "/api/v1/vehicles/{name}/scan/stream")
    def every(self, name: str) -> Iterator[LiveEvent]:
        """Every turn, as server-sent events."""
