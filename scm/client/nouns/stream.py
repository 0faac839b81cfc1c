"""Operations on stream of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator

from scm.client.operation import Noun, operation
from scm.client.stream import LiveEvent


class StreamNoun(Noun):
    """Operations on stream."""

    @operation("GET", "/api/v1/stream")
    def live(self, *, topics: str = "") -> Iterator[LiveEvent]:
        """What is live: a snapshot, then what changed, at 20 Hz.

        Args:
            topics: comma-separated: pulse, stop, vehicles, signals, signal_status, autonomy,
                room_maps, boxes, twins, acknowledgements, eye, stations, events; none: all
        """

    @operation("GET", "/api/v1/vehicles.bin")
    def states(self) -> Iterator[bytes]:
        """All cars' states at 20 Hz, binary; the layout stands in docs/dashboard/map.md."""
