"""Misbehaviour: what is held against each station that speaks, and reports with evidence."""

from fastapi import APIRouter, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.roles import VIEWER


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/misbehaviour", tags=["misbehaviour"], dependencies=[VIEWER])

    @routes.get("", summary="Scores of all stations, and who is reported")
    def scores() -> Response:
        held, reports = city.view.misbehaviour()
        told = None if held is None else held.message
        body = {
            "watched": told is not None,
            "witness": told is not None and told.witness,
            "t_ns": None if told is None else told.t_ns,
            "stations": () if told is None else told.stations,
            "reported": sorted(reports),
        }
        return json_response(body)

    @routes.get("/{name}", summary="The newest report on a station, with its evidence")
    def report(name: Name) -> Response:
        found = city.view.misbehaviour()[1].get(name)
        if found is None:
            raise not_found("report on a station", name)
        return json_response(found)

    return routes
