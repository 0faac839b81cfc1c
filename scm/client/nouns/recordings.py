"""Operations on recordings of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator

from scm.client.connection import Connection, part
from scm.records.disturbances import RecordedDisturbances
from scm.records.operations import Operation
from scm.records.page import Page
from scm.records.recordings import Frames, Notes, RecordedEvent, RecordingRow, Summary


class RecordingsNoun:
    """Operations on recordings."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def file(self, name: str) -> Iterator[bytes]:
        """The file as the recorder wrote it, or a range of it.

        Args:
            name: a recording: its file without .mcap
        """
        return self._connection.pieces(f"/api/v1/recordings/{part(name)}.mcap")

    def foxglove(self, name: str) -> Iterator[bytes]:
        """The file for Foxglove.

        Args:
            name: a recording: its file without .mcap
        """
        return self._connection.pieces(f"/api/v1/recordings/{part(name)}/foxglove.mcap")

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
        return self._connection.fetch(
            f"/api/v1/recordings/{part(name)}/csv",
            query={"vehicle": vehicle, "from_s": from_s, "to_s": to_s},
        )

    def summary(self, name: str) -> Summary:
        """What a replay has to know first.

        Args:
            name: a recording: its file without .mcap
        """
        return self._connection.request("GET", f"/api/v1/recordings/{part(name)}/summary", Summary)

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
        return self._connection.request(
            "GET",
            f"/api/v1/recordings/{part(name)}/frames",
            Frames,
            query={"from_s": from_s, "to_s": to_s, "hz": hz},
        )

    def events(self, name: str, *, limit: int = 500, cursor: str = "") -> Page[RecordedEvent]:
        """Its events, in their order.

        Args:
            name: a recording: its file without .mcap
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET",
            f"/api/v1/recordings/{part(name)}/events",
            Page[RecordedEvent],
            query={"limit": limit, "cursor": cursor},
        )

    def disturbances(self, name: str) -> RecordedDisturbances:
        """What made measurements void while it was recorded.

        Args:
            name: a recording: its file without .mcap
        """
        return self._connection.request(
            "GET", f"/api/v1/recordings/{part(name)}/disturbances", RecordedDisturbances
        )

    def picture(self, name: str, camera: str, *, t_s: float = 0.0) -> bytes:
        """What an overhead camera saw, at a time.

        Args:
            name: a recording: its file without .mcap
            camera: an overhead camera
            t_s: seconds since the recording began
        """
        return self._connection.fetch(
            f"/api/v1/recordings/{part(name)}/eye/{part(camera)}.jpg", query={"t_s": t_s}
        )

    def car_picture(self, name: str, vehicle: str, camera: str, *, t_s: float = 0.0) -> bytes:
        """What a car's own camera saw, at a time.

        Args:
            name: a recording: its file without .mcap
            vehicle: a name on the bus
            camera: one of its cameras
            t_s: seconds since the recording began
        """
        return self._connection.fetch(
            f"/api/v1/recordings/{part(name)}/vehicles/{part(vehicle)}/camera/{part(camera)}.jpg",
            query={"t_s": t_s},
        )

    def map_svg(self, name: str) -> bytes:
        """The map it was driven on.

        Args:
            name: a recording: its file without .mcap
        """
        return self._connection.fetch(f"/api/v1/recordings/{part(name)}/map.svg")

    def notes(self, name: str) -> Notes:
        """What people wrote about it.

        Args:
            name: a recording: its file without .mcap
        """
        return self._connection.request("GET", f"/api/v1/recordings/{part(name)}/notes", Notes)

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
            if_match: ETag of the state that was edited; `*`: whichever there is
            if_none_match: `*`: only where there is none yet
            title: shown first
            notes: in words, as long as need be
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/recordings/{part(name)}/notes",
            Notes,
            headers={"if-match": if_match, "if-none-match": if_none_match},
            body={"title": title, "notes": notes},
            key=idempotency_key,
        )

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
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/recordings/{part(name)}/parts",
            Operation,
            body={"from_s": from_s, "to_s": to_s},
            key=idempotency_key,
        )

    def all_recordings(self, *, limit: int = 100, cursor: str = "") -> Page[RecordingRow]:
        """All recordings, the one written last first.

        Args:
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET",
            "/api/v1/recordings",
            Page[RecordingRow],
            query={"limit": limit, "cursor": cursor},
        )

    def one_recording(self, name: str) -> RecordingRow:
        """One recording.

        Args:
            name: a recording: its file without .mcap
        """
        return self._connection.request("GET", f"/api/v1/recordings/{part(name)}", RecordingRow)

    def remove(self, name: str, *, idempotency_key: str = "") -> None:
        """Delete a recording.

        Args:
            name: a recording: its file without .mcap
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        self._connection.send_only(
            "DELETE", f"/api/v1/recordings/{part(name)}", key=idempotency_key
        )
