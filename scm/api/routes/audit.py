"""Audit: who changed what, in a chain of entries that shows when one was tampered with."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response

from scm.api.audit_trail import AuditFilter, newest_first
from scm.api.city import json_response
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.problem import RefusedError
from scm.api.roles import ENGINEER
from scm.api.schemas import answer, answer_file, answer_page
from scm.api.tables import Form, table_response
from scm.errors import StoreError
from scm.records.audit import AuditRow, ChainVerdict
from scm.store.audit import AuditLog, Head
from scm.store.repository import Repository


def _wanted(
    station: Annotated[
        str, Query(max_length=32, description="who did it", examples=["world"])
    ] = "",
    by: Annotated[str, Query(max_length=64, description="who requested it", examples=["ada"])] = "",
    kind: Annotated[
        str,
        Query(max_length=100, description="part of class or path", examples=["StopRequest"]),
    ] = "",
    text: Annotated[
        str, Query(max_length=100, description="to be found in it", examples=["n1"])
    ] = "",
) -> AuditFilter:
    return AuditFilter(station=station, by=by, kind=kind, text=text)


Wanted = Annotated[AuditFilter, Depends(_wanted)]


def router(store: Repository) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/audit", tags=["audit"], dependencies=[ENGINEER])

    @routes.get("", summary="Entries, newest first", responses=answer_page(AuditRow))
    def deeds(
        request: Request, wanted: Wanted, limit: Limit = 100, cursor: Cursor = ""
    ) -> Response:
        rows = (row for row in newest_first(store, request.app.state.words) if wanted.passes(row))
        return page_response(
            request, page_of(rows, lambda row: str(row.number), limit=limit, cursor=cursor)
        )

    @routes.get(
        ".{form}",
        summary="Entries as a file",
        responses=answer_file("text/csv"),
        response_class=Response,
    )
    def export(request: Request, form: Form, wanted: Wanted) -> Response:
        rows = (row for row in newest_first(store, request.app.state.words) if wanted.passes(row))
        return table_response(rows, AuditRow, form, "audit")

    @routes.get("/verdict", summary="Check the whole chain", responses=answer(ChainVerdict))
    def verdict(
        number: Annotated[
            int, Query(ge=0, description="of an entry noted before; 0: none", examples=[0])
        ] = 0,
        digest: Annotated[
            str,
            Query(pattern="^([0-9a-f]{64})?$", description="its hash, noted before", examples=[""]),
        ] = "",
    ) -> Response:
        if bool(number) != bool(digest):
            detail = "number, digest: got one of them, expected both of an entry noted before"
            raise RefusedError.of("invalid", detail)
        noted = Head(number, digest) if number else None
        log = AuditLog(store)
        try:
            head = log.verify(noted)
        except StoreError as broken:
            last = log.head()
            return json_response(
                ChainVerdict(
                    whole=False, entries=last.number, digest=last.digest, error=str(broken)
                )
            )
        return json_response(
            ChainVerdict(whole=True, entries=head.number, digest=head.digest, error="")
        )

    return routes
