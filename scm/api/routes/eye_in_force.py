"""Putting a saved calibration in force while the Eye runs, and reverting to the one before."""

from fastapi import APIRouter, Response

from scm.api.calibration_repository import CalibrationRepository
from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.inputs import Json
from scm.api.problem import RefusedError
from scm.api.roles import ENGINEER, Signer
from scm.api.schemas import answer
from scm.records.eye_calibrations import BackBody, InForceBody
from scm.v2x.messages.calibration_request import CalibrationReply, CalibrationRequest


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/eye/cameras", tags=["eye"], dependencies=[ENGINEER])
    folder = city.folders.calibrations

    @routes.put(
        "/{name}/calibration",
        summary="See by a calibration from the next frame on",
        responses=answer(CalibrationReply),
    )
    def use(
        name: Name, body: Json[InForceBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        _check_camera(city, name)
        if folder is None:
            raise not_found("calibration", body.calibration)
        place, lens = CalibrationRepository(folder).holds(body.calibration)
        if place is not None and place.name != name:
            got = f"calibration: {body.calibration!r} is the place of camera {place.name!r}"
            raise RefusedError.of("invalid", f"{got}, expected one of {name!r}")
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
        return json_response(city.call(request, CalibrationReply))

    @routes.post(
        "/{name}/calibration/back",
        summary="Put back what the camera saw by before",
        responses=answer(CalibrationReply),
    )
    def back(
        name: Name, body: Json[BackBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        _check_camera(city, name)
        request = CalibrationRequest(
            request_id=key, camera=name, verb="back", by=signer(body.by), reason=body.reason
        )
        return json_response(city.call(request, CalibrationReply))

    return routes


def _check_camera(city: City, name: str) -> None:
    if all(camera.name != name for camera in city.city_map.cameras):
        raise not_found("camera on the map", name)
