"""Signals: what each junction shows, what runs, who wants what of it, and the monitor's reset.

No request sets a colour. An override is accepted or refused, has a name, reason and end; the signal
kernel decides when it is safe.
"""

import msgspec
from fastapi import APIRouter, Request, Response

from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.etag import tagged
from scm.api.inputs import Json
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.problem import RefusedError
from scm.api.roles import ENGINEER, OPERATOR, VIEWER, Signer
from scm.api.schemas import answer, answer_page
from scm.api.signal_plans import PlanRepository
from scm.api.signal_rows import junction_rows, status_row
from scm.records.city_map import Junction
from scm.records.signal_history import ForecastScore, History, Verdict
from scm.records.signals import (
    LONGEST_S,
    ClearBody,
    FlashBody,
    FlashReply,
    JunctionRow,
    OverrideBody,
    PlanChoiceBody,
    PolicyBody,
    ResetBody,
    SignalOverride,
    Signals,
    StatusRow,
    Verb,
)
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.signal_request import SignalReply, SignalRequest
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.plan_file import fits

_VERBS: dict[str, tuple[Verb, str]] = {
    "calls": ("call", "Call groups: each is served once"),
    "holds": ("hold", "Hold groups: once green, they stay green"),
    "force-offs": ("force_off", "Force groups off: their green ends once others are called"),
    "omits": ("omit", "Omit groups: they are not begun"),
    "preempts": ("preempt", "Pre-empt for one group: it comes next and stays"),
}


def router(city: City, plans: PlanRepository) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/signals", tags=["signals"], dependencies=[VIEWER])
    _add_reading(routes, city)
    _add_overrides(routes, city)
    _add_running(routes, city, plans)
    _add_monitor(routes, city)
    return routes


def junction_of(city: City, name: str) -> Junction:
    """Return a junction of the map.

    Raises:
        RefusedError: when there is none of that name.
    """
    found = next((one for one in city.city_map.junctions if one.name == name), None)
    if found is None:
        raise not_found("junction", name)
    return found


def site_of(city: City, name: str) -> SignalSite:
    """Return what a junction reported of itself.

    Raises:
        RefusedError: when there is none of that name, or its controller has not reported yet.
    """
    junction_of(city, name)
    site = city.view.picture().sites.get(name)
    if site is None:
        raise RefusedError.of("offline", f"controller of junction {name!r}: has not reported yet")
    return site


def _add_reading(routes: APIRouter, city: City) -> None:
    @routes.get("", summary="All junctions", responses=answer(Signals))
    def all_signals() -> Response:
        rows = junction_rows(city.view.picture(), city.city_map.junctions, city.plans)
        return json_response(Signals(signals=rows))

    @routes.get("/{name}", summary="One junction", responses=answer(JunctionRow))
    def one_signal(name: Name) -> Response:
        junction = junction_of(city, name)
        (row,) = junction_rows(city.view.picture(), [junction], city.plans)
        return json_response(row)

    @routes.get(
        "/{name}/site",
        summary="Phases, least times, conflicts, rings, policies",
        responses=answer(SignalSite),
    )
    def site(request: Request, name: Name) -> Response:
        site = site_of(city, name)
        return tagged(request, msgspec.structs.replace(site, t_ns=0))

    @routes.get(
        "/{name}/status",
        summary="What runs, detectors, greens to come",
        responses=answer(StatusRow),
    )
    def status(name: Name) -> Response:
        junction_of(city, name)
        held = city.view.picture().signal_statuses.get(name)
        if held is None:
            raise not_found("status of a junction", name)
        return json_response(status_row(held.message))

    @routes.get(
        "/{name}/history",
        summary="What each group showed in the last ten minutes",
        responses=answer(History),
    )
    def history(name: Name) -> Response:
        groups = [group.name for group in junction_of(city, name).groups]
        return json_response(city.view.signal_history(name, groups))

    @routes.get(
        "/{name}/promises",
        name="promises",
        summary="What SPaT published against what happened",
        responses=answer(ForecastScore),
    )
    def forecasts(name: Name) -> Response:
        junction_of(city, name)
        return json_response(city.view.signal_score(name))


