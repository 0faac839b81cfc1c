"""Stations: every part, vehicle and client on the bus, with those lost in the last minute."""

from fastapi import APIRouter, Response

from scm.api.city import City, json_response


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/stations", tags=["stations"])

    @routes.get("", summary="All stations")
    def all_stations() -> Response:
        return json_response({"stations": city.view.picture().stations})

    return routes
