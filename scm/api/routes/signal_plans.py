"""Signal plans: list, read, prove, save, delete; a plan is saved when the search has proven it."""

import logging
from collections.abc import Sequence
from typing import Annotated

import msgspec
from fastapi import APIRouter, Path, Request, Response

from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.etag import Matching, tagged
from scm.api.inputs import Json
from scm.api.operations import Operations, accepted
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.problem import RefusedError
from scm.api.roles import ENGINEER, OPERATOR, VIEWER, Signer
from scm.api.routes.signals import junction_of, site_of
from scm.api.schemas import answer, answer_page
from scm.api.signal_plans import PlanRepository
from scm.clock import WallClock
from scm.errors import PlanError
from scm.records.operations import Operation
from scm.records.signal_plans import (
    PlanBody,
    PlanProof,
    PlanRow,
    SignalPlan,
    SignalStage,
    StageBody,
    StagesBody,
)
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.plan_file import PlanFile, fits

_LOGGER = logging.getLogger(__name__)

PlanName = Annotated[
    str,
    Path(pattern=r"^[a-z][a-z0-9_-]{0,31}$", description="a plan's name", examples=["rush"]),
]

Digest = Annotated[
    str,
    Path(pattern=r"^[0-9a-f]{16}$", description="of a proof", examples=["9f3a51c07be2d418"]),
]


def router(city: City, plans: PlanRepository, operations: Operations) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/signals/{name}", tags=["signals"], dependencies=[VIEWER])
    _add_reading(routes, city, plans)
    _add_proving(routes, city, plans, operations)
    _add_writing(routes, city, plans)
    return routes


