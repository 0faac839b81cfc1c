"""Putting a kept calibration in force while the Eye runs, and putting back what was before."""

from typing import Annotated

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from scm.api.calibration_shelf import CalibrationShelf
from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.problem import RefusedError
from scm.api.roles import ENGINEER, Signer
from scm.api.schemas import answer
from scm.v2x.message import Refused
from scm.v2x.messages.calibration_request import CalibrationReply, CalibrationRequest

By = Annotated[
    str,
    Field(max_length=64, description="who asks; empty: whoever calls", examples=["ada"]),
]


class BackBody(BaseModel):
    """Who wants what was in force before, and why: both end up in the log."""

    model_config = ConfigDict(extra="forbid")

    by: By = ""
    reason: str = Field(
        min_length=1, max_length=200, description="why", examples=["the camera was moved"]
    )


class InForceBody(BackBody):
    """Which calibration is to be in force, who wants it, and why."""

    calibration: str = Field(
        pattern=r"^[a-z0-9_-]{1,48}$",
        description="a calibration on the shelf",
        examples=["overhead-place"],
    )
    accept_unsure: bool = Field(
        default=False,
        description="whether it is meant although the Eye would flag its poses as unsure and "
        "guarded cars would stop; without it such a calibration is a 409 of code `unsure`",
        examples=[False],
    )


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/eye/cameras", tags=["eye"], dependencies=[ENGINEER])
    folder = city.shelves.calibrations

    @routes.put(
        "/{name}/calibration",
        summary="See by a calibration from the next frame on",
        responses=answer(CalibrationReply),
    )
    def use(name: Name, body: InForceBody, signer: Signer, key: IdempotencyKey = "") -> Response:
        _check_camera(city, name)
        if folder is None:
            raise not_found("calibration", body.calibration)
        place, lens = CalibrationShelf(folder).holds(body.calibration)
        if place is not None and place.name != name:
            got = f"calibration: {body.calibration!r} is the place of camera {place.name!r}"
            detail = f"{got}, expected one of {name!r}"
            raise RefusedError(Refused(code="invalid", detail=detail))
        request = CalibrationRequest(
            request_id=key,
            camera=name,
            calibration=body.calibration,
            place=place,
            lens=lens,
            by=signer(body.by),
            reason=body.reason,
            accept_unsure=body.accept_unsure,
        )
        return json_response(city.ask(request, CalibrationReply))

    @routes.post(
        "/{name}/calibration/back",
        summary="Put back what the camera saw by before",
        responses=answer(CalibrationReply),
    )
    def back(name: Name, body: BackBody, signer: Signer, key: IdempotencyKey = "") -> Response:
        _check_camera(city, name)
        request = CalibrationRequest(
            request_id=key, camera=name, verb="back", by=signer(body.by), reason=body.reason
        )
        return json_response(city.ask(request, CalibrationReply))

    return routes


def _check_camera(city: City, name: str) -> None:
    if all(camera.name != name for camera in city.city_map.cameras):
        raise not_found("camera on the map", name)
