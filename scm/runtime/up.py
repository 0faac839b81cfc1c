"""`scm up`: a whole city on this machine, one process a part, around a router in this one."""

import socket
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from scm.clock import NS_PER_MS, WallClock, seconds
from scm.disturbances import MESSAGE_KINDS, Disturbances
from scm.errors import RunError, nearest
from scm.eye.station import eye_station
from scm.maps.load import is_scan, load_map
from scm.maps.radio import with_radio
from scm.records.disturbances import Disturbance
from scm.runtime.joins import Join, inner_socket, joins_of
from scm.runtime.live import stop_on_signal
from scm.runtime.supervisor import Job, PrintLine, Supervisor
from scm.store.open import open_store
from scm.traffic.demand.part import DemandPart
from scm.traffic.demand.table import load_demand
from scm.v2x.access import SCRIPT, Guard, guard_of, is_loopback, own_stations
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.crossing import common_name, gateway_station
from scm.v2x.fleet_file import issue_gateway_files, load_fleet
from scm.v2x.key import check_name
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.presence import Presence
from scm.v2x.router import DEFAULT_ENDPOINT, Router, free_endpoint
from scm.vehicles.car_files import name_own_folder

HOST = "127.0.0.1"
SCM = (sys.executable, "-m", "scm")
MOST_RECORDED = 50  # hosted cars whose own messages are recorded: more would be nearly all of it
OPTIONAL = {
    "eye": "no poses from overhead cameras: real cars stand, and it checks no claims",
    "camera": "no pictures from cars' own cameras",
    "record": "no recording: nothing to replay or to search for a mismatch",
    "observer": "no traffic counts, no delays, no list of who breaks the rules",
    "misbehaviour": "cars' messages are not checked for misbehaviour",
}
"""Parts that a city can do without, and what is missing then."""
LOOK_EVERY_NS = 50 * NS_PER_MS

