"""Misbehaviour: what is held against each station that speaks, and reports with evidence."""

from fastapi import APIRouter, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.records.misbehaviour import Misbehaviour
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport

FRESH_S = 5.0


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/misbehaviour", tags=["misbehaviour"], dependencies=[VIEWER])

    @routes.get(
        "", summary="Scores of all stations, and who is reported", responses=answer(Misbehaviour)
    )
    async def scores() -> Response:
        held, reports = city.view.misbehaviour()
        is_fresh = held is not None and held.age_s(city.now_ns()) <= FRESH_S
        scores = held.message if held is not None and is_fresh else None
        body = Misbehaviour(
            watched=scores is not None,
            witness=scores is not None and scores.witness,
            t_ns=None if scores is None else scores.t_ns,
            stations=() if scores is None else scores.stations,
            reported=tuple(sorted(reports)),
        )
        return json_response(body)

    @routes.get(
        "/{name}",
        summary="The newest report on a station, with its evidence",
        responses=answer(MisbehaviourReport),
    )
    async def report(name: Name) -> Response:
        found = city.view.misbehaviour()[1].get(name)
        if found is None:
            raise not_found("report on a station", name)
        return json_response(found)

    return routes
