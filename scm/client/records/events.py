"""Records of events.

Written by docs/make/client.py: do not change it here.
"""

import msgspec


class EventRow(msgspec.Struct, kw_only=True, frozen=True):
    """An event, and who took note of it.

    Attributes:
        seq: Number of the event since the server started.
        id: The same for this event for ever.
        severity: `info`, `warning` or `error`.
        source: Who told it.
        t_ns: When it was true, by the clock of who tells it [ns].
        name: What it is called.
        text: One sentence for a person.
        vehicle: The car it is about; null: none.
        acknowledged_by: Who took note of it; null: nobody yet.
        acknowledged_ns: When [ns since 1970]; null: not yet.
        note: What was said to it.
    """

    seq: int
    id: str
    severity: str
    source: str
    t_ns: int
    name: str
    text: str
    vehicle: str | None
    acknowledged_by: str | None
    acknowledged_ns: int | None
    note: str


class PageEventRow(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[EventRow, ...]
    next_: str | None = msgspec.field(name="next")


class Acknowledgement(msgspec.Struct, kw_only=True, frozen=True):
    """Who took note of an event.

    Attributes:
        event: Id of the event.
        by: Who took note of it.
        note: What was said to it; may be empty.
        at_ns: When [ns since 1970].
    """

    event: str
    by: str
    note: str
    at_ns: int


class Acknowledged(msgspec.Struct, kw_only=True, frozen=True):
    """What is acknowledged now.

    Attributes:
        acknowledgements: Of the events that were named, as they stand.
    """

    acknowledgements: tuple[Acknowledgement, ...]
