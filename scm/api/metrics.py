"""Metrics for Prometheus: the city's state, read on request, and the interface's requests.

The names are ours: `scm_` and the unit at the end. A fault of a signal monitor stays latched until
a person resets it, so that none is missed between two readings.
"""

from collections import Counter as Tally
from collections.abc import Iterable, Iterator
from typing import get_args

from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from scm.api.city import City
from scm.api.picture import Picture
from scm.api.stream import Stream
from scm.clock import Clock, seconds
from scm.records.twins import State
from scm.v2x.messages.world_snapshot import WorldSnapshot

BUCKETS_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 1.0, 2.5)
TWIN_STATES: tuple[str, ...] = get_args(State)
METHODS = frozenset({"GET", "HEAD", "OPTIONS", "POST", "PUT", "PATCH", "DELETE"})
_ENDLESS = "text/event-stream", "multipart/x-mixed-replace", "application/octet-stream"

Labels = dict[tuple[str, ...], float]


class Metrics:
    """All metrics of one server."""

    def __init__(self, city: City, stream: Stream) -> None:
        self._registry = CollectorRegistry()
        self._registry.register(_OfCity(city, stream))
        self.requests = Counter(
            "scm_requests",
            "Requests answered, by route.",
            ("method", "route", "status"),
            registry=self._registry,
        )
        self.seconds = Histogram(
            "scm_request_seconds",
            "From a request's head to the end of its answer; endless answers are left out.",
            ("method", "route"),
            registry=self._registry,
            buckets=BUCKETS_S,
        )

    def text(self) -> bytes:
        """Return everything in Prometheus' text format."""
        return generate_latest(self._registry)


class Measured:
    """ASGI middleware: count and time every request, by the route that answered it."""

    def __init__(self, app: ASGIApp, *, metrics: Metrics, clock: Clock) -> None:
        self._app = app
        self._metrics = metrics
        self._clock = clock

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request and note how that went."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began_ns = self._clock.now_ns()
        status, media = 500, ""

        async def send_noted(message: Message) -> None:
            nonlocal status, media
            if message["type"] == "http.response.start":
                status = message["status"]
                media = dict(message["headers"]).get(b"content-type", b"").decode("latin-1")
            await send(message)

        try:
            await self._app(scope, receive, send_noted)
        finally:
            route = _route_of(scope)
            method = scope["method"] if scope["method"] in METHODS else "other"
            self._metrics.requests.labels(method, route, str(status)).inc()
            if not media.startswith(_ENDLESS):
                took_s = seconds(self._clock.now_ns() - began_ns)
                self._metrics.seconds.labels(method, route).observe(took_s)


def _route_of(scope: Scope) -> str:
    """Return the address of a route with its names in braces; `none`: there was no such route.

    The route itself knows its address below its noun's prefix only.
    """
    template = str(getattr(scope.get("route"), "path_format", ""))
    if not template:
        return "none"
    given = template.format_map({name: str(value) for name, value in scope["path_params"].items()})
    path = str(scope["path"])
    return path[: len(path) - len(given)] + template if path.endswith(given) else template


