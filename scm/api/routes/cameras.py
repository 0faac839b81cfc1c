"""Cameras of cars: a still picture, or a film for as long as somebody watches."""

import asyncio
from collections.abc import AsyncIterator

from fastapi import APIRouter, Response
from fastapi.responses import StreamingResponse

from scm.api.city import City, Name, json_response, not_found
from scm.api.problem import RefusedError
from scm.api.roles import VIEWER
from scm.api.schemas import answer, answer_file
from scm.api.stream import Stream
from scm.camera.optics import fitted
from scm.records.cameras import Cameras
from scm.v2x.messages.camera_frame import CameraFrame

LOOK_S = 0.02
PATIENCE_S = 15.0  # the first picture also paints the floor: seconds on a busy computer
BOUNDARY = "frame"


def router(city: City, stream: Stream) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/vehicles", tags=["cameras"], dependencies=[VIEWER])

    @routes.get(
        "/{name}/camera/{camera}.jpg",
        summary="One picture",
        response_class=Response,
        responses=answer_file("image/jpeg", "The newest picture; `X-Time-Ns`: of its exposure."),
    )
    async def still(name: Name, camera: Name) -> Response:
        _check(city, name, camera)
        with city.view.watching(name, camera):
            for _ in range(round(PATIENCE_S / LOOK_S)):
                held = city.view.camera_frame(name, camera)
                if held is not None:
                    time = {"Cache-Control": "no-store", "X-Time-Ns": str(held.message.t_ns)}
                    return Response(held.message.payload, headers=time, media_type="image/jpeg")
                await asyncio.sleep(LOOK_S)
        raise not_found("camera with a picture", f"{name}/{camera}")

    @routes.get(
        "/{name}/camera/{camera}/film",
        summary="A film",
        response_class=Response,
        responses=answer_file(
            "multipart/x-mixed-replace", "JPEG pictures for as long as you read."
        ),
    )
    async def film(name: Name, camera: Name) -> Response:
        _check(city, name, camera)
        return StreamingResponse(
            _film(city, stream, name, camera),
            media_type=f"multipart/x-mixed-replace; boundary={BOUNDARY}",
            headers={"Cache-Control": "no-store"},
        )

    @routes.get(
        "/{name}/camera",
        summary="A car's cameras, and which are watched here",
        responses=answer(Cameras),
    )
    async def cameras(name: Name) -> Response:
        return json_response(Cameras(cameras=_cameras(city, name), watched=city.view.watched(name)))

    return routes


async def _film(city: City, stream: Stream, name: str, camera: str) -> AsyncIterator[bytes]:
    """Yield every new picture until the page goes away or the server ends."""
    shown_ns = None
    with city.view.watching(name, camera):
        while not stream.is_closed:
            held = city.view.camera_frame(name, camera)
            if held is not None and held.message.t_ns != shown_ns:
                shown_ns = held.message.t_ns
                yield _part(held.message)
            await asyncio.sleep(LOOK_S)


def _part(frame: CameraFrame) -> bytes:
    head = f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(frame.payload)}\r\n"
    return head.encode() + f"X-Time-Ns: {frame.t_ns}\r\n\r\n".encode() + frame.payload + b"\r\n"


def _cameras(city: City, name: str) -> tuple[str, ...]:
    """Return the cameras that a car's file gives it."""
    snapshot = city.view.picture().snapshot
    cars = () if snapshot is None else snapshot.message.vehicles
    car = next((car for car in cars if car.vehicle == name), None)
    if car is None:
        raise not_found("car", name)
    return tuple(fitted(car.car))


def _check(city: City, name: str, camera: str) -> None:
    cameras = _cameras(city, name)
    if camera not in cameras:
        has = f"cameras {' and '.join(cameras)}" if cameras else "no cameras"
        raise RefusedError.of("not_found", f"there is no camera named {camera!r}: {name} has {has}")
