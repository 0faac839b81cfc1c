"""A private city for fault injection: a router and every part, each a process of its own."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from scm.clock import NS_PER_MS, WallClock, nanoseconds
from scm.errors import LinkError, RunError
from scm.eye.station import eye_station
from scm.maps.load import load_map
from scm.runtime.parent_watch import with_parent
from scm.runtime.supervisor import Job, Supervisor
from scm.selftest.proxy import FaultyProxy
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.presence import Presence
from scm.v2x.router import free_endpoint

CITY = "selftest"
START_S = 90.0
LOOK_EVERY_NS = 20 * NS_PER_MS
SIGNALS_ONLY = ("traffic", "monitor", "world")
ROUTER = "router"


class City:
    """A context manager that runs the city and restarts what dies; the router on request.

    Attributes:
        endpoint: Of its router.
        output: The lines that its supervisor printed.
        port: Of its web address; 0: any.
        folder: Where it records.
        proxies: Of the stations that connect through one, to be stalled and cut.
    """

    def __init__(
        self,
        map_name: str,
        folder: Path,
        parts: Sequence[str] | None = None,
        *,
        hosted: int = 2,
        agents: Sequence[str] = (),
        port: int = 0,
        behind: Sequence[str] = (),
    ) -> None:
        """Prepare.

        Args:
            map_name: Of the map.
            folder: Where it records.
            parts: Only these; None: all.
            hosted: Cars of the world's own.
            agents: Names of cars that are processes of their own.
            port: Of the web address.
            behind: Those that reach the router through a proxy of their own.
        """
        self.endpoint = free_endpoint()
        self.output: list[str] = []
        self.port = port
        self._map, self.folder, self._hosted = map_name, folder, hosted
        self.proxies = {name: FaultyProxy(self.endpoint) for name in behind}
        self._number = 0
        jobs = [job for job in self._jobs() if parts is None or job.name in parts]
        self._supervisor = Supervisor(
            [*jobs, *(self._agent(name) for name in agents)], WallClock(), self.output.append
        )
        self._router: subprocess.Popen[bytes] | None = None
        self._over, self._ready = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._keep, name="crew")

    @property
    def names(self) -> list[str]:
        """All processes except the router."""
        return list(self._supervisor.members)

    def pid(self, name: str) -> int:
        """Return the process id of a member, or of the router.

        Raises:
            RunError: when it is not running.
        """
        process = self._router if name == ROUTER else self._supervisor.members[name].process
        if process is None:
            msg = f"{name}: is not running"
            raise RunError(msg)
        return process.pid

    def send(self, name: str, number: signal.Signals) -> None:
        """Send a signal to a process."""
        os.kill(self.pid(name), number)

    def start_router(self) -> None:
        """Start the router again."""
        self.stop_router()
        program = [sys.executable, "-m", "scm.selftest.router", self.endpoint]
        self._router = subprocess.Popen(with_parent(program), start_new_session=True)

    def stop_router(self) -> None:
        """Kill the router."""
        if self._router is not None:
            self._router.kill()
            self._router.wait()
            self._router = None

    def __enter__(self) -> "City":
        self.start_router()
        for proxy in self.proxies.values():
            proxy.__enter__()
        self._thread.start()
        if not self._ready.wait(START_S):
            self.__exit__()
            msg = "the city did not come up:\n" + "\n".join(self.output)
            raise RunError(msg)
        return self

    def __exit__(self, *exc: object) -> None:
        self._over.set()
        self._thread.join()
        for proxy in self.proxies.values():
            proxy.__exit__()
        self.stop_router()

    def _keep(self) -> None:
        """Keep all processes alive; the thread that starts them must outlive them."""
        clock, presence = WallClock(), Mailbox(1000)
        try:
            with self._bus() as bus:
                bus.subscribe(Presence, {}, presence)
                while not clock.wait_until(clock.now_ns() + LOOK_EVERY_NS, self._over):
                    self._supervisor.poll()
                    for item in presence.drain():
                        if isinstance(item.message, Presence):
                            self._supervisor.receive(item.message)
                    if self._supervisor.is_ready:
                        self._ready.set()
        finally:
            self._supervisor.stop()

    def _bus(self) -> ZenohBus:
        clock = WallClock()
        end_ns = clock.now_ns() + nanoseconds(20.0)
        while True:
            try:
                return ZenohBus(CITY, "crew", self.endpoint)
            except LinkError:
                if clock.now_ns() > end_ns:
                    raise

    def _jobs(self) -> list[Job]:
        cameras = [camera.name for camera in load_map(self._map).cameras]
        state = ("--state", f"sqlite:{self.folder / 'state.db'}")
        web = ("--host", "127.0.0.1", "--port", str(self.port))
        makes: dict[str, Callable[[], Sequence[str]]] = {
            "record": lambda: self._scm("record", "--out", self._recording()),
            "traffic": lambda: self._scm("traffic", *state),
            "monitor": lambda: self._scm("monitor", *state),
            "world": lambda: self._scm("world", *state, "--hosted", str(self._hosted)),
            **{
                eye_station(name, first=name == cameras[0]): partial(
                    self._scm, "eye", "--camera", name
                )
                for name in cameras
            },
            "camera": lambda: self._scm("camera"),
            "api": lambda: self._scm("api", *web),
        }
        return [
            Job(name, "part", name, make, last=name == "record") for name, make in makes.items()
        ]

    def _agent(self, name: str) -> Job:
        program = [sys.executable, "-m", "vehicle_agent", "--log", "error", "join", "--name", name]
        command = [*program, "--connect", self._door(name), "--city", CITY]
        return Job(name, "v", "vehicle agent", lambda: command, after="world")

    def _scm(self, part: str, *more: str) -> list[str]:
        shared = ("--connect", self._door(part), "--city", CITY)
        return [sys.executable, "-m", "scm", part, self._map, *shared, *more]

    def _door(self, name: str) -> str:
        proxy = self.proxies.get(name)
        return self.endpoint if proxy is None else proxy.listen

    def _recording(self) -> str:
        self._number += 1
        return str(self.recording)

    @property
    def recording(self) -> Path:
        """The file that is written now."""
        return self.folder / f"run-{self._number}.mcap"
