"""Cameras of cars: a still picture, or a film for as long as somebody watches."""

import asyncio
from collections.abc import AsyncIterator
from typing import Literal

from fastapi import APIRouter, Response
from fastapi.responses import StreamingResponse

from scm.api.city import City, Name, json_response, not_found
from scm.api.stream import Stream
from scm.v2x.messages.camera_frame import CameraFrame

LOOK_S = 0.02
PATIENCE_S = 3.0
BOUNDARY = "frame"

Camera = Literal["front", "rear"]


def router(city: City, stream: Stream) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/cars", tags=["cameras"])

    @routes.get("/{name}/camera/{camera}.jpg", summary="One picture", response_class=Response)
    async def still(name: Name, camera: Camera) -> Response:
        _check(city, name)
        with city.view.watching(name, camera):
            for _ in range(round(PATIENCE_S / LOOK_S)):
                held = city.view.camera_frame(name, camera)
                if held is not None:
                    time = {"Cache-Control": "no-store", "X-Time-Ns": str(held.message.t_ns)}
                    return Response(held.message.payload, headers=time, media_type="image/jpeg")
                await asyncio.sleep(LOOK_S)
        raise not_found("camera with a picture", f"{name}/{camera}")

    @routes.get("/{name}/camera/{camera}/film", summary="A film", response_class=Response)
    async def film(name: Name, camera: Camera) -> Response:
        _check(city, name)
        return StreamingResponse(
            _film(city, stream, name, camera),
            media_type=f"multipart/x-mixed-replace; boundary={BOUNDARY}",
            headers={"Cache-Control": "no-store"},
        )

    @routes.get("/{name}/camera", summary="Whether anybody watches a car's cameras here")
    def watched(name: Name) -> Response:
        return json_response({"watched": city.view.watched(name)})

    return routes


async def _film(city: City, stream: Stream, name: str, camera: Camera) -> AsyncIterator[bytes]:
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


def _check(city: City, name: str) -> None:
    snapshot = city.view.picture().snapshot
    cars = () if snapshot is None else snapshot.message.vehicles
    if all(car.vehicle != name for car in cars):
        raise not_found("car", name)
