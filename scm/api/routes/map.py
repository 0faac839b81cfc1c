"""The map: as data, and drawn."""

from functools import cache

import msgspec
from fastapi import APIRouter, Request, Response

from scm.api.city import City
from scm.api.etag import etag_of, has_tag
from scm.api.roles import VIEWER
from scm.api.schemas import answer, answer_file
from scm.maps.draw import draw_svg
from scm.records.city_map import CityMap


class SvgResponse(Response):
    """A drawing."""

    media_type = "image/svg+xml"


def router(city: City) -> APIRouter:
    """Return the routes; both forms are made once: a map does not change while the city runs."""
    routes = APIRouter(tags=["map"], dependencies=[VIEWER])
    as_json = msgspec.json.encode(city.city_map)

    @cache
    def as_svg() -> bytes:
        return draw_svg(city.city_map, movable=False).encode()  # the page draws what moves

    @routes.get("/map", summary="The map as JSON", responses=answer(CityMap))
    async def map_json(request: Request) -> Response:
        return _tagged(request, as_json, "application/json")

    @routes.get(
        "/map.svg",
        summary="The map drawn",
        response_class=SvgResponse,
        responses=answer_file("image/svg+xml", "The drawing, a metre a unit."),
    )
    def map_svg(request: Request) -> Response:
        return _tagged(request, as_svg(), "image/svg+xml")

    return routes


def _tagged(request: Request, body: bytes, media_type: str) -> Response:
    etag = etag_of(body)
    headers = {"ETag": etag, "Cache-Control": "no-cache"}
    if has_tag(request.headers.get("if-none-match", ""), etag):
        return Response(status_code=304, headers=headers)
    return Response(body, headers=headers, media_type=media_type)
