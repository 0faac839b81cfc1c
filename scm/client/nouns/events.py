"""Operations on events of a city.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

from scm.client.connection import Connection, part
from scm.records.events import Acknowledged, Acknowledgement, EventRow
from scm.records.page import Page


class EventsNoun:
    """Operations on events."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

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
            open_: only those nobody took note of
            after: only those numbered above
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
            severity: one or more, comma between
            source: stations, comma between
            name: names, comma between
            vehicle: of a car
            text: to be found in it
            since_ns: not before [ns since 1970]
            until_ns: not after [ns since 1970]
        """
        return self._connection.request(
            "GET",
            "/api/v1/events",
            Page[EventRow],
            query={
                "open": open_,
                "after": after,
                "limit": limit,
                "cursor": cursor,
                "severity": severity,
                "source": source,
                "name": name,
                "vehicle": vehicle,
                "text": text,
                "since_ns": since_ns,
                "until_ns": until_ns,
            },
        )

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
            open_: only those nobody took note of
            severity: one or more, comma between
            source: stations, comma between
            name: names, comma between
            vehicle: of a car
            text: to be found in it
            since_ns: not before [ns since 1970]
            until_ns: not after [ns since 1970]
        """
        return self._connection.fetch(
            f"/api/v1/events.{part(form)}",
            query={
                "open": open_,
                "severity": severity,
                "source": source,
                "name": name,
                "vehicle": vehicle,
                "text": text,
                "since_ns": since_ns,
                "until_ns": until_ns,
            },
        )

    def acknowledge(
        self, *, events: tuple[str, ...], by: str = "", note: str = "", idempotency_key: str = ""
    ) -> Acknowledged:
        """Take note of events.

        Args:
            events: ids of the events
            by: who requests it, for the log; empty: whoever calls
            note: what there is to say
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            "/api/v1/events/acknowledgements",
            Acknowledged,
            body={"events": events, "by": by, "note": note},
            key=idempotency_key,
        )

    def take_back(self, name: str, *, idempotency_key: str = "") -> Acknowledgement:
        """Take an acknowledgement back.

        Args:
            name: a name on the bus
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "DELETE",
            f"/api/v1/events/acknowledgements/{part(name)}",
            Acknowledgement,
            key=idempotency_key,
        )