def _add_reading(routes: APIRouter, city: City, repository: PlanRepository) -> None:
    @routes.get("/plans", summary="All plans of a junction", responses=answer_page(PlanRow))
    def plans(request: Request, name: Name, limit: Limit = 100, cursor: Cursor = "") -> Response:
        site = site_of(city, name)
        rows = [*(_shipped(site, plan) for plan in site.plans), *_readable(site, repository)]
        page = page_of(rows, lambda row: row.plan, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get("/plans/{plan}", summary="One plan", responses=answer(PlanRow))
    def one_plan(request: Request, name: Name, plan: PlanName) -> Response:
        row = _find(site_of(city, name), repository, plan)
        if row is None:
            raise not_found("plan", plan)
        return tagged(request, row)


def _add_proving(
    routes: APIRouter, city: City, repository: PlanRepository, operations: Operations
) -> None:
    @routes.post(
        "/proofs",
        summary="Search every state of kernel and plan for fault",
        status_code=202,
        dependencies=[OPERATOR],
        responses=answer(Operation, 202),
    )
    def prove(
        request: Request, name: Name, body: Json[StagesBody], key: IdempotencyKey = ""
    ) -> Response:
        del key  # proven twice is proven
        file = _file(site_of(city, name), body.plan, body.stages)
        owner = str(request.scope.get("scm_owner", ""))
        what = f"plan {body.plan} of junction {name}"
        return accepted(
            operations.start(
                "plan-proof", what, lambda progress: repository.prove(file, progress), owner=owner
            )
        )

    @routes.get("/proofs/{digest}", summary="One proof", responses=answer(PlanProof))
    def proof(name: Name, digest: Digest) -> Response:
        junction_of(city, name)
        found = repository.proof_of(digest)
        if found is None:
            raise not_found("proof", digest)
        return json_response(found)


def _add_writing(routes: APIRouter, city: City, repository: PlanRepository) -> None:
    @routes.put(
        "/plans/{plan}",
        summary="Save a proven plan",
        dependencies=[ENGINEER],
        responses=answer(PlanRow) | answer(PlanRow, 201, "It is new."),
    )
    def save(
        request: Request,
        name: Name,
        plan: PlanName,
        body: Json[PlanBody],
        signer: Signer,
        condition: Matching,
        key: IdempotencyKey = "",
    ) -> Response:
        del key  # the state that the writer saw is required
        site = site_of(city, name)
        _check_own(site, plan)
        file = _file(site, plan, body.stages)
        with repository.editing:
            before = _find(site, repository, plan)
            condition.check(before)
            row = _saved(site, _keep(repository, file, body, signer(body.by), before))
        return tagged(request, row, 200 if before is not None else 201)

    @routes.delete(
        "/plans/{plan}",
        summary="Delete a saved plan",
        dependencies=[ENGINEER],
        responses=answer(PlanRow, about="As it was."),
    )
    def delete(
        name: Name, plan: PlanName, condition: Matching, key: IdempotencyKey = ""
    ) -> Response:
        del key  # the state that the writer saw is required
        site = site_of(city, name)
        _check_own(site, plan)
        with repository.editing:
            before = _find(site, repository, plan)
            if before is None:
                raise not_found("plan", plan)
            condition.check(before)
            repository.delete(name, plan)
        return json_response(before)


def _keep(
    repository: PlanRepository,
    file: PlanFile,
    body: Json[PlanBody],
    by: str,
    before: PlanRow | None,
) -> PlanFile:
    """Save a plan with its proof, and return it.

    Raises:
        RefusedError: when it is not proven, its offset is beyond its cycle, or there are too many.
    """
    proof = repository.proof_of(file.digest) or (before.proof if before is not None else None)
    if proof is None or proof.digest != file.digest:
        detail = f"plan {file.plan!r}: these stages are not proven; POST them to .../proofs first"
        raise RefusedError.of("unproven", detail)
    _check_offset(file.plan, body.offset_s, proof.cycle_s)
    named = {"about": body.about, "by": by, "reason": body.reason}
    made = {"offset_s": body.offset_s, "saved_ns": WallClock().now_ns(), "proof": proof}
    file = msgspec.structs.replace(file, **named, **made)
    try:
        repository.write(file)
    except PlanError as refusal:
        raise RefusedError.of("full", str(refusal)) from refusal
    return file


def _check_own(site: SignalSite, plan: str) -> None:
    """Refuse to change a plan that was not saved by anybody, or a name that means something else.

    Raises:
        RefusedError: otherwise.
    """
    reserved = {"flash", *(one.plan for one in site.plans), *(one.policy for one in site.policies)}
    if plan in reserved:
        detail = f"plan {plan!r}: the junction has one of that name; save it under another"
        raise RefusedError.of("name_taken", detail)


def _check_offset(plan: str, offset_s: float | None, cycle_s: float) -> None:
    """Refuse an offset that is not inside the cycle.

    Raises:
        RefusedError: otherwise.
    """
    if offset_s is not None and offset_s >= cycle_s:
        detail = f"plan {plan!r}: offset_s: got {offset_s:g}, expected less than {cycle_s:g}"
        raise RefusedError.of("invalid", f"{detail}, its cycle")


def _file(site: SignalSite, plan: str, stages: Sequence[StageBody]) -> PlanFile:
    return PlanFile(
        junction=site.junction,
        plan=plan,
        stages=msgspec.convert(stages, tuple[SignalStage, ...], from_attributes=True),
        phases=site.phases,
        conflicts=site.conflicts,
    )


def _readable(site: SignalSite, repository: PlanRepository) -> list[PlanRow]:
    """Return the saved plans; one whose file is broken must not hide the others."""
    rows = []
    for plan in repository.names(site.junction):
        try:
            row = _find(site, repository, plan)
        except RefusedError as wrong:
            _LOGGER.warning("plan_unreadable %s", wrong)
            continue
        if row is not None:
            rows.append(row)
    return rows


def _find(site: SignalSite, repository: PlanRepository, plan: str) -> PlanRow | None:
    """Return a plan by name; None: there is none.

    Raises:
        RefusedError: when its file cannot be read.
    """
    shipped = next((one for one in site.plans if one.plan == plan), None)
    if shipped is not None:
        return _shipped(site, shipped)
    file = repository.read(site.junction, plan)
    return None if file is None else _saved(site, file)


def _shipped(site: SignalSite, plan: SignalPlan) -> PlanRow:
    return PlanRow(
        junction=site.junction,
        plan=plan.plan,
        about=plan.about,
        source="shipped",
        usable=True,
        cycle_s=plan.cycle_s,
        stages=plan.stages,
        offset_s=plan.offset_s,
    )


def _saved(site: SignalSite, file: PlanFile) -> PlanRow:
    return PlanRow(
        junction=site.junction,
        plan=file.plan,
        about=file.about,
        source="saved",
        usable=file.is_proven and fits(file, site),
        cycle_s=file.proof.cycle_s if file.proof is not None else 0.0,
        stages=file.stages,
        offset_s=file.offset_s,
        by=file.by,
        reason=file.reason,
        saved_ns=file.saved_ns,
        proof=file.proof,
    )
