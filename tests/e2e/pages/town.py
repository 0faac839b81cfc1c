"""A city in lockstep behind its real pages: all of one process, as fast as the clock on the wall.

Where the machine is busy the city's time goes slower instead of parts coming late, so nothing is
latched; and it starts in a second.
"""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from scm.api.app import create_app
from scm.api.based import Site
from scm.api.city import Link
from scm.api.folders import folders_in
from scm.api.server import serve
from scm.api.trace import traced
from scm.api.view import CityView
from scm.api.wire import BusWire
from scm.camera.part import CameraPart
from scm.clock import nanoseconds
from scm.eye.part import EyePart
from scm.maps.load import load_map
from scm.recorder.part import RecorderPart
from scm.records.city_map import CityMap
from scm.registry import names
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Part
from scm.store.memory import MemoryStore
from scm.traffic.misbehaviour.part import MisbehaviourPart
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.observation.part import ObserverPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.message import Message, Request
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart

BEFORE_S = 150.0  # for the signals alone: what the pages show of the past
ALONE_S = 1.0  # recorded without a car or a picture, as while a real city starts
DRIVEN_S = 15.0  # by all cars, before anybody looks: it is recorded and pictured
PIECE_S = 0.05
BEGIN_NS = 1_800_000_000_000_000_000
BEFORE_NS = nanoseconds(BEFORE_S + ALONE_S + DRIVEN_S)


class Town:
    """Signals, monitor, world and pages of a map.

    A `whole` one has all parts that `scm up` starts, two agents, and its file of recordings.
    """

    def __init__(
        self, city_map: CityMap, folder: Path, cars: int, base: str, *, whole: bool
    ) -> None:
        self.folder, view, store = folder, CityView(), MemoryStore()
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._ready = threading.Event()
        begin_ns = time.time_ns() - BEFORE_NS if whole else BEGIN_NS  # the audit has two clocks
        self.city = Lockstep(start_ns=begin_ns, parts=())
        for part in (TrafficPart(city_map), MonitorPart(city_map)):
            self.city.add(part, store)
        self.city.add(view)
        self.city.run_for(BEFORE_S)
        if whole:
            self.city.add(RecorderPart(folder / "city.mcap"))
            self.city.run_for(ALONE_S)
        hosted = tuple((f"n{number}", "nigel") for number in range(1, cars + 1))
        self.city.add(WorldPart(city_map, hosted=hosted), store)
        if whole:
            self._add_others(city_map, cars, store)
            self.city.run_for(DRIVEN_S)
        plans = {
            junction.name: names("scm.traffic.signals.plans") for junction in city_map.junctions
        }
        folders, site = folders_in(folder), Site(base)
        link = Link(wire=BusWire(self.city.bus))
        app = create_app(
            view,
            self._ask,
            city_map,
            folders=folders,
            plans=plans,
            site=site,
            state=store,
            link=link,
        )
        self._threads = [
            threading.Thread(target=self._drive),
            threading.Thread(
                target=serve,
                args=(app, "127.0.0.1", 0, self._stop),
                kwargs={"on_ready": self._served},
            ),
        ]
        for thread in self._threads:
            thread.start()
        assert self._ready.wait(120.0), "the pages are not served"

    def _add_others(self, city_map: CityMap, cars: int, store: MemoryStore) -> None:
        for part in (
            EyePart(city_map),
            CameraPart(city_map),
            ObserverPart(city_map),
            MisbehaviourPart(city_map),
        ):
            self.city.add(part, store)
        for number in (cars + 1, cars + 2):
            self.city.add(AgentPart(f"n{number}"))

    def get(self, path: str) -> Any:
        """Return the JSON of a resource."""
        answer = self.web.get(path)
        answer.raise_for_status()
        return answer.json()

    @contextmanager
    def joined(self, part: Part) -> Iterator[None]:
        """Have another part in the city."""
        with self._lock:
            self.city.add(part)
        try:
            yield
        finally:
            with self._lock:
                self.city.remove(part)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Let the city stand still: other work gets its processor time."""
        with self._lock:
            yield

    def close(self) -> None:
        """End all of it."""
        self._stop.set()
        for thread in self._threads:
            thread.join(10.0)
        self.city.close()
        self.web.close()

    def _served(self, url: str) -> None:
        self.url = url
        self.web = httpx.Client(base_url=url + "/api/v1", timeout=60.0)
        self._ready.set()

    def _ask(self, request: Request, timeout_s: float) -> Message:
        with self._lock:
            return self.city.call(traced(request), timeout_s)

    def _drive(self) -> None:
        due_s = time.monotonic()
        while not self._stop.is_set():
            with self._lock:
                self.city.run_for(PIECE_S)
            due_s = max(due_s + PIECE_S, time.monotonic() - 1.0)
            self._stop.wait(max(0.0, due_s - time.monotonic()))


@contextmanager
def town(
    map_name: str, folder: Path, cars: int = 2, base: str = "", *, whole: bool = False
) -> Iterator[Town]:
    """Run a town for tests, of a map's name or file, its pages below the path `base`."""
    running = Town(load_map(map_name), folder, cars, base, whole=whole)
    try:
        yield running
    finally:
        running.close()
