"""Vehicles: list, look at one, put one on the map, send it on a route, take it off."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, ConfigDict, Field

from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.roles import OPERATOR, VIEWER
from scm.api.schemas import answer
from scm.api.vehicle_rows import VehicleRow, VehiclesTopic, vehicles_topic
from scm.v2x.messages.light_request import LightReply, LightRequest
from scm.v2x.messages.remove_request import RemoveReply, RemoveRequest
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest

_NAME_OR_EMPTY = r"^[a-z0-9_-]{0,32}$"


class SpawnBody(BaseModel):
    """A hosted car to put on the map; everything may be left to the world."""

    model_config = ConfigDict(extra="forbid")

    vehicle: str = Field(
        "",
        pattern=_NAME_OR_EMPTY,
        description="its name; empty: the world names it",
        examples=["n9"],
    )
    car: str = Field(
        "nigel", pattern=_NAME_OR_EMPTY, description="name of its car file", examples=["nigel"]
    )
    spawn: str = Field(
        "",
        max_length=64,
        description="a spawn place, or X,Y,DEG (metres, degrees, map frame); empty: any free one",
        examples=["north_1", "1.384,0.655,315"],
    )


class RouteBody(BaseModel):
    """Where to go; `via` empty: circulate for ever."""

    model_config = ConfigDict(extra="forbid")

    via: list[str] = Field(
        default_factory=list,
        max_length=200,
        description="lanes to pass, in this order",
        examples=[["outer_north", "outer_west"]],
    )
    laps: int = Field(1, ge=1, le=10_000, description="how often to pass them", examples=[2])
    speed_mps: float | None = Field(
        None, gt=0.0, le=10.0, description="wished on free road; null: the limits", examples=[0.3]
    )
    then: Literal["stop", "circulate"] = Field(
        "stop", description="at the end of the last lane: stand, or drive on without end"
    )


class LightsBody(BaseModel):
    """How to switch headlights and indicators; what is left out stays as it is."""

    model_config = ConfigDict(extra="forbid")

    headlights: Literal["off", "low", "high"] | None = Field(
        None, description="null: as they are", examples=["low"]
    )
    indicators: Literal["off", "left", "right", "hazard"] | None = Field(
        None, description="null: as they are", examples=["left"]
    )


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
    def spawn(body: SpawnBody, key: IdempotencyKey = "") -> Response:
        request = SpawnRequest(request_id=key, vehicle=body.vehicle, car=body.car, spawn=body.spawn)
        reply = city.ask(request, SpawnReply)
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
        return json_response(city.ask(request, RemoveReply))

    _add_wishes(routes, city)
    return routes


def _add_wishes(routes: APIRouter, city: City) -> None:
    @routes.post(
        "/{name}/route",
        summary="Send a car on a route",
        dependencies=[OPERATOR],
        responses=answer(RouteReply),
    )
    def route(name: Name, body: RouteBody, key: IdempotencyKey = "") -> Response:
        request = RouteRequest(
            request_id=key,
            vehicle=name,
            via=tuple(body.via),
            laps=body.laps,
            speed_mps=body.speed_mps,
            then=body.then,
        )
        return json_response(city.ask(request, RouteReply))

    @routes.put(
        "/{name}/lights",
        summary="Switch a car's headlights and indicators",
        dependencies=[OPERATOR],
        responses=answer(LightReply),
    )
    def lights(name: Name, body: LightsBody, key: IdempotencyKey = "") -> Response:
        request = LightRequest(
            request_id=key, vehicle=name, headlights=body.headlights, indicators=body.indicators
        )
        return json_response(city.ask(request, LightReply))


def _find(city: City, name: str) -> VehicleRow:
    rows = vehicles_topic(city.view.picture()).vehicles
    found = next((row for row in rows if row.vehicle == name), None)
    if found is None:
        raise not_found("vehicle", name)
    return found
