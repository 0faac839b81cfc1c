"""Operations: long work that was requested, its progress, and its cancellation."""

from fastapi import APIRouter, Request, Response

from scm.api.city import IdempotencyKey, Name, json_response, not_found
from scm.api.operations import Operations
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.roles import OPERATOR, VIEWER
from scm.api.schemas import answer, answer_page
from scm.records.operations import Operation


def router(operations: Operations) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/operations", tags=["operations"], dependencies=[VIEWER])

    @routes.get("", summary="Long work, newest first", responses=answer_page(Operation))
    async def all_operations(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        rows = operations.rows()
        return page_response(request, page_of(rows, lambda row: row.id, limit=limit, cursor=cursor))

    @routes.get("/{name}", summary="One piece of work", responses=answer(Operation))
    async def one_operation(name: Name) -> Response:
        row = operations.find(name)
        if row is None:
            raise not_found("operation", name)
        return json_response(row)

    @routes.delete(
        "/{name}",
        summary="Cancel long work",
        status_code=202,
        dependencies=[OPERATOR],
        responses=answer(Operation, 202, "It ends at its next word about itself; look again."),
    )
    def cancel(name: Name, key: IdempotencyKey = "") -> Response:
        del key  # called off is called off
        row = operations.cancel(name)
        if row is None:
            raise not_found("operation", name)
        return json_response(row, 202)

    return routes
