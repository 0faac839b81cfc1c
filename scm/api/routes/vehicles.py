"""Vehicles: list, look at one, put one on the map, send it on a route, take it off."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.inputs import Json
from scm.api.roles import OPERATOR, VIEWER
from scm.api.schemas import answer
from scm.api.vehicle_rows import vehicles_topic
from scm.records.vehicles import LightsBody, RouteBody, SpawnBody, VehicleRow, VehiclesTopic
from scm.v2x.messages.light_request import LightReply, LightRequest
from scm.v2x.messages.remove_request import RemoveReply, RemoveRequest
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/vehicles", tags=["vehicles"], dependencies=[VIEWER])

    @routes.get("", summary="All cars on the map", responses=answer(VehiclesTopic))
    async def all_vehicles() -> Response:
        return json_response(vehicles_topic(city.view.picture()))

    @routes.post(
        "",
        summary="Spawn a hosted car",
        status_code=201,
        dependencies=[OPERATOR],
        responses=answer(SpawnReply, 201, "It stands there."),
    )
    def spawn(body: Json[SpawnBody], key: IdempotencyKey = "") -> Response:
        request = SpawnRequest(request_id=key, vehicle=body.vehicle, car=body.car, spawn=body.spawn)
        reply = city.call(request, SpawnReply)
        return json_response(reply, 201, {"Location": f"/api/v1/vehicles/{reply.vehicle}"})

    @routes.get("/{name}", summary="One car", responses=answer(VehicleRow))
    async def one_car(name: Name) -> Response:
        return json_response(_find(city, name))

    @routes.delete(
        "/{name}",
        summary="Take a car off the map",
        dependencies=[OPERATOR],
        responses=answer(RemoveReply),
    )
    def remove(
        name: Name,
        reason: Annotated[
            str, Query(max_length=500, description="why, for the log", examples=["battery empty"])
        ] = "",
        key: IdempotencyKey = "",
    ) -> Response:
        request = RemoveRequest(request_id=key, vehicle=name, reason=reason)
        return json_response(city.call(request, RemoveReply))

    _add_commands(routes, city)
    return routes


def _add_commands(routes: APIRouter, city: City) -> None:
    @routes.post(
        "/{name}/route",
        summary="Send a car on a route",
        dependencies=[OPERATOR],
        responses=answer(RouteReply),
    )
    def route(name: Name, body: Json[RouteBody], key: IdempotencyKey = "") -> Response:
        request = RouteRequest(
            request_id=key,
            vehicle=name,
            via=tuple(body.via),
            laps=body.laps,
            speed_mps=body.speed_mps,
            then=body.then,
        )
        return json_response(city.call(request, RouteReply))

    @routes.put(
        "/{name}/lights",
        summary="Switch a car's headlights and indicators",
        dependencies=[OPERATOR],
        responses=answer(LightReply),
    )
    def lights(name: Name, body: Json[LightsBody], key: IdempotencyKey = "") -> Response:
        request = LightRequest(
            request_id=key, vehicle=name, headlights=body.headlights, indicators=body.indicators
        )
        return json_response(city.call(request, LightReply))


def _find(city: City, name: str) -> VehicleRow:
    rows = vehicles_topic(city.view.picture()).vehicles
    found = next((row for row in rows if row.vehicle == name), None)
    if found is None:
        raise not_found("vehicle", name)
    return found
