"""Leases: who drives which car; take one, keep it, give it back. Commands go by the bus."""

from collections.abc import Iterator

import msgspec
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.roles import OPERATOR, VIEWER
from scm.api.schemas import answer, answer_page
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest

_TTL_MS = Field(
    1000, ge=100, le=60_000, description="how long it lives unless renewed [ms]", examples=[1000]
)
_PROGRAM = r"^[a-z0-9_-]{0,32}$"


class TakeBody(BaseModel):
    """A car to drive."""

    model_config = ConfigDict(extra="forbid")

    program: str = Field(
        "",
        pattern=_PROGRAM,
        description="tells programs of one caller apart: each holds its own leases",
        examples=["lane_keeper"],
    )
    ttl_ms: int = _TTL_MS
    reason: str = Field(
        "",
        max_length=500,
        description="why it is taken from whoever holds it; empty: only if it is free",
        examples=["n1 blocks the crossing"],
    )


class RenewBody(BaseModel):
    """A lease to keep."""

    model_config = ConfigDict(extra="forbid")

    program: str = Field(
        "", pattern=_PROGRAM, description="as when it was taken", examples=["lane_keeper"]
    )
    epoch: int = Field(ge=0, description="as the lease was given", examples=[12])
    ttl_ms: int = _TTL_MS


class LeaseRow(msgspec.Struct, kw_only=True, frozen=True):
    """Who drives a car.

    Attributes:
        owner: `world` or the car's own name while nobody else does.
        epoch: Grows with each change of owner; commands carry it.
        left_ms: Until it ends if it is not renewed; None: it is at home, and never ends.
    """

    vehicle: str
    owner: str
    epoch: int
    left_ms: float | None


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

    @routes.post(
        "/{name}",
        summary="Take a car",
        status_code=201,
        dependencies=[OPERATOR],
        responses=answer(LeaseReply, 201),
    )
    def take(request: Request, name: Name, body: TakeBody, key: IdempotencyKey = "") -> Response:
        asked = LeaseRequest(
            request_id=key,
            vehicle=name,
            owner=_owner(request, body.program),
            verb="steal" if body.reason.strip() else "acquire",
            ttl_ms=body.ttl_ms,
            reason=body.reason,
        )
        return json_response(city.ask(asked, LeaseReply), 201)

    @routes.put(
        "/{name}",
        summary="Keep one's car",
        dependencies=[OPERATOR],
        responses=answer(LeaseReply),
    )
    def renew(request: Request, name: Name, body: RenewBody, key: IdempotencyKey = "") -> Response:
        asked = LeaseRequest(
            request_id=key,
            vehicle=name,
            owner=_owner(request, body.program),
            verb="renew",
            epoch=body.epoch,
            ttl_ms=body.ttl_ms,
        )
        return json_response(city.ask(asked, LeaseReply))

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
            "", pattern=_PROGRAM, description="as when it was taken", examples=["lane_keeper"]
        ),
        key: IdempotencyKey = "",
    ) -> Response:
        asked = LeaseRequest(
            request_id=key,
            vehicle=name,
            owner=_owner(request, program),
            verb="release",
            epoch=epoch,
        )
        return json_response(city.ask(asked, LeaseReply))

    return routes


def _owner(request: Request, program: str) -> str:
    """Return the lease's owner: nobody can hold one in another caller's name."""
    owner = str(request.scope["scm_owner"])
    return f"{owner}/{program}" if program else owner


def _rows(city: City) -> Iterator[LeaseRow]:
    snapshot = city.view.snapshot
    for car in () if snapshot is None else snapshot.message.vehicles:
        left_ms = None if car.lease_left_ms is None else round(car.lease_left_ms)
        yield LeaseRow(vehicle=car.vehicle, owner=car.owner, epoch=car.epoch, left_ms=left_ms)