def _add_overrides(routes: APIRouter, city: City) -> None:
    @routes.get(
        "/{name}/wishes",
        name="wishes",
        summary="Overrides in force, each with name, reason and end",
        responses=answer_page(SignalOverride),
    )
    def overrides(
        request: Request, name: Name, limit: Limit = 100, cursor: Cursor = ""
    ) -> Response:
        junction_of(city, name)
        held = city.view.picture().signal_statuses.get(name)
        rows = held.message.wishes if held is not None else ()
        page = page_of(rows, lambda w: f"{w.verb} {w.groups}", limit=limit, cursor=cursor)
        return page_response(request, page)

    for noun, (verb, summary) in _VERBS.items():
        _add_verb(routes, city, noun, verb, summary)

    @routes.post(
        "/{name}/clear",
        summary="Withdraw overrides of groups",
        dependencies=[OPERATOR],
        responses=answer(SignalReply),
    )
    def clear(
        name: Name, body: Json[ClearBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        junction_of(city, name)
        request = SignalRequest(
            request_id=key,
            junction=name,
            verb="clear",
            groups=tuple(body.groups),
            clears=body.verb,
            by=signer(body.by),
            reason=body.reason,
        )
        return json_response(city.call(request, SignalReply))


def _add_verb(routes: APIRouter, city: City, noun: str, verb: Verb, summary: str) -> None:
    def override(
        name: Name, body: Json[OverrideBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        junction_of(city, name)
        request = SignalRequest(
            request_id=key,
            junction=name,
            verb=verb,
            groups=tuple(body.groups),
            by=signer(body.by),
            reason=body.reason,
            expires_s=body.expires_s,
        )
        return json_response(city.call(request, SignalReply))

    routes.post(
        f"/{{name}}/{noun}",
        summary=summary,
        dependencies=[OPERATOR],
        operation_id=f"signals_{verb}",
        responses=answer(SignalReply),
    )(override)


def _add_running(routes: APIRouter, city: City, repository: PlanRepository) -> None:
    @routes.put(
        "/{name}/plan",
        summary="Run another plan",
        dependencies=[OPERATOR],
        responses=answer(PlanReply),
    )
    def plan(
        name: Name, body: Json[PlanChoiceBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        junction_of(city, name)
        request = _plan_request(city, repository, name, body.plan)
        who = {"by": signer(body.by), "reason": body.reason, "request_id": key}
        return json_response(city.call(msgspec.structs.replace(request, **who), PlanReply))

    @routes.put(
        "/{name}/policy",
        summary="Run a policy for a while",
        dependencies=[OPERATOR],
        responses=answer(SignalReply),
    )
    def policy(
        name: Name, body: Json[PolicyBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        junction_of(city, name)
        request = _policy(name, body.policy, body, signer(body.by), key)
        return json_response(city.call(request, SignalReply))

    _add_flash(routes, city)


def _add_flash(routes: APIRouter, city: City) -> None:
    @routes.put(
        "/{name}/flash",
        summary="Flash red, or end flashing",
        dependencies=[OPERATOR],
        responses=answer(FlashReply),
    )
    def flash(
        name: Name, body: Json[FlashBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        junction_of(city, name)
        by = signer(body.by)
        if body.engaged and body.expires_s is not None:
            return json_response(city.call(_policy(name, "flashing", body, by, key), SignalReply))
        held = city.view.picture().signal_statuses.get(name)
        if held is None:
            raise not_found("status of a junction", name)
        if not body.engaged and any(
            override.policy == "flashing" for override in held.message.wishes
        ):
            clear = SignalRequest(
                request_id=f"{key}-wish" if key else "",
                junction=name,
                verb="clear",
                clears="policy",
                by=by,
                reason=body.reason,
            )
            city.call(clear, SignalReply)
        request = PlanRequest(
            request_id=key,
            junction=name,
            plan="flash" if body.engaged else "",
            by=by,
            reason=body.reason,
        )
        return json_response(city.call(request, PlanReply))


def _policy(
    name: str, policy: str, body: PolicyBody | FlashBody, by: str, key: str
) -> SignalRequest:
    return SignalRequest(
        request_id=key,
        junction=name,
        verb="policy",
        policy=policy,
        by=by,
        reason=body.reason,
        expires_s=body.expires_s or LONGEST_S,
    )


def _add_monitor(routes: APIRouter, city: City) -> None:
    @routes.get(
        "/{name}/monitor",
        summary="The monitor's reports, newest first",
        responses=answer_page(Verdict),
    )
    def verdicts(request: Request, name: Name, limit: Limit = 100, cursor: Cursor = "") -> Response:
        junction_of(city, name)
        rows = city.view.signal_verdicts(name)
        page = page_of(rows, lambda row: str(row.t_ns), limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.post(
        "/{name}/monitor/reset",
        summary="Clear a latched fault of the monitor",
        dependencies=[ENGINEER],
        responses=answer(MonitorStatus),
    )
    def reset(
        name: Name, body: Json[ResetBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        junction_of(city, name)
        by, reason = signer(body.by), body.reason
        request = MonitorReset(request_id=key, junction=name, by=by, reason=reason)
        return json_response(city.call(request, MonitorStatus))


def _plan_request(city: City, repository: PlanRepository, name: str, plan: str) -> PlanRequest:
    """Return a request for a plan, with its stages if it is a saved one.

    Raises:
        RefusedError: when it was proven for a junction that has changed since.
    """
    request = PlanRequest(junction=name, plan=plan, by="")
    file = None if plan == "flash" else repository.read(name, plan)
    if file is None:
        return request
    if not file.is_proven or not fits(file, site_of(city, name)):
        detail = f"plan {plan!r} is not proven for junction {name!r} as it is now: prove it again"
        raise RefusedError.of("unproven", detail)
    return msgspec.structs.replace(request, stages=file.stages, offset_s=file.offset_s)
