"""Neighbouring cities: which are joined, since when, and what each shows the other."""

from fastapi import APIRouter, Response

from scm.api.city import City, json_response
from scm.api.picture import Held
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.clock import NS_PER_S, seconds
from scm.records.city_map import Neighbour
from scm.records.neighbours import NeighbourRow, Neighbours
from scm.v2x.messages.neighbour_status import NeighbourStatus

SILENT_NS = 5 * NS_PER_S  # a gateway reports once a second


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/neighbours", tags=["neighbours"], dependencies=[VIEWER])

    @routes.get("", summary="The neighbouring cities of the map", responses=answer(Neighbours))
    async def neighbours() -> Response:
        picture = city.view.picture()
        rows = tuple(
            _row(one, picture.neighbours.get(one.city), picture.now_ns)
            for one in city.city_map.neighbours
        )
        return json_response(Neighbours(neighbours=rows))

    return routes


def _row(neighbour: Neighbour, held: Held[NeighbourStatus] | None, now_ns: int) -> NeighbourRow:
    if held is None or now_ns - held.arrived_ns > SILENT_NS:
        return NeighbourRow(city=neighbour.city, state="unknown", shows=neighbour.messages)
    status = held.message
    return NeighbourRow(
        city=neighbour.city,
        state=status.state,
        since_ns=status.since_ns,
        shows=status.shows,
        sees=status.sees,
        reason=status.reason,
        age_s=round(seconds(now_ns - held.arrived_ns), 3),
    )
