"""Events: the log of the city, filtered, acknowledged, as a file."""

from collections.abc import Iterator
from typing import Annotated

import msgspec
from fastapi import APIRouter, Depends, Query, Request, Response

from scm.api.acknowledgements import Acknowledgements
from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.event_log import EventFilter
from scm.api.inputs import Json
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.roles import OPERATOR, VIEWER, Signer
from scm.api.schemas import answer, answer_file, answer_page
from scm.api.tables import Form, table_response
from scm.records.events import AcknowledgeBody, Acknowledged, Acknowledgement, EventRow, LoggedEvent


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
    bool, Query(alias="open", description="only those that are not acknowledged", examples=[True])
]


def router(city: City, acknowledgements: Acknowledgements) -> APIRouter:
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

        rows = _rows(city, acknowledgements, wanted)
        page = page_of(rows, lambda row: row.id, keep=keep, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get(
        ".{form}",
        summary="Events as a file",
        responses=answer_file("text/csv"),
        response_class=Response,
    )
    def export(form: Form, wanted: Wanted, *, only_open: Open = False) -> Response:
        rows = _rows(city, acknowledgements, wanted)
        rows = (row for row in rows if not only_open or _is_open(row))
        return table_response(rows, EventRow, form, f"{city.city_map.name}-events")

    @routes.post(
        "/acknowledgements",
        summary="Take note of events",
        responses=answer(Acknowledged),
        dependencies=[OPERATOR],
    )
    def acknowledge(
        body: Json[AcknowledgeBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        acknowledged = acknowledgements.add(body.events, signer(body.by), body.note)
        return json_response(Acknowledged(acknowledgements=acknowledged))

    @routes.delete(
        "/acknowledgements/{name}",
        name="take_back",
        summary="Take an acknowledgement back",
        responses=answer(Acknowledgement),
        dependencies=[OPERATOR],
    )
    def withdraw(name: Name, key: IdempotencyKey = "") -> Response:
        row = acknowledgements.withdraw(name)
        if row is None:
            raise not_found("acknowledgement", name)
        return json_response(row)

    return routes


def _rows(
    city: City, acknowledgements: Acknowledgements, wanted: EventFilter
) -> Iterator[EventRow]:
    known = acknowledgements.rows()
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
