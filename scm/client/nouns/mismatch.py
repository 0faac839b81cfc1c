"""Operations on mismatch of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator

from scm.client.connection import Connection, part
from scm.records.mismatch import DrivePlans, Offers, Report, ReportRow, Upload
from scm.records.operations import Operation
from scm.records.page import Page


class MismatchNoun:
    """Operations on mismatch."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def offers(self) -> Offers:
        """What can be searched."""
        return self._connection.request("GET", "/api/v1/mismatch/offers", Offers)

    def search(
        self,
        *,
        recording: str = "",
        upload: str = "",
        again: str = "",
        vehicle: str = "",
        car: str = "",
        budget_s: float | None = None,
        from_s: float | None = None,
        to_s: float | None = None,
        idempotency_key: str = "",
    ) -> Operation:
        """Search for what the simulator left out.

        Args:
            recording: name of a stored recording
            upload: id of an upload, instead
            again: a report, instead: its recordings and drives since
            vehicle: which car of it; empty: all
            car: its car file's name; empty: as in the recording
            budget_s: time allowed for the search; it reports what it found by then [s]; null:
                1800, of a search again as before
            from_s: leave out what is before, since its begin [s]
            to_s: leave out what is after [s]
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            "/api/v1/mismatch/jobs",
            Operation,
            body={
                "recording": recording,
                "upload": upload,
                "again": again,
                "vehicle": vehicle,
                "car": car,
                "budget_s": budget_s,
                "from_s": from_s,
                "to_s": to_s,
            },
            key=idempotency_key,
        )

    def upload(self, *, name: str = "", content: bytes, idempotency_key: str = "") -> Upload:
        """Send a recording: a zip with recording.yaml, or of a run.

        Args:
            name: what to call it
            content: What to send.
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.send(
            "POST",
            "/api/v1/mismatch/uploads",
            Upload,
            content,
            query={"name": name},
            key=idempotency_key,
        )

    def reports(self, *, limit: int = 100, cursor: str = "") -> Page[ReportRow]:
        """All reports, newest first.

        Args:
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET",
            "/api/v1/mismatch/reports",
            Page[ReportRow],
            query={"limit": limit, "cursor": cursor},
        )

    def report(self, name: str) -> Report:
        """One report.

        Args:
            name: a report's name
        """
        return self._connection.request("GET", f"/api/v1/mismatch/reports/{part(name)}", Report)

    def remove(self, name: str, *, idempotency_key: str = "") -> None:
        """Remove a report.

        Args:
            name: a report's name
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        self._connection.send_only(
            "DELETE", f"/api/v1/mismatch/reports/{part(name)}", key=idempotency_key
        )

    def download(self, name: str, file: str) -> Iterator[bytes]:
        """Download a file of a report.

        Args:
            name: a report's name
            file: which file
        """
        return self._connection.pieces(f"/api/v1/mismatch/reports/{part(name)}/files/{part(file)}")

    def plans(self, name: str, drive: str) -> DrivePlans:
        """A suggested drive.

        Args:
            name: a report's name
            drive: a suggested drive
        """
        return self._connection.request(
            "GET", f"/api/v1/mismatch/reports/{part(name)}/drives/{part(drive)}", DrivePlans
        )

    def play(
        self, name: str, drive: str, *, vehicle: str, part_: int = 1, idempotency_key: str = ""
    ) -> Operation:
        """Let a car of the city play a drive of a report.

        Args:
            name: a report's name
            drive: a suggested drive
            vehicle: a car of the city
            part_: of a drive in parts, between which the car is changed
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/mismatch/reports/{part(name)}/drives/{part(drive)}/play",
            Operation,
            body={"vehicle": vehicle, "part": part_},
            key=idempotency_key,
        )
