"""`scm up`: a whole city on this machine, one process a part, around a router in this one."""

import socket
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from scm.clock import NS_PER_MS, WallClock, seconds
from scm.crew import Crew, Job, Say
from scm.errors import RunError
from scm.eye.station import eye_station
from scm.latched import HEARD, Latched
from scm.live import stop_on_signal
from scm.maps.load import load_map
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.presence import Presence
from scm.v2x.router import DEFAULT_ENDPOINT, Router, free_endpoint

HOST = "127.0.0.1"
MOST_RECORDED = 50  # hosted cars whose own messages are recorded: more would be nearly all of it
LOOK_EVERY_NS = 50 * NS_PER_MS

_say_now: Say = partial(print, flush=True)


def run_city(
    map_name: str,
    *,
    city: str = "city",
    hosted: int = 4,
    agents: int = 2,
    port: int = 8000,
    listen: str = DEFAULT_ENDPOINT,
    record_dir: Path = Path("runs"),
    seed: int = 0,
    say: Say = _say_now,
) -> int:
    """Run a city until SIGINT or SIGTERM; return the exit code.

    Args:
        map_name: Of a shipped map, or the path of a map file.
        city: Chunk of all its keys on the bus.
        hosted: How many cars the world simulates itself: n1, n2 ...
        agents: How many cars come as processes of their own, named on from there.
        port: Of the dashboard; 0 takes a free one.
        listen: Endpoint of the router; one that ends in `:0` takes a free one.
        record_dir: Where the recording goes; made when missing.
        seed: Of all randomness.
        say: Tells a person one line.

    Raises:
        ScmError: when the map, the port or the endpoint is not to be had.
    """
    city_map = load_map(map_name)
    port = _free_port(port)
    record_dir.mkdir(parents=True, exist_ok=True)
    with (
        Router(free_endpoint() if listen.endswith(":0") else listen) as router,
        ZenohBus(city, "up", router.listen) as bus,
    ):
        plan = _Plan(
            map_name=map_name,
            city=city,
            endpoint=router.listen,
            hosted=hosted,
            agents=agents,
            port=port,
            recording=record_dir / f"{city}-{_stamp()}.mcap",
            seed=seed,
            cameras=tuple(camera.name for camera in city_map.cameras),
        )
        say(f"scm: city {city!r} on map {map_name!r}, bus {router.listen}")
        _watch(plan, bus, say)
    if plan.recording.exists():
        say(f"recorded in {plan.recording}")
    return 0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """What city is to run."""

    map_name: str
    city: str
    endpoint: str
    hosted: int
    agents: int
    port: int
    recording: Path
    seed: int
    cameras: tuple[str, ...]


def _watch(plan: _Plan, bus: ZenohBus, say: Say) -> None:
    """Keep all processes of the city alive until told to stop."""
    clock, latched, heard = WallClock(), Latched(), Mailbox(1000)
    crew = Crew([*_parts(plan, latched), *_agents(plan)], clock, say)
    stop = stop_on_signal()
    for kind in (Presence, *HEARD):
        bus.subscribe(kind, {}, heard)
    told = False
    try:
        while not clock.wait_until(clock.now_ns() + LOOK_EVERY_NS, stop):
            crew.look()
            for item in heard.drain():
                if isinstance(item.message, Presence):
                    crew.heard(item.message)
                else:
                    latched.heard(item.message)
            if crew.settled and not told:
                told = True
                _tell_next(plan, say)
    finally:
        say("stopping")
        crew.stop()


def _parts(plan: _Plan, latched: Latched) -> list[Job]:
    def scm(part: str, *more: str) -> Sequence[str]:
        shared = ("--connect", plan.endpoint, "--city", plan.city, "--seed", str(plan.seed))
        return [sys.executable, "-m", "scm", part, plan.map_name, *shared, *more]

    def record() -> Sequence[str]:
        """Name another file when a recorder died: a recording is never written over."""
        first = plan.recording
        out = first.with_stem(f"{plan.city}-{_stamp()}") if first.exists() else first
        sparse = ["--sparse"] if plan.hosted > MOST_RECORDED else []
        return scm("record", "--out", str(out), *sparse)

    def monitor() -> Sequence[str]:
        return scm("monitor", *latched.monitor_arguments())

    def world() -> Sequence[str]:
        return scm("world", "--hosted", str(plan.hosted), *latched.world_arguments())

    def part(name: str, what: str, *more: str) -> Job:
        return Job(name, "part", what, lambda: scm(name, *more))

    folder = plan.recording.parent
    cars = f"cars, walls, sensors, radio; {plan.hosted} hosted"
    eyes = [
        Job(eye_station(camera, first=camera == plan.cameras[0]), "part",
            f"overhead camera {camera}: tags, poses, tracks",
            partial(scm, "eye", "--camera", camera))
        for camera in plan.cameras
    ]  # fmt: skip
    return [
        Job("record", "part", f"everything on the bus into {folder}/", record, last=True),
        part("traffic", "signals: safe kernel, plans"),
        Job("monitor", "part", "second channel: doubts the signals, latches flash", monitor),
        Job("world", "part", cars, world),
        *eyes,
        part("camera", "cars' own cameras, rendered while somebody looks"),
        part("camera", "cars' own cameras, rendered while somebody looks"),
        part("api", "REST, event stream, dashboard", "--host", HOST, "--port", str(plan.port)),
    ]


def _agents(plan: _Plan) -> list[Job]:
    def join(name: str) -> Sequence[str]:
        program = (sys.executable, "-m", "vehicle_agent", "--log", "warning", "join")
        return [*program, "--name", name, "--connect", plan.endpoint, "--city", plan.city]

    # After the world: it compiles the physics, and they find it compiled.
    return [
        Job(name, "v", "vehicle agent: a car of its own", partial(join, name), after="world")
        for name in (f"n{plan.hosted + i + 1}" for i in range(plan.agents))
    ]


def _tell_next(plan: _Plan, say: Say) -> None:
    script = f"--connect {plan.endpoint}"
    at = script + ("" if plan.city == "city" else f" --city {plan.city}")
    programs = Path(sys.executable).parent
    if programs.is_relative_to(Path.cwd()):
        programs = programs.relative_to(Path.cwd())
    car = f"n{plan.hosted + plan.agents + 1}"
    say(f"dashboard: http://{HOST}:{plan.port}")
    say("try next, in another shell:")
    say(f"  {programs}/vehicle-agent join --name {car} {at}      another car")
    say(f"  {programs}/python examples/travel_times.py --live {script}      a fleet script")
    say("Ctrl-C stops the city and names its recording")


def _stamp() -> str:
    """Return the time of day for a file's name, UTC."""
    now = datetime.fromtimestamp(seconds(WallClock().now_ns()), UTC)
    return f"{now:%Y%m%d-%H%M%S-%f}"


def _free_port(port: int) -> int:
    """Return a port that can be bound now.

    Raises:
        RunError: when the given one is taken.
    """
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as cause:
            msg = f"dashboard port {port}: {cause.strerror}; expected a free one, or 0 for any"
            raise RunError(msg) from cause
        bound: int = probe.getsockname()[1]
        return bound
