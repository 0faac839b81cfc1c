"""Events: the log of the city, filtered, acknowledged, as a file."""

from collections.abc import Iterator
from typing import Annotated

import msgspec
from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from scm.api.acknowledgements import Acknowledgement, Acknowledgements
from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.event_log import EventFilter, LoggedEvent
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.roles import OPERATOR, VIEWER, Signer
from scm.api.schemas import answer, answer_file, answer_page
from scm.api.tables import Form, table_response


class EventRow(msgspec.Struct, kw_only=True, frozen=True):
    """An event, and who took note of it.

    Attributes:
        seq: Number of the event since the server started.
        id: The same for this event for ever.
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


class AcknowledgeBody(BaseModel):
    """Events that somebody took note of."""

    model_config = ConfigDict(extra="forbid")

    events: list[Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]] = Field(
        min_length=1,
        max_length=1000,
        description="ids of the events",
        examples=[["9f3a51c07be2d418"]],
    )
    by: str = Field("", max_length=64, description="who; empty: whoever calls", examples=["ada"])
    note: str = Field(
        "", max_length=500, description="what there is to say", examples=["tyre put back on"]
    )


class Acknowledged(msgspec.Struct, kw_only=True, frozen=True):
    """What is acknowledged now.

    Attributes:
        acknowledgements: Of the events that were named, as they stand.
    """

    acknowledgements: tuple[Acknowledgement, ...]


def _wanted(
    severity: Annotated[
        str, Query(max_length=64, description="one or more, comma between", examples=["error"])
    ] = "",
    source: Annotated[
        str, Query(max_length=200, description="stations, comma between", examples=["world"])
    ] = "",
    name: Annotated[
        str, Query(max_length=200, description="names, comma between", examples=["city_stop"])
    ] = "",
    vehicle: Annotated[str, Query(max_length=32, description="of a car", examples=["n1"])] = "",
    text: Annotated[
        str, Query(max_length=100, description="to be found in it", examples=["wall"])
    ] = "",
    since_ns: Annotated[
        int | None, Query(description="not before [ns since 1970]", examples=[0])
    ] = None,
    until_ns: Annotated[
        int | None, Query(description="not after [ns since 1970]", examples=[2**62])
    ] = None,
) -> EventFilter:
    return EventFilter(
        severity=severity,
        source=source,
        name=name,
        vehicle=vehicle,
        text=text,
        since_ns=since_ns,
        until_ns=until_ns,
    )


Wanted = Annotated[EventFilter, Depends(_wanted)]
Open = Annotated[
    bool, Query(alias="open", description="only those nobody took note of", examples=[True])
]


def router(city: City, seen: Acknowledgements) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/events", tags=["events"], dependencies=[VIEWER])

    @routes.get("", summary="Events, newest first", responses=answer_page(EventRow))
    def events(
        request: Request,
        wanted: Wanted,
        *,
        only_open: Open = False,
        after: Annotated[
            int, Query(ge=0, description="only those numbered above", examples=[40])
        ] = 0,
        limit: Limit = 100,
        cursor: Cursor = "",
    ) -> Response:
        def keep(row: EventRow) -> bool:
            return row.seq > after and (not only_open or _is_open(row))

        rows = _rows(city, seen, wanted)
        page = page_of(rows, lambda row: row.id, keep=keep, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get(
        ".{form}",
        summary="Events as a file",
        responses=answer_file("text/csv"),
        response_class=Response,
    )
    def export(form: Form, wanted: Wanted, *, only_open: Open = False) -> Response:
        rows = (row for row in _rows(city, seen, wanted) if not only_open or _is_open(row))
        return table_response(rows, EventRow, form, f"{city.city_map.name}-events")

    @routes.post(
        "/acknowledgements",
        summary="Take note of events",
        responses=answer(Acknowledged),
        dependencies=[OPERATOR],
    )
    def acknowledge(body: AcknowledgeBody, signer: Signer, key: IdempotencyKey = "") -> Response:
        acknowledged = seen.add(body.events, signer(body.by), body.note)
        return json_response(Acknowledged(acknowledgements=acknowledged))

    @routes.delete(
        "/acknowledgements/{name}",
        summary="Take an acknowledgement back",
        responses=answer(Acknowledgement),
        dependencies=[OPERATOR],
    )
    def take_back(name: Name, key: IdempotencyKey = "") -> Response:
        row = seen.take_back(name)
        if row is None:
            raise not_found("acknowledgement", name)
        return json_response(row)

    return routes


def _rows(city: City, seen: Acknowledgements, wanted: EventFilter) -> Iterator[EventRow]:
    known = seen.rows()
    for event in city.view.events():
        if wanted.passes(event):
            yield _row(event, known.get(event.id))


def _is_open(row: EventRow) -> bool:
    return row.acknowledged_ns is None


def _row(event: LoggedEvent, own: Acknowledgement | None) -> EventRow:
    return EventRow(
        **msgspec.structs.asdict(event),
        acknowledged_by=own.by if own else None,
        acknowledged_ns=own.at_ns if own else None,
        note=own.note if own else "",
    )
