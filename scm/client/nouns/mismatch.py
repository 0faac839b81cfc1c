"""Operations on mismatch of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator

from scm.client.operation import Noun, operation
from scm.records.mismatch import DrivePlans, Offers, Report, ReportRow, Upload
from scm.records.operations import Operation
from scm.records.page import Page


class MismatchNoun(Noun):
    """Operations on mismatch."""

    @operation("GET", "/api/v1/mismatch/offers")
    def offers(self) -> Offers:
        """What can be searched."""

    @operation("POST", "/api/v1/mismatch/jobs")
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
        """

    @operation("POST", "/api/v1/mismatch/uploads")
    def upload(self, *, name: str = "", content: bytes, idempotency_key: str = "") -> Upload:
        """Send a recording: a zip with recording.yaml, or of a run.

        Args:
            name: what to call it
            content: What to send.
        """

    @operation("GET", "/api/v1/mismatch/reports")
    def reports(self, *, limit: int = 100, cursor: str = "") -> Page[ReportRow]:
        """All reports, newest first."""

    @operation("GET", "/api/v1/mismatch/reports/{name}")
    def report(self, name: str) -> Report:
        """One report.

        Args:
            name: a report's name
        """

    @operation("DELETE", "/api/v1/mismatch/reports/{name}")
    def remove(self, name: str, *, idempotency_key: str = "") -> None:
        """Remove a report.

        Args:
            name: a report's name
        """

    @operation("GET", "/api/v1/mismatch/reports/{name}/files/{file}")
    def download(self, name: str, file: str) -> Iterator[bytes]:
        """Download a file of a report.

        Args:
            name: a report's name
            file: which file
        """

    @operation("GET", "/api/v1/mismatch/reports/{name}/drives/{drive}")
    def plans(self, name: str, drive: str) -> DrivePlans:
        """A suggested drive.

        Args:
            name: a report's name
            drive: a suggested drive
        """

    @operation("POST", "/api/v1/mismatch/reports/{name}/drives/{drive}/play")
    def play(
        self, name: str, drive: str, *, vehicle: str, part: int = 1, idempotency_key: str = ""
    ) -> Operation:
        """Let a car of the city play a drive of a report.

        Args:
            name: a report's name
            drive: a suggested drive
            vehicle: a car of the city
            part: of a drive in parts, between which the car is changed
        """
