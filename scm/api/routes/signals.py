"""Signals: what each junction shows, wishes for another plan, and the monitor's reset."""

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.roles import ENGINEER, OPERATOR, VIEWER
from scm.api.signal_rows import junction_rows
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanReply, PlanRequest


class PlanBody(BaseModel):
    """A plan by name, or `flash`; the signal kernel decides when it is safe to begin."""

    model_config = ConfigDict(extra="forbid")

    plan: str = Field(min_length=1, max_length=64)
    by: str = Field("api", max_length=64)
    reason: str = Field("", max_length=500)


class ResetBody(BaseModel):
    """Who clears a fault, and why: both end up in the log."""

    model_config = ConfigDict(extra="forbid")

    by: str = Field("api", max_length=64)
    reason: str = Field(min_length=1, max_length=500)


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/signals", tags=["signals"], dependencies=[VIEWER])

    @routes.get("", summary="All junctions")
    def all_signals() -> Response:
        rows = junction_rows(city.view.picture(), city.city_map.junctions, city.plans)
        return json_response({"signals": rows})

    @routes.get("/{name}", summary="One junction")
    def one_signal(name: Name) -> Response:
        rows = junction_rows(city.view.picture(), city.city_map.junctions, city.plans)
        found = next((row for row in rows if row.junction == name), None)
        if found is None:
            raise not_found("junction", name)
        return json_response(found)

    @routes.put("/{name}/plan", summary="Wish for another plan", dependencies=[OPERATOR])
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
    )
    def reset(name: Name, body: ResetBody, key: IdempotencyKey = "") -> Response:
        _check(city, name)
        request = MonitorReset(request_id=key, junction=name, by=body.by, reason=body.reason)
        return json_response(city.ask(request, MonitorStatus))

    return routes


def _check(city: City, name: str) -> None:
    if all(junction.name != name for junction in city.city_map.junctions):
        raise not_found("junction", name)
