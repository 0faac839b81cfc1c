"""The web application of one city: routes by noun, the live stream, the dashboard's files."""

import asyncio
import uuid
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

from fastapi import APIRouter, FastAPI
from fastapi.responses import FileResponse
from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from scm.api import openapi, problem
from scm.api.city import Ask, City, Link
from scm.api.gate import Gate, content_policy
from scm.api.idempotency import Idempotent
from scm.api.keys import KeyRing
from scm.api.limits import Limited
from scm.api.metrics import Measured, Metrics
from scm.api.operations import Operations
from scm.api.routes import (
    boxes,
    cameras,
    cities,
    events,
    eye,
    eye_calibration,
    health,
    live,
    map,  # noqa: A004  named for its noun
    misbehaviour,
    ngsi,
    operations,
    session,
    signals,
    stations,
    stop,
    traffic,
    vehicles,
)
from scm.api.routes import keys as key_routes
from scm.api.routes import metrics as metrics_routes
from scm.api.shelves import Shelves
from scm.api.stream import Stream
from scm.api.trace import Traced
from scm.api.view import CityView
from scm.clock import WallClock
from scm.maps.model import CityMap

STATIC_DIR = Path(__file__).parent / "static"
PAGES = ("map", "signals", "vehicles", "eye", "recordings", "mismatch", "events")
"""First part of the address of each page of the dashboard; what follows is the page's own."""

_REVALIDATE = {"Cache-Control": "no-cache"}


class _Files(StaticFiles):
    """Static files with an ETag that the browser asks about each time: no stale page, no reload."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers.update(_REVALIDATE)
        return response


def create_app(
    view: CityView,
    ask: Ask,
    city_map: CityMap,
    *,
    keys: KeyRing | None = None,
    plans: Mapping[str, Sequence[str]] | None = None,
    shelves: Shelves | None = None,
    link: Link | None = None,
    map_file: str = "",
) -> FastAPI:
    """Build the application.

    Args:
        view: What is shown; stepped by its runner on another thread.
        ask: Sends a request on the bus and waits for the reply, at most so many seconds.
        city_map: Of the city that `view` hears.
        keys: Who may call, and what each may do; without it only this machine may call, and may do
            everything.
        plans: Names of the signal plans each junction offers, beyond those that were seen.
        shelves: Folders of recordings, reports and the like; None: the city offers none.
        link: What is known of the connection to the bus.
        map_file: Name or path of the map; empty: its own name.
    """
    city = City(view, ask, city_map, plans or {}, shelves or Shelves(), link or Link(), map_file)
    work = Operations(WallClock())
    stream = Stream(city, uuid.uuid4().hex[:8])
    app = FastAPI(
        title=f"scm {city_map.name}",
        version="1",
        docs_url=None,  # its page loads from a CDN: ours is static/docs.html
        redoc_url=None,
        openapi_url="/api/v1/openapi.json",
        generate_unique_id_function=openapi.operation_id,
        lifespan=_lifespan_of(stream, work),
    )
    app.state.stream = stream
    app.state.keys = keys
    problem.install(app)
    openapi.install(app)
    policy = content_policy((STATIC_DIR / "index.html").read_text("utf-8"))
    clock = WallClock()
    app.add_middleware(Idempotent, clock=clock)  # what is added later sees a request earlier
    app.add_middleware(Limited, clock=clock)
    app.add_middleware(Gate, keys=keys, policy=policy)
    metrics = Metrics(city, stream)
    app.add_middleware(Measured, metrics=metrics, clock=clock)
    app.add_middleware(Traced)
    api = APIRouter(prefix="/api/v1")
    for noun in (
        cities, vehicles, signals, stations, events, map, boxes, eye, stop, misbehaviour, traffic,
    ):  # fmt: skip
        api.include_router(noun.router(city), responses=problem.RESPONSES)
    api.include_router(cameras.router(city, stream), responses=problem.RESPONSES)
    api.include_router(eye_calibration.router(city, work), responses=problem.RESPONSES)
    api.include_router(operations.router(work), responses=problem.RESPONSES)
    api.include_router(live.router(stream), responses=problem.RESPONSES)
    api.include_router(session.router(), responses=problem.RESPONSES)
    api.include_router(key_routes.router(keys), responses=problem.RESPONSES)
    app.include_router(api)
    app.include_router(ngsi.router(city), responses=problem.RESPONSES)
    app.include_router(health.router(city), responses=problem.RESPONSES)
    app.include_router(metrics_routes.router(metrics), responses=problem.RESPONSES)
    _add_pages(app)
    return app


def _lifespan_of(
    stream: Stream, work: Operations
) -> Callable[[FastAPI], AbstractAsyncContextManager[None]]:
    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        task = asyncio.create_task(stream.run())
        yield
        work.close()
        stream.close()
        await task

    return lifespan


def _add_pages(app: FastAPI) -> None:
    def dashboard() -> FileResponse:
        return FileResponse(STATIC_DIR / "index.html", headers=_REVALIDATE)

    for path in (
        "/",
        *(f"/{page}" for page in PAGES),
        *(f"/{page}/{{rest:path}}" for page in PAGES),
    ):
        app.get(path, include_in_schema=False)(dashboard)

    @app.get("/docs", include_in_schema=False)
    def docs() -> FileResponse:
        return FileResponse(STATIC_DIR / "docs.html", headers=_REVALIDATE)

    app.mount("/static", _Files(directory=STATIC_DIR), name="static")
