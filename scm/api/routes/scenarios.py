"""Scenarios: scripts that drive the fleet, stored, edited and run."""

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

from scm.api.city import City, IdempotencyKey, json_response, not_found
from scm.api.etag import Matching, tagged
from scm.api.inputs import Json
from scm.api.keys import KeyRing
from scm.api.operations import Operations, accepted
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.roles import ADMIN, OPERATOR, VIEWER
from scm.api.scenarios import NAME, ScenarioRepository, ScenarioRuns
from scm.api.schemas import answer, answer_nothing, answer_page
from scm.records.operations import Operation
from scm.records.scenarios import Lines, RunBody, Scenario, ScenarioBody

Name = Annotated[
    str, Path(pattern=NAME, description="a script without .py", examples=["travel_times"])
]
Run = Annotated[
    str,
    Path(pattern=r"^scenario-[0-9]{1,9}$", description="its operation", examples=["scenario-3"]),
]


def router(city: City, operations: Operations, keys: KeyRing | None) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/scenarios", tags=["scenarios"], dependencies=[VIEWER])
    repository = ScenarioRepository(city.folders.scenarios)
    runs = ScenarioRuns(
        repository, operations, city.link.connect, city.link.script_credentials, keys
    )
    _add_scripts(routes, repository)

    @routes.post(
        "/{name}/runs",
        summary="Run a script",
        status_code=202,
        dependencies=[OPERATOR],
        responses=answer(Operation, 202),
    )
    def run(
        request: Request, name: Name, body: Json[RunBody], key: IdempotencyKey = ""
    ) -> Response:
        del key  # the same key gets the same operation
        owner = str(request.scope["scm_owner"])
        own = str(request.scope["scm_key"])
        return accepted(runs.start(name, body.arguments, owner=owner, key=own))

    @routes.get("/runs/{run}/lines", summary="What a run printed", responses=answer(Lines))
    def lines(
        run: Run,
        after: Annotated[
            int, Query(ge=0, le=10**9, description="number of the first line", examples=[0])
        ] = 0,
    ) -> Response:
        return json_response(runs.lines(run, after))

    return routes


def _add_scripts(routes: APIRouter, repository: ScenarioRepository) -> None:
    @routes.get("", summary="All scripts, one's own first", responses=answer_page(Scenario))
    def all_scenarios(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        page = page_of(repository.rows(), lambda row: row.name, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get("/{name}", summary="One script with its text", responses=answer(Scenario))
    def one(request: Request, name: Name) -> Response:
        found = repository.find(name)
        if found is None:
            raise not_found("scenario", name)
        return tagged(request, found)

    @routes.put(
        "/{name}",
        summary="Write a script",
        dependencies=[ADMIN],
        responses=answer(Scenario) | answer(Scenario, 201, "It is new."),
    )
    def write(
        request: Request,
        name: Name,
        body: Json[ScenarioBody],
        condition: Matching,
        key: IdempotencyKey = "",
    ) -> Response:
        del key  # the same script twice is the same script
        with repository.editing:
            before = repository.find(name)
            condition.check(before)
            written = repository.write(name, body.text)
        return tagged(request, written, 200 if before else 201)

    @routes.delete(
        "/{name}",
        summary="Delete a script",
        status_code=204,
        dependencies=[ADMIN],
        responses=answer_nothing(),
    )
    def remove(name: Name, condition: Matching, key: IdempotencyKey = "") -> Response:
        del key  # what is gone stays gone
        with repository.editing:
            before = repository.find(name)
            if before is not None and not before.shipped:
                condition.check(before)
            repository.remove(name)
        return Response(status_code=204)
