"""Stations: every part, vehicle and client on the bus, with those lost in the last minute."""

from fastapi import APIRouter, Response

from scm.api.city import City, json_response
from scm.api.roles import VIEWER


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/stations", tags=["stations"], dependencies=[VIEWER])

    @routes.get("", summary="All stations")
    def all_stations() -> Response:
        return json_response({"stations": city.view.picture().stations})

    return routes
