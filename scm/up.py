"""`scm up`: a whole city on this machine, one process a part, around a router in this one."""

import socket
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from scm.clock import NS_PER_MS, WallClock, seconds
from scm.crew import Crew, Job, Say
from scm.errors import RunError
from scm.latched import HEARD, Latched
from scm.live import stop_on_signal
from scm.maps.load import load_map
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.presence import Presence
from scm.v2x.router import DEFAULT_ENDPOINT, Router, free_endpoint

HOST = "127.0.0.1"
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
    load_map(map_name)
    clock = WallClock()
    port = _free_port(port)
    record_dir.mkdir(parents=True, exist_ok=True)
    with (
        Router(free_endpoint() if listen.endswith(":0") else listen) as router,
        ZenohBus(city, "up", router.listen) as bus,
    ):
        latched = Latched()
        jobs = [
            *_parts(map_name, city, router.listen, hosted, port, record_dir, seed, clock, latched),
            *_agents(city, router.listen, hosted, agents),
        ]
        crew = Crew(jobs, clock, say)
        heard = Mailbox(1000)
        stop = stop_on_signal()
        for kind in (Presence, *HEARD):
            bus.subscribe(kind, {}, heard)
        say(f"scm: city {city!r} on map {map_name!r}, bus {router.listen}")
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
                    _tell_next(say, city, router.listen, port, hosted + agents + 1, record_dir)
        finally:
            say("stopping")
            crew.stop()
    return 0


def _parts(
    map_name: str,
    city: str,
    endpoint: str,
    hosted: int,
    port: int,
    record_dir: Path,
    seed: int,
    clock: WallClock,
    latched: Latched,
) -> list[Job]:
    def scm(part: str, *more: str) -> Sequence[str]:
        shared = ("--connect", endpoint, "--city", city, "--seed", str(seed))
        return [sys.executable, "-m", "scm", part, map_name, *shared, *more]

    def record() -> Sequence[str]:
        now = datetime.fromtimestamp(seconds(clock.now_ns()), UTC)
        out = record_dir / f"{city}-{now:%Y%m%d-%H%M%S-%f}.mcap"
        return scm("record", "--out", str(out))

    def monitor() -> Sequence[str]:
        return scm("monitor", *latched.monitor_arguments())

    def world() -> Sequence[str]:
        return scm("world", "--hosted", str(hosted), *latched.world_arguments())

    def part(name: str, what: str, *more: str) -> Job:
        return Job(name, "part", what, lambda: scm(name, *more))

    return [
        Job("record", "part", f"everything on the bus into {record_dir}/", record, last=True),
        part("traffic", "signals: safe kernel, plans"),
        Job("monitor", "part", "second channel: doubts the signals, latches flash", monitor),
        Job("world", "part", f"cars, walls, sensors, radio; {hosted} hosted", world),
        part("eye", "overhead camera: frames, tags, poses"),
        part("api", "REST, event stream, dashboard", "--host", HOST, "--port", str(port)),
    ]


def _agents(city: str, endpoint: str, hosted: int, agents: int) -> list[Job]:
    def join(name: str) -> Sequence[str]:
        program = (sys.executable, "-m", "vehicle_agent", "join")
        return [*program, "--name", name, "--connect", endpoint, "--city", city]

    # After the world: it compiles the physics, and they find it compiled.
    return [
        Job(name, "v", "vehicle agent: a car of its own", partial(join, name), after="world")
        for name in (f"n{hosted + i + 1}" for i in range(agents))
    ]


def _tell_next(
    say: Say, city: str, endpoint: str, port: int, next_car: int, record_dir: Path
) -> None:
    at = f"--connect {endpoint}" + ("" if city == "city" else f" --city {city}")
    say(f"dashboard: http://{HOST}:{port}")
    say("try next:")
    say(f"  vehicle-agent join --name n{next_car} {at}      another car")
    say("  ls examples/        scripts that spawn, route and time cars")
    say(f"  scm recover {record_dir}/<file>.mcap        mend a recording that was cut off")
    say("Ctrl-C stops the city")


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
