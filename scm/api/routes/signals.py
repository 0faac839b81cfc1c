"""Signals: what each junction shows, wishes for another plan, and the monitor's reset."""

import msgspec
from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.roles import ENGINEER, OPERATOR, VIEWER
from scm.api.schemas import answer
from scm.api.signal_rows import JunctionRow, junction_rows
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanReply, PlanRequest


class Junctions(msgspec.Struct, kw_only=True, frozen=True):
    """All junctions of the map, in its order.

    Attributes:
        signals: One row a junction.
    """

    signals: tuple[JunctionRow, ...]


class PlanBody(BaseModel):
    """A plan by name, or `flash`; the signal kernel decides when it is safe to begin."""

    model_config = ConfigDict(extra="forbid")

    plan: str = Field(
        min_length=1, max_length=64, description="its name, or `flash`", examples=["calm"]
    )
    by: str = Field("api", max_length=64, description="who wishes it", examples=["ada"])
    reason: str = Field("", max_length=500, description="why, for the log", examples=["rush hour"])


class ResetBody(BaseModel):
    """Who clears a fault, and why: both end up in the log."""

    model_config = ConfigDict(extra="forbid")

    by: str = Field("api", max_length=64, description="who wishes it", examples=["ada"])
    reason: str = Field(
        min_length=1,
        max_length=500,
        description="why it is safe to go on, for the log",
        examples=["lamp replaced"],
    )


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/signals", tags=["signals"], dependencies=[VIEWER])

    @routes.get("", summary="All junctions", responses=answer(Junctions))
    async def all_signals() -> Response:
        rows = junction_rows(city.view.picture(), city.city_map.junctions, city.plans)
        return json_response(Junctions(signals=rows))

    @routes.get("/{name}", summary="One junction", responses=answer(JunctionRow))
    async def one_signal(name: Name) -> Response:
        rows = junction_rows(city.view.picture(), city.city_map.junctions, city.plans)
        found = next((row for row in rows if row.junction == name), None)
        if found is None:
            raise not_found("junction", name)
        return json_response(found)

    @routes.put(
        "/{name}/plan",
        summary="Wish for another plan",
        dependencies=[OPERATOR],
        responses=answer(PlanReply),
    )
    def plan(name: Name, body: PlanBody, key: IdempotencyKey = "") -> Response:
        _check(city, name)
        request = PlanRequest(
            request_id=key, junction=name, plan=body.plan, by=body.by, reason=body.reason
        )
        return json_response(city.ask(request, PlanReply))

    @routes.post(
        "/{name}/monitor/reset",
        summary="Clear a latched fault of the monitor",
        dependencies=[ENGINEER],
        responses=answer(MonitorStatus),
    )
    def reset(name: Name, body: ResetBody, key: IdempotencyKey = "") -> Response:
        _check(city, name)
        request = MonitorReset(request_id=key, junction=name, by=body.by, reason=body.reason)
        return json_response(city.ask(request, MonitorStatus))

    return routes


def _check(city: City, name: str) -> None:
    if all(junction.name != name for junction in city.city_map.junctions):
        raise not_found("junction", name)
