"""The dashboard and REST of a city in lockstep, in the same process."""

import threading
from collections.abc import Iterable
from pathlib import Path

from scm.api.app import create_app
from scm.api.based import Site
from scm.api.city import Link
from scm.api.folders import folders_in
from scm.api.server import serve
from scm.api.trace import traced
from scm.api.view import CityView
from scm.api.wire import BusWire
from scm.clock import WallClock
from scm.errors import RunError
from scm.records.city_map import CityMap
from scm.registry import names
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Part
from scm.store.repository import Repository
from scm.v2x.faults import Faults
from scm.v2x.message import Message, Request

START_S = 120.0


class LockstepPages:
    """Serves pages of a city; whoever moves it holds `lock` meanwhile, as their requests move it.

    Args:
        city: The city, with `view` among its parts.
        view: What is shown.
        city_map: Of the city.
        folder: Of recordings, reports and the like.
        lock: Held by whoever moves the city.
        state: The city's store; None: a new one in memory.
        site: Where people find the pages.
        port: 0 takes a free one.

    Attributes:
        url: Where they are.

    Raises:
        RunError: when they cannot be served.
    """

    def __init__(
        self,
        city: Lockstep,
        view: CityView,
        city_map: CityMap,
        folder: Path,
        lock: "threading.Lock | threading.RLock",
        *,
        state: Repository | None = None,
        site: Site | None = None,
        port: int = 0,
    ) -> None:
        self._city, self._lock, self.url = city, lock, ""
        self._stop, self._is_served = threading.Event(), threading.Event()
        self._failures: list[Exception] = []
        shipped = names("scm.traffic.signals.plans")
        self._app = create_app(
            view,
            self._request,
            city_map,
            folders=folders_in(folder),
            plans={junction.name: shipped for junction in city_map.junctions},
            site=site or Site(),
            state=state,
            link=Link(wire=BusWire(city.bus)),
        )
        self._thread = threading.Thread(target=self._serve, args=(port,), name="pages")
        self._thread.start()
        if not self._is_served.wait(START_S) or self._failures:
            self.close()
            raise RunError(f"the pages are not served: {self._failures or 'no answer'}")

    def close(self) -> None:
        """End serving."""
        self._stop.set()
        self._thread.join(10.0)

    def _serve(self, port: int) -> None:
        try:
            serve(self._app, "127.0.0.1", port, self._stop, on_ready=self._ready)
        except Exception as cause:  # noqa: BLE001  the edge of a thread
            self._failures.append(cause)
        finally:
            self._is_served.set()

    def _ready(self, url: str) -> None:
        self.url = url
        self._is_served.set()

    def _request(self, request: Request, timeout_s: float) -> Message:
        with self._lock:
            return self._city.call(traced(request), timeout_s)


class WatchedLockstep(Lockstep):
    """A city in lockstep that takes its time, so that people can watch it.

    Its steps are those of any lockstep city; only how long they take differs.

    Args:
        parts: In the order of their steps.
        faults: Of the network between the parts; None: nothing is lost or late.
        speed: Seconds of the city per second of the clock on the wall.

    Attributes:
        lock: Held during each instant.
    """

    def __init__(
        self, parts: Iterable[Part], faults: Faults | None = None, speed: float = 1.0
    ) -> None:
        super().__init__(parts, faults=faults)
        self.lock = threading.RLock()
        self._speed, self._wall, self._never = speed, WallClock(), threading.Event()
        self._began_ns, self._wall_ns = self.now_ns, self._wall.now_ns()

    def close(self) -> None:
        """Stay as it is: people still look at it. `end` ends it."""

    def end(self) -> None:
        """Let every part finish."""
        with self.lock:
            super().close()

    def stand(self) -> None:
        """Stand still: only what the pages request moves it from now on."""
        self._speed = 0.0

    def _instant(self, t_ns: int) -> None:
        if self._speed > 0.0:
            due_ns = self._wall_ns + round((t_ns - self._began_ns) / self._speed)
            self._wall.wait_until(due_ns, self._never)
        with self.lock:
            super()._instant(t_ns)
