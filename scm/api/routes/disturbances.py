"""What makes measurements in the city void: now, and in the last hour."""

import msgspec
from fastapi import APIRouter, Response

from scm.api.city import City, json_response
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.clock import NS_PER_S
from scm.disturbances import Disturbance

SHOWN_NS = 3600 * NS_PER_S


class DisturbanceList(msgspec.Struct, kw_only=True, frozen=True):
    """What made measurements void in the last hour, the oldest first."""

    disturbances: tuple[Disturbance, ...]


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/disturbances", tags=["disturbances"], dependencies=[VIEWER])

    @routes.get(
        "",
        summary="What made measurements void in the last hour, and does so now",
        responses=answer(DisturbanceList),
    )
    async def disturbances() -> Response:
        picture = city.view.picture()
        lately = picture.disturbances.recent(picture.now_ns - SHOWN_NS)
        return json_response(DisturbanceList(disturbances=lately))

    return routes
