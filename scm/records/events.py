"""The event log: entries, and who acknowledged them."""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.records.body import Body, By
from scm.records.fields import (
    Id,
    Name,
    Note,
    RequestedBy,
    SeverityName,
    SourceName,
    Text,
    TNs,
    VehicleName,
)


class Acknowledgement(msgspec.Struct, kw_only=True, frozen=True):
    """Who took note of an event.

    Attributes:
        event: Id of the event.
        by: Who took note of it.
        note: A comment; may be empty.
        at_ns: When [ns since 1970].
    """

    event: Annotated[str, Meta(examples=["9f3a51c07be2d418"])]
    by: RequestedBy
    note: Note
    at_ns: int


class LoggedEvent(msgspec.Struct, kw_only=True, frozen=True):
    """An event and its number; numbers start at 1 and have no gaps.

    Attributes:
        seq: Number of the event since the server started.
        id: The same for this event for ever: of its time, source, name and text.
        vehicle: The car it is about; null: none.
    """

    seq: int
    id: Id
    severity: SeverityName
    source: SourceName
    t_ns: TNs
    name: Name
    text: Text
    vehicle: VehicleName | None = None


class EventRow(msgspec.Struct, kw_only=True, frozen=True):
    """An event, and who took note of it.

    Attributes:
        seq: Number of the event since the server started.
        id: The same for this event for ever.
        vehicle: The car it is about; null: none.
        acknowledged_by: Who took note of it; null: not acknowledged.
        acknowledged_ns: When [ns since 1970]; null: not yet.
        note: A comment.
    """

    seq: int
    id: Id
    severity: SeverityName
    source: SourceName
    t_ns: TNs
    name: Name
    text: Text
    vehicle: VehicleName | None
    acknowledged_by: Annotated[str, Meta(examples=["ada"])] | None
    acknowledged_ns: int | None
    note: Note


class Acknowledged(msgspec.Struct, kw_only=True, frozen=True):
    """What is acknowledged now.

    Attributes:
        acknowledgements: Of the events that were named, as they stand.
    """

    acknowledgements: tuple[Acknowledgement, ...]


class AcknowledgeBody(Body, kw_only=True, frozen=True):
    """Events that somebody took note of."""

    events: Annotated[
        tuple[Annotated[str, Meta(pattern="^[0-9a-f]{16}$")], ...],
        Meta(
            min_length=1,
            max_length=1000,
            description="ids of the events",
            examples=[["9f3a51c07be2d418"]],
        ),
    ]
    by: By = ""
    note: Annotated[
        str, Meta(max_length=500, description="a remark", examples=["tyre put back on"])
    ] = ""
