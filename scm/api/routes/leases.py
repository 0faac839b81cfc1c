"""Leases: who drives which car; take one, keep it, give it back. Commands go by the bus."""

from collections.abc import Iterator

from fastapi import APIRouter, Query, Request, Response

from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.inputs import Json
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.roles import OPERATOR, VIEWER
from scm.api.schemas import answer, answer_page
from scm.records.leases import AcquireBody, LeaseRow, RenewBody
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/leases", tags=["leases"], dependencies=[VIEWER])

    @routes.get("", summary="Who drives which car", responses=answer_page(LeaseRow))
    def all_leases(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        rows = sorted(_rows(city), key=lambda row: row.vehicle)
        page = page_of(rows, lambda row: row.vehicle, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get("/{name}", summary="Who drives a car", responses=answer(LeaseRow))
    def one_lease(name: Name) -> Response:
        row = next((row for row in _rows(city) if row.vehicle == name), None)
        if row is None:
            raise not_found("vehicle", name)
        return json_response(row)

    _add_taking(routes, city)
    _add_returning(routes, city)
    return routes


def _add_taking(routes: APIRouter, city: City) -> None:
    @routes.post(
        "/{name}",
        name="take",
        summary="Take a car",
        status_code=201,
        dependencies=[OPERATOR],
        responses=answer(LeaseReply, 201),
    )
    def acquire(
        request: Request, name: Name, body: Json[AcquireBody], key: IdempotencyKey = ""
    ) -> Response:
        lease = LeaseRequest(
            request_id=key,
            vehicle=name,
            owner=_owner(request, body.program),
            verb="steal" if body.reason.strip() else "acquire",
            ttl_ms=body.ttl_ms,
            reason=body.reason,
        )
        return json_response(city.call(lease, LeaseReply), 201)

    @routes.put(
        "/{name}",
        summary="Keep one's car",
        dependencies=[OPERATOR],
        responses=answer(LeaseReply),
    )
    def renew(
        request: Request, name: Name, body: Json[RenewBody], key: IdempotencyKey = ""
    ) -> Response:
        lease = LeaseRequest(
            request_id=key,
            vehicle=name,
            owner=_owner(request, body.program),
            verb="renew",
            epoch=body.epoch,
            ttl_ms=body.ttl_ms,
        )
        return json_response(city.call(lease, LeaseReply))


def _add_returning(routes: APIRouter, city: City) -> None:
    @routes.delete(
        "/{name}",
        summary="Give one's car back",
        dependencies=[OPERATOR],
        responses=answer(LeaseReply),
    )
    def give_back(
        request: Request,
        name: Name,
        epoch: int = Query(ge=0, description="as the lease was given", examples=[12]),
        program: str = Query(
            "",
            pattern=r"^[a-z0-9_-]{0,32}$",
            description="as when it was taken",
            examples=["lane_keeper"],
        ),
        key: IdempotencyKey = "",
    ) -> Response:
        lease = LeaseRequest(
            request_id=key,
            vehicle=name,
            owner=_owner(request, program),
            verb="release",
            epoch=epoch,
        )
        return json_response(city.call(lease, LeaseReply))


def _owner(request: Request, program: str) -> str:
    """Return the lease's owner: nobody can hold one in another caller's name."""
    owner = str(request.scope["scm_owner"])
    return f"{owner}/{program}" if program else owner


def _rows(city: City) -> Iterator[LeaseRow]:
    snapshot = city.view.snapshot
    for car in () if snapshot is None else snapshot.message.vehicles:
        left_ms = None if car.lease_left_ms is None else round(car.lease_left_ms)
        yield LeaseRow(vehicle=car.vehicle, owner=car.owner, epoch=car.epoch, left_ms=left_ms)
