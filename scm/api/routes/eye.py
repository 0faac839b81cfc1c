"""The Eye: the overhead cameras, their newest pictures and the tags found in them."""

from typing import Annotated

import msgspec
from fastapi import APIRouter, Query, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.eye_rows import CameraRow, camera_rows, frame_of, tags_of
from scm.api.roles import VIEWER
from scm.api.schemas import answer, answer_file
from scm.v2x.messages.eye_tags import EyeTags


class Overhead(msgspec.Struct, kw_only=True, frozen=True):
    """The Eye's cameras, with what each sees."""

    cameras: tuple[CameraRow, ...]


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/eye", tags=["eye"], dependencies=[VIEWER])

    @routes.get("", summary="All cameras, with tags and poses seen", responses=answer(Overhead))
    async def cameras() -> Response:
        return json_response(Overhead(cameras=camera_rows(city.view.picture())))

    @routes.get(
        "/cameras/{name}/frame.jpg",
        summary="A camera's newest picture",
        response_class=Response,
        responses=answer_file("image/jpeg", "The picture; `X-Time-Ns`: of its exposure."),
    )
    async def frame(
        name: Name,
        t_ns: Annotated[
            int | None,
            Query(description="exposure of the picture; none: the newest", examples=[120]),
        ] = None,
    ) -> Response:
        held = frame_of(city.view.picture(), name, t_ns)
        if held is None:
            raise not_found("camera with a picture", name)
        headers = {"Cache-Control": "no-store", "X-Time-Ns": str(held.message.t_ns)}
        return Response(held.message.payload, headers=headers, media_type="image/jpeg")

    @routes.get(
        "/cameras/{name}/tags",
        summary="The tags found in a camera's newest picture",
        responses=answer(EyeTags),
    )
    async def tags(name: Name) -> Response:
        held = tags_of(city.view.picture(), name)
        if held is None:
            raise not_found("camera with tags", name)
        return json_response(held.message)

    return routes
