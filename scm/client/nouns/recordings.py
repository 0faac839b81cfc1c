"""Operations on recordings of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator

from scm.client.operation import Noun, operation
from scm.records.disturbances import RecordedDisturbances
from scm.records.operations import Operation
from scm.records.page import Page
from scm.records.recordings import Frames, Notes, RecordedEvent, RecordingRow, Summary


class RecordingsNoun(Noun):
    """Operations on recordings."""

    @operation("GET", "/api/v1/recordings/{name}.mcap")
    def file(self, name: str) -> Iterator[bytes]:
        """The file as the recorder wrote it, or a range of it.

        Args:
            name: a recording: its file without .mcap
        """

    @operation("GET", "/api/v1/recordings/{name}/foxglove.mcap")
    def foxglove(self, name: str) -> Iterator[bytes]:
        """The file for Foxglove.

        Args:
            name: a recording: its file without .mcap
        """

    @operation("GET", "/api/v1/recordings/{name}/csv")
    def as_csv(
        self, name: str, *, vehicle: str = "", from_s: float = 0.0, to_s: float | None = None
    ) -> bytes:
        """Its cars as CSV.

        Args:
            name: a recording: its file without .mcap
            vehicle: a car's own reports; empty: all cars as the world saw them
            from_s: seconds since the recording began
            to_s: to when; without: to the end
        """

    @operation("GET", "/api/v1/recordings/{name}/summary")
    def summary(self, name: str) -> Summary:
        """What a replay has to know first.

        Args:
            name: a recording: its file without .mcap
        """

    @operation("GET", "/api/v1/recordings/{name}/frames")
    def frames(
        self, name: str, *, from_s: float = 0.0, to_s: float = 10.0, hz: float = 10.0
    ) -> Frames:
        """Where everything was, from a time to another.

        Args:
            name: a recording: its file without .mcap
            from_s: seconds since the recording began
            to_s: seconds since the recording began
            hz: frames a second, at most
        """

    @operation("GET", "/api/v1/recordings/{name}/events")
    def events(self, name: str, *, limit: int = 500, cursor: str = "") -> Page[RecordedEvent]:
        """Its events, in their order.

        Args:
            name: a recording: its file without .mcap
        """

    @operation("GET", "/api/v1/recordings/{name}/disturbances")
    def disturbances(self, name: str) -> RecordedDisturbances:
        """What made measurements void while it was recorded.

        Args:
            name: a recording: its file without .mcap
        """

    @operation("GET", "/api/v1/recordings/{name}/eye/{camera}.jpg")
    def picture(self, name: str, camera: str, *, t_s: float = 0.0) -> bytes:
        """What an overhead camera saw, at a time.

        Args:
            name: a recording: its file without .mcap
            camera: an overhead camera
            t_s: seconds since the recording began
        """

    @operation("GET", "/api/v1/recordings/{name}/vehicles/{vehicle}/camera/{camera}.jpg")
    def car_picture(self, name: str, vehicle: str, camera: str, *, t_s: float = 0.0) -> bytes:
        """What a car's own camera saw, at a time.

        Args:
            name: a recording: its file without .mcap
            camera: one of its cameras
            t_s: seconds since the recording began
        """

    @operation("GET", "/api/v1/recordings/{name}/map.svg")
    def map_svg(self, name: str) -> bytes:
        """The map it was driven on.

        Args:
            name: a recording: its file without .mcap
        """

    @operation("GET", "/api/v1/recordings/{name}/notes")
    def notes(self, name: str) -> Notes:
        """What people wrote about it.

        Args:
            name: a recording: its file without .mcap
        """

    @operation("PUT", "/api/v1/recordings/{name}/notes")
    def write(
        self,
        name: str,
        *,
        if_match: str | None = None,
        if_none_match: str | None = None,
        title: str = "",
        notes: str = "",
        idempotency_key: str = "",
    ) -> Notes:
        """Name a recording and note something on it.

        Args:
            name: a recording: its file without .mcap
            title: shown first
            notes: in words, as long as need be
        """

    @operation("POST", "/api/v1/recordings/{name}/parts")
    def cut(
        self,
        name: str,
        *,
        from_s: float = 0.0,
        to_s: float | None = None,
        idempotency_key: str = "",
    ) -> Operation:
        """Copy a part of it into a recording of its own.

        Args:
            name: a recording: its file without .mcap
            from_s: seconds since the recording began
            to_s: likewise; without: to the end
        """

    @operation("GET", "/api/v1/recordings")
    def all_recordings(self, *, limit: int = 100, cursor: str = "") -> Page[RecordingRow]:
        """All recordings, the one written last first."""

    @operation("GET", "/api/v1/recordings/{name}")
    def one_recording(self, name: str) -> RecordingRow:
        """One recording.

        Args:
            name: a recording: its file without .mcap
        """

    @operation("DELETE", "/api/v1/recordings/{name}")
    def remove(self, name: str, *, idempotency_key: str = "") -> None:
        """Delete a recording.

        Args:
            name: a recording: its file without .mcap
        """
