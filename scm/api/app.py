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
from scm.api.city import Ask, City
from scm.api.gate import Gate, content_policy
from scm.api.keys import KeyRing
from scm.api.operations import Operations
from scm.api.routes import (
    boxes,
    cameras,
    close_up,
    drive,
    events,
    eye,
    health,
    leases,
    live,
    map,  # noqa: A004  named for its noun
    misbehaviour,
    operations,
    planned_path,
    scan,
    session,
    signals,
    stations,
    stop,
    traffic,
    vehicles,
)
from scm.api.routes import keys as key_routes
from scm.api.routes import vehicle_frames as frame_routes
from scm.api.shelves import Shelves
from scm.api.stream import Stream
from scm.api.vehicle_frames import VehicleFrames
from scm.api.view import CityView
from scm.api.wire import Wire
from scm.clock import WallClock
from scm.maps.model import CityMap

STATIC_DIR = Path(__file__).parent / "static"
PAGES = ("map", "signals", "vehicles", "eye", "recordings", "mismatch", "events")
"""First part of the address of each page of the dashboard; what follows is the page's own."""

NOUNS = (
    vehicles, leases, signals, stations, events, map, boxes, eye, stop, misbehaviour, traffic,
)  # fmt: skip
"""Routes that need nothing but the city."""

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
    wire: Wire | None = None,
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
        wire: Says commands on the bus; None: no car can be driven from a page.
    """
    city = City(view, ask, city_map, plans or {}, shelves or Shelves(), wire)
    work = Operations(WallClock())
    stream = Stream(city, uuid.uuid4().hex[:8])
    frames = VehicleFrames(view)
    app = FastAPI(
        title=f"scm {city_map.name}",
        version="1",
        docs_url=None,  # its page loads from a CDN: ours is static/docs.html
        redoc_url=None,
        openapi_url="/api/v1/openapi.json",
        generate_unique_id_function=openapi.operation_id,
        lifespan=_lifespan_of(stream, frames, work),
    )
    app.state.stream = stream
    app.state.frames = frames
    app.state.keys = keys
    problem.install(app)
    openapi.install(app)
    policy = content_policy((STATIC_DIR / "index.html").read_text("utf-8"))
    app.add_middleware(Gate, keys=keys, policy=policy)
    api = APIRouter(prefix="/api/v1")
    for noun in NOUNS:
        api.include_router(noun.router(city), responses=problem.RESPONSES)
    api.include_router(cameras.router(city, stream), responses=problem.RESPONSES)
    api.include_router(scan.router(city, stream), responses=problem.RESPONSES)
    api.include_router(planned_path.router(city), responses=problem.RESPONSES)
    api.include_router(frame_routes.router(frames), responses=problem.RESPONSES)
    api.include_router(close_up.router(city, stream), responses=problem.RESPONSES)
    api.include_router(drive.router(city, stream))
    api.include_router(operations.router(work), responses=problem.RESPONSES)
    api.include_router(live.router(stream), responses=problem.RESPONSES)
    api.include_router(session.router(), responses=problem.RESPONSES)
    api.include_router(key_routes.router(keys), responses=problem.RESPONSES)
    app.include_router(api)
    app.include_router(health.router(city), responses=problem.RESPONSES)
    _add_pages(app)
    return app


def _lifespan_of(
    stream: Stream, frames: VehicleFrames, work: Operations
) -> Callable[[FastAPI], AbstractAsyncContextManager[None]]:
    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        tasks = [asyncio.create_task(stream.run()), asyncio.create_task(frames.run())]
        yield
        work.close()
        stream.close()
        frames.close()
        await asyncio.gather(*tasks)

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
