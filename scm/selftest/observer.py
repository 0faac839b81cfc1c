"""A station that only listens: what it receives, when, and what a car would conclude from it."""

import threading
from collections.abc import Callable
from typing import TypeVar, cast

from scm.clock import NS_PER_MS, WallClock, nanoseconds
from scm.records.city_map import CityMap
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.credentials import Credentials
from scm.v2x.exchange import Call, Incoming
from scm.v2x.message import Message, Request
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem import SpatemTx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.vehicles.drivers.signal_table import SignalTable

KINDS: tuple[type[Message], ...] = (
    *(Spat, MonitorStatus, SpatemTx, WorldSnapshot, CityEvent, Presence, VehicleState),
    PartStatus,
)
DEPTH = 100_000
LOOK_NS = 5 * NS_PER_MS

M = TypeVar("M", bound=Message)


class Observer:
    """Receives a city's messages; a context manager. All times are on its own clock.

    Attributes:
        clock: Its clock.
        bus: Its connection; for requests too.
    """

    def __init__(
        self,
        city_map: CityMap,
        endpoint: str,
        city: str,
        credentials: Credentials | None = None,
        *,
        name: str = "selftest",
    ) -> None:
        self.clock = WallClock()
        self.bus = ZenohBus(city, name, endpoint, credentials=credentials)
        self._boxes = {kind: Mailbox(DEPTH) for kind in KINDS}
        self._received: dict[type[Message], list[Incoming]] = {kind: [] for kind in KINDS}
        self._view = SignalTable(city_map)
        self._groups = [(j.name, group.name) for j in city_map.junctions for group in j.groups]
        self._went_ns: dict[str, int] = {}
        self._never = threading.Event()
        for kind, box in self._boxes.items():
            self.bus.subscribe(kind, {}, box)

    def __enter__(self) -> "Observer":
        return self

    def __exit__(self, *exc: object) -> None:
        self.bus.close()

    def look(self) -> None:
        """Process what arrived, and note which signals a car could pass now."""
        for kind, box in self._boxes.items():
            for item in box.drain():
                self._received[kind].append(item)
                self._show(item)
        now_ns = self.clock.now_ns()
        for junction, group in self._groups:
            if self._view.may_go(junction, group, now_ns):
                self._went_ns[junction] = now_ns

    def _show(self, item: Incoming) -> None:
        if isinstance(item.message, MonitorStatus):
            self._view.receive_monitor_status(item.message)
        elif isinstance(item.message, SpatemTx):
            self._view.receive_spatem(item.message.body, item.t_ns)

    def went_ns(self, junction: str) -> int:
        """Return when a car could last have passed a signal of a junction; 0 if never."""
        return self._went_ns.get(junction, 0)

    def wait(self, until: Callable[[], bool], timeout_s: float) -> bool:
        """Listen until a condition holds; return whether it does."""
        end_ns = self.clock.now_ns() + nanoseconds(timeout_s)
        while True:
            self.look()
            if until():
                return True
            now_ns = self.clock.now_ns()
            if now_ns >= end_ns:
                return False
            self.clock.wait_until(now_ns + LOOK_NS, self._never)

    def listen(self, span_s: float) -> None:
        """Listen for a while."""
        self.wait(lambda: False, span_s)

    def received(self, kind: type[M], since_ns: int = 0) -> list[tuple[int, M]]:
        """Return (arrival [ns], message) of a class, in order, from a time on."""
        found: list[tuple[int, M]] = []
        for item in reversed(self._received[kind]):
            if item.t_ns < since_ns:
                break
            found.append((item.t_ns, cast("M", item.message)))
        return found[::-1]

    def first_ns(self, kind: type[M], since_ns: int, of: Callable[[M], bool]) -> int | None:
        """Return when the first message of a class that matches arrived, or None."""
        return next((t_ns for t_ns, m in self.received(kind, since_ns) if of(m)), None)

    def request(self, request: Request, timeout_s: float = 2.0) -> Message | None:
        """Send a request and return the reply, or None; messages are received meanwhile."""
        answers: list[Message] = []
        self.bus.call(Call(request, timeout_s), lambda item: answers.append(item.message))
        self.wait(lambda: bool(answers), timeout_s + 1.0)
        return answers[0] if answers else None
