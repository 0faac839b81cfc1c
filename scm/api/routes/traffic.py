"""Traffic as the observer sees it: counts of lanes and approaches, and violations."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from scm.api.city import City, json_response, not_found
from scm.api.roles import VIEWER


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/traffic", tags=["traffic"], dependencies=[VIEWER])

    @routes.get("", summary="Counts, delays, queues and level of service")
    def counts() -> Response:
        held = city.view.picture().traffic
        if held is None:
            raise not_found("station", "observer")
        return json_response(held.message)

    @routes.get("/violations", summary="Violations, newest first, with their evidence")
    def violations(
        vehicle: Annotated[str, Query(max_length=32, description="of this car alone")] = "",
        limit: Annotated[int, Query(ge=1, le=500)] = 100,
    ) -> Response:
        told = reversed(city.view.picture().violations)
        found = [one for one in told if vehicle in ("", one.vehicle)]
        return json_response({"violations": found[:limit]})

    return routes
