"""The web application of one city: routes by noun, the live stream, the dashboard's files."""

import asyncio
import importlib
import uuid
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from http import HTTPStatus
from inspect import signature

from fastapi import APIRouter, FastAPI

from scm import registry
from scm.api import openapi, problem, uploads
from scm.api.acknowledgements import Acknowledgements
from scm.api.audit_text import AuditText
from scm.api.audit_trail import Audited
from scm.api.based import HERE, Based, Site, check_base
from scm.api.body_limit import Bounded
from scm.api.calibration_jobs import LARGEST_PICTURE
from scm.api.city import City, Link, SendRequest
from scm.api.dashboard import Dashboard, astray, index_text
from scm.api.folders import Folders
from scm.api.gate import Gate, content_policy
from scm.api.head import Headed
from scm.api.idempotency import Idempotent
from scm.api.keys import KeyRing
from scm.api.known_keys import KnownKeys
from scm.api.limits import Limited
from scm.api.metrics import Measured, Metrics
from scm.api.mismatch_jobs import MismatchJobs
from scm.api.operations import Operations
from scm.api.signal_plans import PlanRepository
from scm.api.stream import Stream
from scm.api.trace import Traced
from scm.api.vehicle_frames import VehicleFrames
from scm.api.view import CityView
from scm.clock import WallClock
from scm.records.city_map import CityMap
from scm.store.memory import MemoryStore
from scm.store.repository import Repository

ROUTES = "scm.api.routes"
FILES = {
    r"/api/v1/mismatch/uploads": uploads.MOST_BYTES,
    r"/api/v1/eye/cameras/[^/]+/views": LARGEST_PICTURE,
}
"""Addresses that take files: how many bytes of them."""


def create_app(
    view: CityView,
    send: SendRequest,
    city_map: CityMap,
    *,
    keys: KeyRing | None = None,
    plans: Mapping[str, Sequence[str]] | None = None,
    folders: Folders | None = None,
    link: Link | None = None,
    state: Repository | None = None,
    site: Site = HERE,
) -> FastAPI:
    """Build the application.

    Args:
        view: What is shown; stepped by its runner on another thread.
        send: Sends a request on the bus and waits for the reply, at most so many seconds.
        city_map: Of the city that `view` shows.
        keys: Who may call, and what each may do; without it only this machine may call, and may do
            everything.
        plans: Names of the signal plans each junction offers, beyond those that were seen.
        folders: Those of recordings, reports and the like; None: the city offers none.
        link: What is known of the connection to the bus.
        state: The city's store, with its audit log; None: a new one in memory.
        site: Where people find the server.

    Raises:
        RunError: when it can have no such base.
    """
    site = site._replace(base=check_base(site.base))
    clock = WallClock()
    services = _Services(
        city=City(view, send, city_map, plans or {}, folders or Folders(), link or Link()),
        keys=keys,
        store=state or MemoryStore(),
        clock=clock,
    )
    app = FastAPI(
        title="Smart City Manager",  # who has no key reads this: it does not name the map
        version="1",
        docs_url=None,  # its page loads from a CDN: ours is static/docs.html
        redoc_url=None,
        openapi_url="/api/v1/openapi.json",
        generate_unique_id_function=openapi.operation_id,
        lifespan=services.lifespan,
        servers=[{"url": site.base}] if site.base else None,
    )
    app.state.base = site.base
    app.state.stream = services.stream
    app.state.frames = services.frames
    app.state.keys = keys
    problem.install(app)
    _add_layers(app, services, clock, site)
    nouns = services.routers()
    for prefix, routers in nouns.items():
        for noun in routers:
            app.include_router(noun, prefix=prefix, responses=problem.RESPONSES)
    openapi.install(app, nouns)
    app.state.words = AuditText(nouns)
    return app


class _Services:
    """What routes share: each names as arguments of its `router` those that it needs."""

    def __init__(
        self, *, city: City, keys: KeyRing | None, store: Repository, clock: WallClock
    ) -> None:
        self.city = city
        self.keys = keys
        self.known_keys = None if keys is None else KnownKeys(keys, clock)
        self.store = store
        self.acknowledgements = Acknowledgements(store, clock)
        self.operations = Operations(clock)
        self.plans = PlanRepository(city.folders.plans)
        self.jobs = MismatchJobs(city, self.operations, clock, city.link.words)
        self.stream = Stream(city, uuid.uuid4().hex[:8], self.acknowledgements)
        self.frames = VehicleFrames(city.view)
        self.metrics = Metrics(city, self.stream)

    def routers(self) -> dict[str, list[APIRouter]]:
        """Return the router of each file in `routes`, by the prefix of its addresses."""
        found: dict[str, list[APIRouter]] = {}
        for name in registry.names(ROUTES):
            module = importlib.import_module(f"{ROUTES}.{name}")
            services = {need: getattr(self, need) for need in signature(module.router).parameters}
            prefix = getattr(module, "PREFIX", "/api/v1")
            found.setdefault(prefix, []).append(module.router(**services))
        return found

    @asynccontextmanager
    async def lifespan(self, _app: FastAPI) -> AsyncIterator[None]:
        """Run the streams while the server runs; call off what is still at work at its end."""
        tasks = [asyncio.create_task(self.stream.run()), asyncio.create_task(self.frames.run())]
        yield
        self.operations.close()
        self.stream.close()
        self.frames.close()
        await asyncio.gather(*tasks)


def _add_layers(app: FastAPI, services: _Services, clock: WallClock, site: Site) -> None:
    policy = content_policy(index_text(site.base))
    app.add_middleware(Headed)  # what is added later sees a request earlier
    app.add_middleware(Idempotent, clock=clock)
    app.add_middleware(Bounded, larger=FILES)
    app.add_middleware(Audited, store=services.store, clock=clock)
    app.add_middleware(Limited, clock=clock)  # frequent requests fill no log
    app.add_middleware(Dashboard, base=site.base)
    app.add_middleware(Gate, keys=services.known_keys, policy=policy, origins=site.origins)
    app.add_middleware(Measured, metrics=services.metrics, clock=clock)
    app.add_middleware(Traced)
    app.add_middleware(Based, base=site.base)
    app.add_exception_handler(HTTPStatus.NOT_FOUND, astray)