class _OfCity(Collector):
    """The view's state, read on request."""

    def __init__(self, city: City, stream: Stream) -> None:
        self._city = city
        self._stream = stream
        self._faults: set[tuple[str, int, str]] = set()

    def describe(self) -> Iterable[Metric]:
        """List no metric in advance: it would be the same work."""
        return ()

    def collect(self) -> Iterator[Metric]:
        """Yield all metrics of the city."""
        picture = self._city.view.picture()
        yield from self._of_world(picture)
        yield from _of_parts(picture)
        yield from self._of_monitors(picture)
        yield from _of_twins(picture)
        bus = self._city.link
        yield _gauge("scm_router_up", "Whether the bus can be reached.", float(bus.is_connected()))
        yield _counter(
            "scm_bus_callback_errors", "Arrivals that could not be read.", float(bus.rejected())
        )
        pages = float(self._stream.pages)
        yield _gauge("scm_stream_listeners", "Pages that receive the live stream.", pages)

    def _of_world(self, picture: Picture) -> Iterator[Metric]:
        held = picture.snapshot
        if held is None:
            return
        world = held.message
        age_s = seconds(self._city.now_ns() - held.arrived_ns)
        yield _gauge("scm_snapshot_age_seconds", "Age of the world's newest message.", age_s)
        yield _gauge("scm_real_time_factor", "Simulated over elapsed.", world.real_time_factor)
        yield _counter("scm_late_ticks", "Ticks of the world that ended late.", world.late_ticks)
        stopped = picture.stop is not None and picture.stop.engaged
        yield _gauge("scm_city_stopped", "Whether the red stop is engaged.", float(stopped))
        count = Tally((car.kind,) for car in world.vehicles)
        yield _by("scm_vehicles", "Cars on the map.", ("kind",), count)
        oldest_s: Labels = {}
        for car in world.vehicles:
            oldest_s[car.kind,] = max(oldest_s.get((car.kind,), 0.0), car.age_ms / 1000.0 + age_s)
        what = "Age of the state that is oldest among cars of a kind."
        yield _by("scm_vehicle_state_age_seconds", what, ("kind",), oldest_s)
        what = "Age of the newest command, oldest among leased cars of a kind, since it came there."
        yield _by("scm_cmd_age_seconds", what, ("kind",), _command_ages(world, age_s))

    def _of_monitors(self, picture: Picture) -> Iterator[Metric]:
        latched: Labels = {}
        for junction, held in picture.monitors.items():
            status = held.message
            latched[junction,] = float(status.fault is not None)
            if status.fault is not None:
                self._faults.add((junction, status.since_ns, status.fault))
        yield _by("scm_monitor_fault", "Whether a fault is latched.", ("junction",), latched)
        counter = CounterMetricFamily(
            "scm_monitor_faults",
            "Faults that the monitor latched, as far as this server saw them; `conflict`: signals.",
            labels=("junction", "fault"),
        )
        for labels, count in Tally(
            (junction, fault) for junction, _, fault in self._faults
        ).items():
            counter.add_metric(labels, count)
        yield counter


def _command_ages(world: WorldSnapshot, age_s: float) -> Labels:
    oldest_s: Labels = {}
    for car in world.vehicles:
        if car.command_age_ms is not None:
            command_age_s = car.command_age_ms / 1000.0 + age_s
            oldest_s[car.kind,] = max(oldest_s.get((car.kind,), 0.0), command_age_s)
    return oldest_s


def _of_parts(picture: Picture) -> Iterator[Metric]:
    rows = [row for row in picture.stations if row.role == "part"]
    up: Labels = {}
    for row in rows:
        up[row.name,] = max(up.get((row.name,), 0.0), float(row.alive))
    yield _by("scm_part_up", "Whether a part of the city is there.", ("part",), up)
    alive = [row for row in rows if row.alive]
    yield _by(
        "scm_part_step_seconds",
        "A part's slowest step of the last second; `world`: a tick.",
        ("part",),
        {(row.name,): row.step_ms / 1000.0 for row in alive},
    )
    late = CounterMetricFamily("scm_part_late_steps", "Steps that began late.", labels=("part",))
    dropped = CounterMetricFamily(
        "scm_part_dropped_messages", "Messages that full mailboxes dropped.", labels=("part",)
    )
    for row in alive:
        late.add_metric((row.name,), row.late_steps)
        dropped.add_metric((row.name,), row.dropped)
    yield late
    yield dropped


def _of_twins(picture: Picture) -> Iterator[Metric]:
    statuses = {name: held.message for name, held in picture.twins.items()}
    state: Labels = {
        (name, one): float(status.state == one)
        for name, status in statuses.items()
        for one in TWIN_STATES
    }
    yield _by("scm_twin_state", "1: the state of its twin.", ("vehicle", "state"), state)
    driven_s: Labels = {(name,): status.driven_s for name, status in statuses.items()}
    what = "How long a car was driven and watched since the twin part began."
    yield _by("scm_twin_driven_seconds", what, ("vehicle",), driven_s)
    changes: Labels = {(name,): float(len(status.changes)) for name, status in statuses.items()}
    what = "Changes of a car; of more than 20 the newest 20 are counted."
    yield _by("scm_twin_changes", what, ("vehicle",), changes)
    version: Labels = {(name,): float(status.version) for name, status in statuses.items()}
    what = "Version of its car file in force; 0: the file that it came with."
    yield _by("scm_twin_version", what, ("vehicle",), version)


def _gauge(name: str, about: str, value: float) -> Metric:
    return GaugeMetricFamily(name, about, value=value)


def _counter(name: str, about: str, value: float) -> Metric:
    return CounterMetricFamily(name, about, value=value)


def _by(
    name: str, about: str, labels: tuple[str, ...], values: Labels | Tally[tuple[str]]
) -> Metric:
    family = GaugeMetricFamily(name, about, labels=labels)
    for key, value in values.items():
        family.add_metric(key, value)
    return family
