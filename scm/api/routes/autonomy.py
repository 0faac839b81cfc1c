"""Cars that park themselves or map rooms: send one to a goal, see what it does, plans and knows."""

import asyncio

from fastapi import APIRouter, Response

from scm.api.city import City, IdempotencyKey, Name, json_response
from scm.api.inputs import Json
from scm.api.picture import M, Picture
from scm.api.problem import RefusedError
from scm.api.roles import OPERATOR, VIEWER
from scm.api.room_maps import room_maps_of
from scm.api.schemas import answer
from scm.records.room_maps import RoomMapRow
from scm.records.vehicles import ParkBody
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.park_request import ParkReply, ParkRequest

SHOWN_S = 5.0  # after the newest report; agents report 5 times a second
LOOK_S, PATIENCE_S = 0.05, 3.0  # for a costmap: agents send one a second, once they have a goal


def autonomy_of(picture: Picture) -> tuple[AutonomyStatus, ...]:
    """Return what each car with an agent that parks it is doing, by name."""
    held = (picture.autonomy[name] for name in sorted(picture.autonomy))
    return tuple(one.message for one in held if one.age_s(picture.now_ns) <= SHOWN_S)


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/vehicles", tags=["vehicles"], dependencies=[VIEWER])

    @routes.post(
        "/{name}/goal",
        summary="Send a car that parks itself to a goal",
        dependencies=[OPERATOR],
        responses=answer(ParkReply),
    )
    def park(name: Name, body: Json[ParkBody], key: IdempotencyKey = "") -> Response:
        request = ParkRequest(request_id=key, vehicle=name, goal=body.goal)
        try:
            return json_response(city.call(request, ParkReply))
        except RefusedError as cause:
            if cause.refused.code != "offline":
                raise
            detail = f"{cause.refused.detail}: {_expected(name)}"
            raise RefusedError.of("not_found", detail) from cause

    @routes.get(
        "/{name}/goal",
        summary="A parking car's goal, what it does, and where it thinks that it is",
        responses=answer(AutonomyStatus),
    )
    async def autonomy(name: Name) -> Response:
        rows = autonomy_of(city.view.picture())
        found = next((row for row in rows if row.vehicle == name), None)
        return json_response(_reported(found, name))

    @routes.get(
        "/{name}/plan",
        summary="A parking car's path, candidates, particles, and obstacles that the map has not",
        responses=answer(AutonomyPlan),
    )
    async def plan(name: Name) -> Response:
        held = city.view.picture().autonomy_plans.get(name)
        return json_response(_reported(None if held is None else held.message, name))

    _add_maps(routes, city)
    return routes


def _add_maps(routes: APIRouter, city: City) -> None:
    @routes.get(
        "/{name}/costmap",
        summary="How far each place is from the nearest obstacle, as a parking car's planners see",
        responses=answer(Costmap),
    )
    async def costmap(name: Name) -> Response:
        for _ in range(round(PATIENCE_S / LOOK_S)):
            found = city.view.costmap(name)
            if found is not None:
                return json_response(found)
            await asyncio.sleep(LOOK_S)
        return json_response(_reported(found, name))

    @routes.get(
        "/{name}/map",
        summary="The map that a car makes of an unknown room",
        responses=answer(RoomMapRow),
    )
    async def room_map(name: Name) -> Response:
        rows = room_maps_of(city.view.picture())
        found = next((row for row in rows if row.vehicle == name), None)
        if found is None:
            command = f"`vehicle-agent map --vehicle {name}`"
            detail = f"no agent that maps with {name} has reported: expected {command} to run"
            raise RefusedError.of("not_found", detail)
        return json_response(found)


def _reported(report: M | None, name: str) -> M:
    """Return what a car's agent has reported.

    Raises:
        RefusedError: when that is nothing.
    """
    if report is None:
        detail = f"no agent that parks {name} has reported: {_expected(name)}"
        raise RefusedError.of("not_found", detail)
    return report


def _expected(name: str) -> str:
    return f"expected `vehicle-agent park --vehicle {name}` to run"
