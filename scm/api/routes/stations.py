"""Stations: every part, vehicle and client on the bus, with those lost in the last minute."""

from fastapi import APIRouter, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.paging import MOST
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.records.stations import StationEvents, StationRow, Stations

_LOOKED_THROUGH = 2000


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/stations", tags=["stations"], dependencies=[VIEWER])

    @routes.get("", summary="All stations", responses=answer(Stations))
    async def all_stations() -> Response:
        return json_response(Stations(stations=city.view.picture().stations))

    @routes.get("/{name}", summary="One station", responses=answer(Stations))
    async def one_station(name: Name) -> Response:
        return json_response(Stations(stations=_named(city, name)))

    @routes.get(
        "/{name}/events",
        summary="The last events that a station reported, or that are about it",
        responses=answer(StationEvents),
    )
    async def station_events(name: Name) -> Response:
        _named(city, name)
        events = city.view.events_after(0, _LOOKED_THROUGH)
        own = [one for one in reversed(events) if name in (one.source, one.vehicle)]
        return json_response(StationEvents(events=tuple(own[:MOST])))

    return routes


def _named(city: City, name: str) -> tuple[StationRow, ...]:
    found = tuple(row for row in city.view.picture().stations if row.name == name)
    if not found:
        raise not_found("station", name)
    return found
