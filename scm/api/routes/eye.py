"""The Eye: the overhead cameras, their newest pictures and the tags found in them."""

from fastapi import APIRouter, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.eye_rows import camera_rows, frame_of, tags_of
from scm.api.roles import VIEWER


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/eye", tags=["eye"], dependencies=[VIEWER])

    @routes.get("", summary="All cameras, with tags and poses seen")
    def cameras() -> Response:
        return json_response({"cameras": camera_rows(city.view.picture())})

    @routes.get(
        "/cameras/{name}/frame.jpg", summary="A camera's newest picture", response_class=Response
    )
    def frame(name: Name, t_ns: int | None = None) -> Response:
        held = frame_of(city.view.picture(), name, t_ns)
        if held is None:
            raise not_found("camera with a picture", name)
        headers = {"Cache-Control": "no-store", "X-Time-Ns": str(held.message.t_ns)}
        return Response(held.message.payload, headers=headers, media_type="image/jpeg")

    @routes.get("/cameras/{name}/tags", summary="The tags found in a camera's newest picture")
    def tags(name: Name) -> Response:
        held = tags_of(city.view.picture(), name)
        if held is None:
            raise not_found("camera with tags", name)
        return json_response(held.message)

    return routes
