"""Traffic as the observer sees it: counts of lanes and approaches, and violations."""

from typing import Annotated

import msgspec
from fastapi import APIRouter, Query, Response

from scm.api.city import City, json_response, not_found
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.clock import nanoseconds
from scm.records.traffic import Counts, Violations


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/traffic", tags=["traffic"], dependencies=[VIEWER])

    @routes.get("", summary="Counts, delays, queues and level of service", responses=answer(Counts))
    async def counts() -> Response:
        picture = city.view.picture()
        if picture.traffic is None:
            raise not_found("station", "observer")
        counted = picture.traffic.message
        begin_ns = counted.t_ns - nanoseconds(counted.window_s)
        void = picture.disturbances.void_reasons(begin_ns, counted.t_ns)
        return json_response(Counts(**msgspec.structs.asdict(counted), void=void))

    @routes.get(
        "/violations",
        summary="Violations, newest first, with their evidence",
        responses=answer(Violations),
    )
    async def violations(
        vehicle: Annotated[
            str, Query(max_length=32, description="of this car alone", examples=["n1"])
        ] = "",
        limit: Annotated[
            int, Query(ge=1, le=500, description="how many at most", examples=[100])
        ] = 100,
    ) -> Response:
        newest_first = reversed(city.view.picture().violations)
        found = [one for one in newest_first if vehicle in ("", one.vehicle)]
        return json_response(Violations(violations=tuple(found[:limit])))

    return routes