_print_now: PrintLine = partial(print, flush=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class CityOptions:
    """Which city to run.

    Attributes:
        map_name: Of a shipped map, or the path of a map file.
        city: Chunk of all its keys on the bus.
        hosted: How many cars the world simulates itself: n1, n2 ...
        agents: How many cars come as processes of their own, named on from there.
        host: Address that the dashboard is bound to.
        port: Of the dashboard; 0 takes a free one.
        listen: Endpoint of the router; one that ends in `:0` takes a free one.
        record_dir: Where the recording goes; made when missing.
        cameras_hz: How many pictures of the cars' own cameras are recorded a second, of each; 0:
            none, and the cameras run only while somebody looks.
        cameras_of: The cars whose cameras these are; empty: all.
        seed: Of all randomness.
        fleet: Fleet file of those who may enter; None: everybody on this machine.
        state: Store of what must outlive a part's process, and this city when it is named; None: a
            new file beside the recording.
        keys: Store of API keys; None: everybody on this machine.
        base: Path below which a proxy shows the dashboard.
        origin: Where people find it, if a proxy calls it by another name.
        trust_proxy: Proxies whose X-Forwarded-For the server believes.
        ros2: Whether ROS 2 nodes shall see the city.
        demand: Table of trips; None: no further cars come.
        twin: Whether every car is watched for changes.
        twin_sends: When the twin sends cars to where they decide whose a change is: `agreed`: when
            an operator has agreed; `idle`: whenever they are.
        without: Parts to leave out, of `OPTIONAL`.
        radio: Radio parameters in place of the map's, `key=value` each.
        join: Neighbours to join, `[CITY=]ENDPOINT` each; likewise `admit`, to wait for.
    """

    map_name: str
    city: str = "city"
    hosted: int = 4
    agents: int = 2
    host: str = HOST
    port: int = 8000
    listen: str = DEFAULT_ENDPOINT
    record_dir: Path = Path("runs")
    cameras_hz: float = 0.0
    cameras_of: tuple[str, ...] = ()
    seed: int = 0
    fleet: Path | None = None
    state: str | None = None
    keys: str | None = None
    base: str = ""
    origin: tuple[str, ...] = ()
    trust_proxy: tuple[str, ...] = ()
    ros2: bool = False
    demand: Path | None = None
    twin: bool = False
    twin_sends: str = "agreed"
    without: tuple[str, ...] = ()
    radio: tuple[str, ...] = ()
    join: tuple[str, ...] = ()
    admit: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """The options, and what was decided before anything starts.

    Attributes:
        port: One that is free.
        agents: The names of their cars.
        eyes: Cameras by the station that looks through each.
        has_bays: Whether cars may request bays.
        scan: How a scanned map was read; empty: it is none.
        joins: Links to neighbours.
        inner: Socket of the router for their gateways; empty: there are none.
    """

    options: CityOptions
    guard: Guard
    agents: tuple[str, ...]
    port: int
    recording: Path
    state: str
    eyes: Mapping[str, str]
    has_bays: bool
    scan: str
    joins: tuple[Join, ...] = ()
    inner: str = ""


def run_city(options: CityOptions, print_line: PrintLine = _print_now) -> int:
    """Run a city until SIGINT or SIGTERM and return the exit code; `print_line` informs a person.

    Raises:
        ScmError: when the map, the port or the endpoint is not to be had.
    """
    plan = _plan_of(options)
    name_own_folder(options.record_dir / "cars")
    guard = plan.guard
    with (
        inner_socket(plan.joins) as inner,
        Router(guard.listen, guard.settings, inner) as router,
        ZenohBus(options.city, "up", guard.connect, credentials=guard.credentials("up")) as bus,
    ):
        print_line(f"scm: city {options.city!r} on map {options.map_name!r}, bus {router.listen}")
        if plan.scan:
            print_line(f"  {plan.scan}")
        for name in options.without:
            print_line(f"  {name:<12} left out: {OPTIONAL[name]}")
        _watch(replace(plan, inner=inner), bus, print_line)
    if plan.recording.exists():
        print_line(f"recorded in {plan.recording}")
    return 0


def _plan_of(options: CityOptions) -> _Plan:
    if options.keys is None and not is_loopback(options.host):
        got = f"host: got {options.host!r} without API keys"
        msg = f"{got}, expected 127.0.0.1, or a store of `scm key add`"
        raise RunError(msg)
    city_map = with_radio(load_map(options.map_name), options.radio)
    _check_counts(options, len(city_map.spawns))
    if options.demand is not None:
        DemandPart(city_map, load_demand(options.demand))
    for url in (options.state, options.keys):
        if url is not None:
            open_store(url).close()
    port = _free_port(options.port)
    _make_folder(options.record_dir)
    recording = options.record_dir / f"{options.city}-{_stamp()}.mcap"
    eyes = {
        eye_station(camera.name, first=i == 0): camera.name
        for i, camera in enumerate(city_map.cameras)
    }
    agents = tuple(f"n{options.hosted + i + 1}" for i in range(options.agents))
    fleet = None if options.fleet is None else load_fleet(options.fleet)
    joins = joins_of(options.city, city_map, options.join, options.admit, fleet)
    cities = [join.neighbour for join in joins]
    stations = own_stations(eyes, agents, cities)
    listen = _free(options.listen)
    guard = guard_of(options.fleet, options.city, listen, stations, _now(), cities)
    if joins and fleet is not None:
        issue_gateway_files(load_fleet(fleet.path), common_name(options.city), _now())
    return _Plan(
        options=options,
        guard=guard,
        agents=agents,
        port=port,
        recording=recording,
        state=options.state or f"sqlite:{recording.with_suffix('.db')}",
        eyes=eyes,
        has_bays=bool(city_map.bays),
        scan=city_map.source if is_scan(options.map_name) else "",
        joins=joins,
    )


def _check_counts(options: CityOptions, places: int) -> None:
    """Check how many of each are wanted; `places` are the map's, to put hosted cars."""
    if not 0 <= options.hosted <= places:
        got = f"hosted: got {options.hosted} cars"
        msg = f"{got}, expected 0 to {places}: so many places has map {options.map_name!r}"
        raise RunError(msg)
    if options.agents < 0:
        msg = f"agents: got {options.agents} cars, expected 0 or more"
        raise RunError(msg)
    hz, cars = options.cameras_hz, options.cameras_of
    if not 0.0 <= hz < float("inf") or (cars and not hz):
        msg = f"cameras_hz: got {hz}, expected 0 or more, and more than 0 with --cameras-of"
        raise RunError(msg)
    for name in cars:
        check_name(name, "cameras_of")
    for name in options.without:
        if name not in OPTIONAL:
            expected = f"expected any of {', '.join(OPTIONAL)}{nearest(name, tuple(OPTIONAL))}"
            msg = f"without: got {name!r}, {expected}; every other part is needed"
            raise RunError(msg)
    if hz and "record" in options.without:
        msg = "without: got record with --cameras-hz, which records pictures; expected one of both"
        raise RunError(msg)


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as cause:
        msg = f"{folder}: {cause.strerror}; expected a folder for recordings"
        raise RunError(msg) from cause


def _watch(plan: _Plan, bus: ZenohBus, print_line: PrintLine) -> None:
    """Keep all processes of the city alive until a signal stops it."""
    clock, mailbox = WallClock(), Mailbox(1000)
    supervisor, disturbances = (
        Supervisor([*_parts(plan), *_agents(plan)], clock, print_line),
        Disturbances(),
    )
    stop = stop_on_signal()
    for kind in MESSAGE_KINDS:
        bus.subscribe(kind, {}, mailbox)
    for join in plan.joins:
        bus.subscribe(CityEvent, {"source": gateway_station(join.neighbour)}, mailbox)
    is_ready, advised = False, set[str]()
    try:
        while not clock.wait_until(clock.now_ns() + LOOK_EVERY_NS, stop):
            supervisor.poll()
            for item in mailbox.drain():
                disturbances.receive(item)
                if isinstance(item.message, Presence):
                    supervisor.receive(item.message)
                elif isinstance(item.message, CityEvent):
                    print_line(f"  {'neighbour':<12} {item.message.text}")
            disturbances.check_silence(clock.now_ns())
            for one in disturbances.news():
                if is_ready:  # parts that start are late, and are not all there
                    _report_disturbance(one, print_line, advised)
            if supervisor.is_ready and not is_ready:
                is_ready = True
                _show_next_steps(plan, print_line)
    finally:
        print_line("stopping")
        supervisor.stop()


def _report_disturbance(one: Disturbance, print_line: PrintLine, advised: set[str]) -> None:
    """Report what began or ended; advice is given once for each kind."""
    if one.end_ns is None:
        print_line(f"  {'warning':<12} {one.text}: trips meanwhile are void")
        if one.advice and one.kind not in advised:
            advised.add(one.kind)
            print_line(f"  {'do this':<12} {one.advice}")
    else:
        lasted_s = seconds(one.end_ns - one.start_ns)
        print_line(f"  {'over':<12} after {lasted_s:.1f} s: {one.text}")


def _parts(plan: _Plan) -> list[Job]:
    def scm(name: str, *more: str, station: str = "") -> Sequence[str]:
        shared = (*_at_bus(plan, station or name), "--seed", str(plan.options.seed))
        return [*SCM, name, plan.options.map_name, *shared, *more]

    def record() -> Sequence[str]:
        """Name another file when a recorder died: a recording is never written over."""
        first = plan.recording
        out = first.with_stem(f"{plan.options.city}-{_stamp()}") if first.exists() else first
        sparse = ["--sparse"] if plan.options.hosted > MOST_RECORDED else []
        of = (word for name in plan.options.cameras_of for word in ("--cameras-of", name))
        cameras = ("--cameras-hz", str(plan.options.cameras_hz), *of)
        return scm("record", "--out", str(out), *sparse, *cameras)

    def part(name: str, what: str, *more: str) -> Job:
        return Job(name, "part", what, lambda: scm(name, *more))

    def eye(station: str, camera: str) -> Job:
        command = partial(scm, "eye", "--camera", camera, *stored, station=station)
        return Job(station, "part", f"overhead camera {camera}: tags, poses, tracks", command)

    cars = f"cars, walls, sensors, radio; {plan.options.hosted} hosted"
    stored = ("--state", plan.state)
    air = [word for setting in plan.options.radio for word in ("--radio", setting)]

    def demand(table: Path) -> Job:
        command = [*SCM, "demand", str(table), plan.options.map_name, *_at_bus(plan, "demand")]
        return Job("demand", "part", f"cars that come and go as in {table}", lambda: command)

    jobs = [
        Job(
            "record",
            "part",
            f"everything on the bus into {plan.recording.parent}/",
            record,
            last=True,
        ),
        part("traffic", "signals: safe kernel, policies, plans", *stored),
        part("monitor", "second channel: checks the signals, latches flash", *stored),
        part("world", cars, "--hosted", str(plan.options.hosted), *air, *stored),
        *(eye(station, camera) for station, camera in plan.eyes.items()),
        part("camera", "cars' own cameras, rendered while somebody looks"),
        part("observer", "counts, delays, and who breaks the rules"),
        part("misbehaviour", "checks cars' messages for misbehaviour"),
    ]
    if plan.has_bays:
        jobs.append(part("parking", "gives bays to cars that park, and lets them drive in turn"))
    if plan.options.demand is not None:
        jobs.append(demand(plan.options.demand))
    if plan.options.twin:
        data = ("--data", str(plan.options.record_dir), "--send", plan.options.twin_sends)
        jobs.append(part("twin", "watches cars: since when one has changed", *data, *stored))
    jobs += _gateways(plan, scm)
    if plan.options.ros2:
        jobs.append(part("ros2", "ROS 2: topics of all cars, driving by the lease"))
    left = plan.options.without
    jobs = [job for job in jobs if ("eye" if job.name in plan.eyes else job.name) not in left]
    web = _web(plan, [job.name for job in jobs])
    return [*jobs, part("api", "REST, event stream, dashboard", *web, *stored)]


def _gateways(plan: _Plan, scm: Callable[..., Sequence[str]]) -> Iterator[Job]:
    """Yield the links to neighbours; `scm` returns the command of a part."""
    fleet = () if plan.options.fleet is None else ("--fleet", str(plan.options.fleet))
    for join in plan.joins:
        station = gateway_station(join.neighbour)
        words = ("--neighbour", join.neighbour, *join.words, "--inner", plan.inner, *fleet)
        command = partial(scm, "gateway", *words, station=station)
        yield Job(
            station, "part", f"link to city {join.neighbour}, {' '.join(join.words)}", command
        )


def _web(plan: _Plan, parts: Sequence[str]) -> Sequence[str]:
    """Return where the server is found, who may call it, what it shows, and who should be there."""
    options, own = plan.options, plan.guard.files.get(SCRIPT)
    words = ["--host", options.host, "--port", str(plan.port), "--data", str(options.record_dir)]
    words += ["--base", options.base] if options.base else []
    words += [word for one in options.trust_proxy for word in ("--trust-proxy", one)]
    words += [word for one in options.origin for word in ("--origin", one)]
    words += [word for name in parts for word in ("--expects", name)]
    words += ["--keys", options.keys] if options.keys is not None else []
    return [*words, *(("--script-credentials", str(own)) if own is not None else ())]


def _at_bus(plan: _Plan, station: str) -> Sequence[str]:
    """Return how a station's program finds the bus, and what it is let in by."""
    shared = ("--connect", plan.guard.connect, "--city", plan.options.city)
    return (*shared, *plan.guard.arguments(station))


def _agents(plan: _Plan) -> list[Job]:
    def join(name: str) -> Sequence[str]:
        program = (sys.executable, "-m", "vehicle_agent", "--log", "warning", "join")
        return [*program, "--name", name, *_at_bus(plan, name)]

    # After the world: it compiles the physics, and they find it compiled.
    return [
        Job(name, "v", "vehicle agent: a car of its own", partial(join, name), after="world")
        for name in plan.agents
    ]


def _show_next_steps(plan: _Plan, print_line: PrintLine) -> None:
    script = f"--connect {plan.guard.connect}"
    at = script + ("" if plan.options.city == "city" else f" --city {plan.options.city}")
    programs = Path(sys.executable).parent
    if programs.is_relative_to(Path.cwd()):
        programs = programs.relative_to(Path.cwd())
    car = f"n{plan.options.hosted + len(plan.agents) + 1}"
    print_line(f"dashboard: http://{plan.options.host}:{plan.port}{plan.options.base.rstrip('/')}")
    if plan.options.fleet is None:
        print_line("try next, in another shell:")
        print_line(f"  {programs}/vehicle-agent join --name {car} {at}      another car")
        print_line(
            f"  {programs}/python examples/travel_times.py --live {script}      a fleet script"
        )
    else:
        print_line(f"members of {plan.options.fleet} may enter, with --connect and --credentials")
        print_line(
            f"  {programs}/vehicle-agent join --name NAME {at} --credentials FILE      a car of it"
        )
    print_line("Ctrl-C stops the city and names its recording")


def _now() -> datetime:
    return datetime.fromtimestamp(seconds(WallClock().now_ns()), UTC)


def _stamp() -> str:
    """Return the time of day for a file's name, UTC."""
    return f"{_now():%Y%m%d-%H%M%S-%f}"


def _free(listen: str) -> str:
    """Return an endpoint, with a free port instead of 0."""
    if not listen.endswith(":0"):
        return listen
    link = listen.partition("/")[0]
    return free_endpoint().replace("tcp/", f"{link}/")


def _free_port(port: int) -> int:
    """Return a port that can be bound now.

    Raises:
        RunError: when the given one is taken.
    """
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except (OSError, OverflowError) as cause:
            why = getattr(cause, "strerror", "there is no such port")
            msg = f"dashboard port {port}: {why}; expected a free one, or 0 for any"
            raise RunError(msg) from cause
        bound: int = probe.getsockname()[1]
        return bound
