"""Studies: how far each is, what came of it, and its page."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path, Request, Response
from fastapi.responses import FileResponse

from scm.api.city import City, json_response
from scm.api.paging import Cursor, Limit, page_of_names, page_response
from scm.api.roles import VIEWER
from scm.api.schemas import answer, answer_file, answer_page
from scm.api.study_repository import NAME, StudyRepository
from scm.records.studies import Study, StudyRow

PAGE_POLICY = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""Of a page with styles of its own: whatever stands in a study's folder, no script of it runs."""
MOST_PROGRAMS = 1  # at once; further ones wait for their turn

Name = Annotated[
    str,
    Path(
        pattern=NAME,
        description="a study: its folder in `studies`",
        examples=["signal_policies"],
    ),
]


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/studies", tags=["studies"], dependencies=[VIEWER])
    repository = StudyRepository(city.folders.studies)
    turns = asyncio.Semaphore(MOST_PROGRAMS)

    @routes.get(
        "", summary="All studies, the one begun last first", responses=answer_page(StudyRow)
    )
    def all_studies(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        page = page_of_names(repository.names(), repository.row, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get("/{name}", summary="One study and what came of it", responses=answer(Study))
    async def one_study(name: Name) -> Response:
        async with turns:
            return json_response(await asyncio.to_thread(repository.study, name))

    @routes.get(
        "/{name}/page",
        summary="A study as one page with plots",
        responses=answer_file("text/html", "The page; it loads nothing."),
        response_class=Response,
    )
    async def page(name: Name) -> Response:
        async with turns:
            path = await asyncio.to_thread(repository.page, name)
        headers = {"Cache-Control": "no-cache", "Content-Security-Policy": PAGE_POLICY}
        return FileResponse(path, media_type="text/html", headers=headers)

    return routes
