"""Twins: since when a car is not what its file says, what changed, and the file in force.

The twin part decides on versions; a person may put another one in force, and let a car be sent to
where it decides whose a change is.
"""

from typing import Annotated

from fastapi import APIRouter, Path, Request, Response

from scm.api.city import City, IdempotencyKey, json_response, not_found
from scm.api.inputs import Json
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.picture import Picture
from scm.api.problem import RefusedError
from scm.api.roles import OPERATOR, VIEWER, Signer
from scm.api.schemas import answer, answer_page
from scm.api.twin_rows import twin_of, twin_rows
from scm.records.twins import SendBody, Twin, TwinRow, VersionBody
from scm.v2x.messages.twin_send_request import TwinSendRequest
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.version_request import VersionRequest

PART, COMMAND = "twin", "`scm up --twin`"
Vehicle = Annotated[
    str, Path(pattern=r"^[a-z0-9_-]{1,32}$", description="a car's name", examples=["n1"])
]


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/twins", tags=["twins"], dependencies=[VIEWER])

    @routes.get("", summary="All watched cars in short", responses=answer_page(TwinRow))
    async def all_twins(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        rows = twin_rows(city.view.picture())
        page = page_of(rows, lambda row: row.vehicle, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get(
        "/{vehicle}",
        summary="One car: its changes, and the versions of its file",
        responses=answer(Twin),
    )
    async def one_twin(vehicle: Vehicle) -> Response:
        return json_response(twin_of(_status(city.view.picture(), vehicle)))

    @routes.put(
        "/{vehicle}/version",
        summary="Predict a car by another version of its file",
        dependencies=[OPERATOR],
        responses=answer(Twin),
    )
    def use_version(
        vehicle: Vehicle, body: Json[VersionBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        _status(city.view.picture(), vehicle)
        request = VersionRequest(
            request_id=key,
            vehicle=vehicle,
            version=body.version,
            by=signer(body.by),
            reason=body.reason,
        )
        return json_response(twin_of(city.call(request, TwinStatus)))

    @routes.post(
        "/{vehicle}/drive",
        summary="Send the car that would decide whose another car's change is",
        dependencies=[OPERATOR],
        responses=answer(Twin),
    )
    def send_car(
        vehicle: Vehicle, body: Json[SendBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        _status(city.view.picture(), vehicle)
        request = TwinSendRequest(
            request_id=key,
            vehicle=vehicle,
            send=body.send,
            by=signer(body.by),
            reason=body.reason,
        )
        return json_response(twin_of(city.call(request, TwinStatus)))

    return routes


def _status(picture: Picture, vehicle: str) -> TwinStatus:
    """Return the newest status of a car.

    Raises:
        RefusedError: when there is none: no such car, nobody who watches, or no look at it yet.
    """
    held = picture.twins.get(vehicle)
    if held is not None:
        return held.message
    cars = () if picture.snapshot is None else picture.snapshot.message.vehicles
    if vehicle not in {car.vehicle for car in cars}:
        raise not_found("car", vehicle)
    if not any(row.name == PART and row.role == "part" and row.alive for row in picture.stations):
        detail = f"nobody watches the cars of this city: expected the part {PART!r}, {COMMAND}"
        raise RefusedError.of("not_found", detail)
    detail = f"{vehicle} was not looked at yet: the first look needs ten seconds of its reports"
    raise RefusedError.of("not_found", detail)
