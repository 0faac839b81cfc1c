"""Events: the log of the city, paged by the number of the last event already read."""

from typing import Annotated

import msgspec
from fastapi import APIRouter, Query, Response

from scm.api.city import City, json_response
from scm.api.event_log import LoggedEvent
from scm.api.roles import VIEWER
from scm.api.schemas import answer


class Events(msgspec.Struct, kw_only=True, frozen=True):
    """Some events of the log.

    Attributes:
        next_after: Number of the last of these: ask on with it as `after`.
        more: Whether there are others after them already.
    """

    events: tuple[LoggedEvent, ...]
    next_after: int
    more: bool


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/events", tags=["events"], dependencies=[VIEWER])

    @routes.get("", summary="Events in order of arrival", responses=answer(Events))
    async def events(
        after: Annotated[
            int, Query(ge=0, description="number of the last event read", examples=[40])
        ] = 0,
        limit: Annotated[
            int, Query(ge=1, le=500, description="events a page", examples=[100])
        ] = 100,
    ) -> Response:
        found = city.view.events_after(after, limit + 1)
        page, more = found[:limit], len(found) > limit
        cursor = page[-1].seq if page else after
        link = {"Link": f'</api/v1/events?after={cursor}&limit={limit}>; rel="next"'}
        body = Events(events=page, next_after=cursor, more=more)
        return json_response(body, headers=link if more else None)

    return routes
