"""The Eye: its overhead cameras, their newest pictures, the tags in them, and cars' poses."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.eye_rows import camera_rows, frame_of, pose_rows, tags_of
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.roles import VIEWER
from scm.api.schemas import answer, answer_file, answer_page
from scm.eye.accuracy import stats_of, thinned
from scm.records.eye import (
    CameraRow,
    CameraState,
    Overhead,
    PoseRow,
    Residuals,
    TrackList,
    VehicleResiduals,
)
from scm.v2x.messages.eye_tags import EyeTags

LONGEST_WINDOW_S = 300.0
MOST_SAMPLES = 3_000
FIRST_LOOKS, LOOK_S = 5, 0.1

WindowS = Annotated[
    float,
    Query(gt=0.0, le=LONGEST_WINDOW_S, description="how far back [s]", examples=[120.0]),
]
Vehicle = Annotated[
    str,
    Query(pattern=r"^[a-z0-9_-]{0,32}$", description="one car; empty: all", examples=["n1"]),
]
Most = Annotated[
    int, Query(ge=0, le=MOST_SAMPLES, description="samples at most, evenly taken", examples=[500])
]


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/eye", tags=["eye"], dependencies=[VIEWER])
    _add_cameras(routes, city)
    _add_pictures(routes, city)
    _add_poses(routes, city)
    return routes


def _add_cameras(routes: APIRouter, city: City) -> None:
    floor = {city.city_map.tag.tag_id: city.city_map.tag}

    @routes.get("", summary="All cameras, with tags and poses seen", responses=answer(Overhead))
    def overhead() -> Response:
        return json_response(Overhead(cameras=camera_rows(city.view.picture(), floor)))

    @routes.get("/cameras", summary="The cameras, a page", responses=answer_page(CameraRow))
    def cameras(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        rows = camera_rows(city.view.picture(), floor)
        page = page_of(rows, lambda row: row.camera, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get("/cameras/{name}", summary="One camera", responses=answer(CameraState))
    def camera(name: Name) -> Response:
        rows = camera_rows(city.view.picture(), floor)
        row = next((row for row in rows if row.camera == name), None)
        if row is None:
            raise not_found("camera", name)
        mounted = next((one for one in city.city_map.cameras if one.name == name), None)
        return json_response(CameraState(state=row, mounted=mounted))


def _add_pictures(routes: APIRouter, city: City) -> None:
    @routes.get(
        "/cameras/{name}/frame.jpg",
        summary="A camera's newest picture",
        response_class=Response,
        responses=answer_file("image/jpeg", "The picture; `X-Time-Ns`: of its exposure."),
    )
    def frame(
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
    def tags(name: Name) -> Response:
        held = tags_of(city.view.picture(), name)
        if held is None:
            raise not_found("camera with tags", name)
        return json_response(held.message)


def _add_poses(routes: APIRouter, city: City) -> None:
    @routes.get(
        "/poses",
        summary="The newest pose of each car by each camera",
        responses=answer_page(PoseRow),
    )
    def poses(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        rows = pose_rows(city.view.picture())
        page = page_of(rows, lambda row: f"{row.camera}/{row.vehicle}", limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get(
        "/tracks",
        summary="Where each car is by all cameras together",
        responses=answer(TrackList),
    )
    async def tracks() -> Response:
        rows = city.view.tracks()
        for _ in range(FIRST_LOOKS):
            if rows:
                break
            await asyncio.sleep(LOOK_S)  # first request: they are received from now on
            rows = city.view.tracks()
        return json_response(TrackList(tracks=rows))

    @routes.get(
        "/cameras/{name}/residuals",
        summary="How far a camera's poses lay from the truth",
        responses=answer(Residuals),
    )
    def residuals(
        name: Name, window_s: WindowS = 120.0, vehicle: Vehicle = "", most: Most = 1000
    ) -> Response:
        picture = city.view.picture()
        if not any(name in known for known in (picture.frames, picture.tags, picture.eye_statuses)):
            raise not_found("camera", name)
        samples = city.view.residuals(name, window_s, vehicle)
        residuals = Residuals(
            camera=name,
            window_s=window_s,
            stats=stats_of(one for stored in samples.values() for one in stored),
            vehicles=tuple(
                VehicleResiduals(vehicle=car, stats=stats_of(stored))
                for car, stored in samples.items()
                if stored
            ),
            samples=thinned(samples, most) if most else (),
        )
        return json_response(residuals)
