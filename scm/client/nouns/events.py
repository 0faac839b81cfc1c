"""Operations on events of a city.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

from scm.client.operation import Noun, operation
from scm.records.events import Acknowledged, Acknowledgement, EventRow
from scm.records.page import Page


class EventsNoun(Noun):
    """Operations on events."""

    @operation("GET", "/api/v1/events")
    def events(
        self,
        *,
        open_: bool = False,
        after: int = 0,
        limit: int = 100,
        cursor: str = "",
        severity: str = "",
        source: str = "",
        name: str = "",
        vehicle: str = "",
        text: str = "",
        since_ns: int | None = None,
        until_ns: int | None = None,
    ) -> Page[EventRow]:
        """Events, newest first.

        Args:
            open_: only those that are not acknowledged
            after: only those numbered above
            severity: one or more, comma between
            source: stations, comma between
            name: names, comma between
            vehicle: of a car
            text: to be found in it
            since_ns: not before [ns since 1970]
            until_ns: not after [ns since 1970]
        """

    @operation("GET", "/api/v1/events.{form}")
    def export(
        self,
        form: Literal["csv", "jsonl"],
        *,
        open_: bool = False,
        severity: str = "",
        source: str = "",
        name: str = "",
        vehicle: str = "",
        text: str = "",
        since_ns: int | None = None,
        until_ns: int | None = None,
    ) -> bytes:
        """Events as a file.

        Args:
            form: of the file
            open_: only those that are not acknowledged
            severity: one or more, comma between
            source: stations, comma between
            name: names, comma between
            vehicle: of a car
            text: to be found in it
            since_ns: not before [ns since 1970]
            until_ns: not after [ns since 1970]
        """

    @operation("POST", "/api/v1/events/acknowledgements")
    def acknowledge(
        self, *, events: tuple[str, ...], by: str = "", note: str = "", idempotency_key: str = ""
    ) -> Acknowledged:
        """Take note of events.

        Args:
            events: ids of the events
            by: who requests it, for the log; empty: the caller
            note: a remark
        """

    @operation("DELETE", "/api/v1/events/acknowledgements/{name}")
    def take_back(self, name: str, *, idempotency_key: str = "") -> Acknowledgement:
        """Take an acknowledgement back."""
