"""Operations on twins of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.page import Page
from scm.records.twins import Twin, TwinRow


class TwinsNoun(Noun):
    """Operations on twins."""

    @operation("GET", "/api/v1/twins")
    def all_twins(self, *, limit: int = 100, cursor: str = "") -> Page[TwinRow]:
        """All watched cars in short."""

    @operation("GET", "/api/v1/twins/{vehicle}")
    def one_twin(self, vehicle: str) -> Twin:
        """One car: its changes, and the versions of its file.

        Args:
            vehicle: a car's name
        """

    @operation("PUT", "/api/v1/twins/{vehicle}/version")
    def use_version(
        self,
        vehicle: str,
        *,
        version: int,
        by: str = "",
        reason: str = "",
        idempotency_key: str = "",
    ) -> Twin:
        """Predict a car by another version of its file.

        Args:
            vehicle: a car's name
            version: its number; 0: the file that it came with
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
        """

    @operation("POST", "/api/v1/twins/{vehicle}/drive")
    def send_car(
        self, vehicle: str, *, send: str, by: str = "", reason: str = "", idempotency_key: str = ""
    ) -> Twin:
        """Send the car that would decide whose another car's change is.

        Args:
            vehicle: a car's name
            send: the car to send, as the change's `drive` says
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
        """
