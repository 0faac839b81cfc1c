"""What makes measurements in the city void: now, and in the last hour."""

from fastapi import APIRouter, Response

from scm.api.city import City, json_response
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.clock import NS_PER_S
from scm.records.disturbances import DisturbanceList

SHOWN_NS = 3600 * NS_PER_S


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
