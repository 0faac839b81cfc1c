"""Events: the log of the city, paged by the number of the last event already read."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from scm.api.city import City, json_response
from scm.api.roles import VIEWER


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/events", tags=["events"], dependencies=[VIEWER])

    @routes.get("", summary="Events in order of arrival")
    def events(
        after: Annotated[int, Query(ge=0, description="number of the last event read")] = 0,
        limit: Annotated[int, Query(ge=1, le=500)] = 100,
    ) -> Response:
        found = city.view.events_after(after, limit + 1)
        page, more = found[:limit], len(found) > limit
        cursor = page[-1].seq if page else after
        link = {"Link": f'</api/v1/events?after={cursor}&limit={limit}>; rel="next"'}
        body = {"events": page, "next_after": cursor, "more": more}
        return json_response(body, headers=link if more else None)

    return routes
