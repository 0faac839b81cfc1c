"""Measure what a fault does to a running city: who notices, when it is back, what is lost.

One fault at a time. A talker sends numbered events throughout; senders number every signal phase
and snapshot, so that losses can be counted.
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median

from scm.clock import NS_PER_MS, NS_PER_S, WallClock
from scm.selftest.observer import Observer
from scm.selftest.table import in_ms, in_s
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.message import Message
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import WorldSnapshot

TALK_NS = 200 * NS_PER_MS
HEAD = ("fault", "noticed after", "back after", "longest silence", "lost", "notes", "")
OWN: dict[str, type[Message]] = {
    "traffic": Spat,
    "monitor": MonitorStatus,
    "world": WorldSnapshot,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultOutcome:
    """What one fault did to the city.

    Attributes:
        noticed_ns: From the fault until the city was informed; None: never.
        back_ns: From the end of the fault until its stream was back; None: never.
        silence_ns: The longest time without a sample of that stream.
        lost: What of signal phases, snapshots and events never arrived.
        notes: Further facts for a person.
        missed: Which bar was missed; empty: none.
    """

    what: str
    noticed_ns: int | None = None
    back_ns: int | None = None
    silence_ns: int = 0
    lost: str = ""
    notes: str = ""
    missed: str = ""

    def row(self) -> tuple[str, ...]:
        """Return its row below `HEAD`."""
        times = in_ms(self.noticed_ns), in_s(self.back_ns), in_s(self.silence_ns)
        verdict = f"MISSED: {self.missed}" if self.missed else "ok"
        return (self.what, *times, self.lost, self.notes, verdict)

    def short_of(
        self, noticed_s: float | None = None, back_s: float | None = None
    ) -> "FaultOutcome":
        """Return it with the bars it missed."""
        missed = [self.missed] if self.missed else []
        for name, got_ns, bar_s in (
            ("noticed", self.noticed_ns, noticed_s),
            ("back", self.back_ns, back_s),
        ):
            if bar_s is not None and (got_ns is None or got_ns > bar_s * NS_PER_S):
                missed.append(f"{name} within {bar_s:g} s")
        return replace(self, missed=", ".join(missed))


class Talker:
    """A station that sends numbered events five times a second, from `with` on until its end."""

    def __init__(self, endpoint: str, city: str) -> None:
        self.sent: list[int] = []
        self._bus = ZenohBus(city, "talker", endpoint)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._talk, name="talker")

    def _talk(self) -> None:
        clock = WallClock()
        due_ns = clock.now_ns()
        while not clock.wait_until(due_ns, self._stop):
            now_ns = clock.now_ns()
            self._bus.publish(
                CityEvent(
                    severity="info",
                    source="talker",
                    t_ns=now_ns,
                    name="talk",
                    text=str(len(self.sent)),
                )
            )
            self.sent.append(now_ns)
            due_ns += TALK_NS

    def __enter__(self) -> "Talker":
        """Begin to talk."""
        self._thread.start()
        return self

    def __exit__(self, *exc: object) -> None:
        """Fall silent."""
        self._stop.set()
        self._thread.join()
        self._bus.close()


class StreamMonitor:
    """Counts and times the samples of a city's streams."""

    def __init__(self, observer: Observer, talker: Talker, agents: Sequence[str]) -> None:
        self.observer = observer
        self._talker = talker
        self._agents = tuple(agents)

    def arrivals(self, name: str, since_ns: int) -> list[int]:
        """Return when samples of the stream that a process is for came, from a time on [ns]."""
        observer = self.observer
        if name in self._agents:
            received = observer.received(VehicleState, since_ns)
            return [t_ns for t_ns, state in received if state.vehicle == name]
        if name in OWN:
            return [t_ns for t_ns, _ in observer.received(OWN[name], since_ns)]
        status = observer.received(PartStatus, since_ns)
        return [t_ns for t_ns, vital in status if vital.station == name]

    def gone_ns(self, name: str, since_ns: int) -> int | None:
        """Return when a station was reported gone; None: not yet."""
        return self.observer.first_ns(
            Presence, since_ns, lambda one: one.station == name and not one.alive
        )

    def wait_gone(self, name: str, since_ns: int, timeout_s: float) -> int | None:
        """Listen until a station is reported gone; return when, or None when it never was."""
        return self.wait(lambda: self.gone_ns(name, since_ns), timeout_s)

    def came_ns(self, name: str, since_ns: int) -> int | None:
        """Return when a station was reported present; None: not yet."""
        return self.observer.first_ns(
            Presence, since_ns, lambda one: one.station == name and one.alive
        )

    def silence_ns(self, name: str, since_ns: int) -> int:
        """Return the longest time between two samples of a stream until now [ns]."""
        times = [since_ns, *self.arrivals(name, since_ns), self.observer.clock.now_ns()]
        return max(b - a for a, b in pairwise(times))

    def lost(self, since_ns: int) -> str:
        """Return what was sent since then and never came, in words."""
        observer = self.observer
        observer.look()
        before_ns = since_ns - NS_PER_S
        phases = _missing([m.seq for _, m in observer.received(Spat, before_ns)])
        ticks = _missing([m.tick for _, m in observer.received(WorldSnapshot, before_ns)])
        return f"{phases} phases, {ticks} snapshots, {self.events_lost(since_ns)}"

    def events_lost(self, since_ns: int) -> str:
        """Return how many of the talker's events never came, in words."""
        received = self.observer.received(CityEvent, since_ns)
        texts = [m.text for _, m in received if m.source == "talker" and m.name == "talk"]
        got = {int(text) for text in texts if text.isascii() and text.isdecimal()}
        now_ns = self.observer.clock.now_ns()
        sent = {
            number
            for number, t_ns in enumerate(self._talker.sent)
            if since_ns < t_ns < now_ns - 2 * NS_PER_S
        }
        return f"{len(sent - got)} of {len(sent)} events"

    def wait(self, until: Callable[[], int | None], timeout_s: float) -> int | None:
        """Listen until a time is known; return it, or None when it never was."""
        self.observer.wait(lambda: until() is not None, timeout_s)
        return until()


def _missing(numbers: list[int]) -> int:
    """Return how many are left out of numbers that grow evenly; a new start is no gap."""
    steps = [b - a for a, b in pairwise(numbers) if b > a]
    if not steps:
        return 0
    usual = median(steps)
    return round(sum(step / usual - 1 for step in steps if step > 1.5 * usual))
