"""Run many parts in one process on a stepped clock: the same city, repeatable bit for bit.

Steps happen in order of (time due, order of adding). What a part sends at a step reaches the
inboxes of all steps after it, those of the same instant included.
"""

import heapq
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import Self

from scm.clock import StepClock, nanoseconds, seconds
from scm.errors import RunError
from scm.runtime.part import Part, Subscription
from scm.runtime.station import Station
from scm.store.repository import Repository
from scm.v2x.bus import Mailbox
from scm.v2x.bus_memory import MemoryBus, MemoryNetwork
from scm.v2x.exchange import Call, Incoming
from scm.v2x.faults import Faults
from scm.v2x.message import Message, Request
from scm.v2x.write_ahead import DirectWriter

SCRIPT_MAILBOX_DEPTH = 1_000_000  # a script that runs for hours and then drains loses nothing


class Lockstep:
    """A city of parts on a memory bus; a context manager that lets every part finish.

    Args:
        parts: In the order of their steps.
        city: Chunk of all keys, unless `add` names another city for a part.
        start_ns: Of its clock.
        faults: Of the network between the parts; None: nothing is lost or late.

    Attributes:
        clock: The time of the city.
        bus: The script's own connection, station `script`: to publish, or to call without waiting.
    """

    def __init__(
        self,
        parts: Iterable[Part],
        city: str = "city",
        start_ns: int = 0,
        faults: Faults | None = None,
    ) -> None:
        self.clock = StepClock(start_ns)
        self._city = city
        self._network = MemoryNetwork(self.clock, faults)
        self.bus: MemoryBus = self._network.bus(city, "script")
        self._running: dict[int, _Running] = {}
        self._due: list[tuple[int, int]] = []
        self._added = 0
        for part in parts:
            self.add(part)

    @property
    def now_ns(self) -> int:
        """The time of the city [ns]."""
        return self.clock.now_ns()

    def add(self, part: Part, state: Repository | None = None, city: str = "") -> None:
        """Add a part; its first step is due now.

        Args:
            part: The part.
            state: Stores what must outlive it.
            city: The city that it belongs to, where several share one clock and one network.
        """
        bus = self._network.bus(city or self._city, part.name)
        keeper = None if state is None else DirectWriter(state, part.name, bus.session)
        self._running[self._added] = _Running(part, bus, Station(part, bus, keeper))
        heapq.heappush(self._due, (self.now_ns, self._added))
        self._added += 1

    def remove(self, part: Part) -> None:
        """Let a part finish, and remove it.

        Raises:
            RunError: when it is not running.
        """
        self._pop(part).leave(self.now_ns)

    def kill(self, part: Part) -> None:
        """Remove a part without letting it finish, as a SIGKILL would.

        Raises:
            RunError: when it is not running.
        """
        self._pop(part).die()

    def _pop(self, part: Part) -> "_Running":
        order = next((n for n, running in self._running.items() if running.part is part), None)
        if order is None:
            msg = f"{part.name} is not running: it was removed already, or never added"
            raise RunError(msg)
        return self._running.pop(order)

    def publish(self, message: Message) -> None:
        """Send a message from the script."""
        self.bus.publish(message)

    def subscribe(
        self,
        subscription: Subscription,
        keep: Callable[[Incoming], bool] | None = None,
        city: str = "",
    ) -> Mailbox:
        """Return a mailbox that collects what matches from now on, for the script to drain.

        Args:
            subscription: Which messages.
            keep: Which of these are wanted; None: all.
            city: The city that sends them, where several run; empty: the first one.
        """
        mailbox = Mailbox(SCRIPT_MAILBOX_DEPTH, keep=keep)
        bus = self._network.bus(city, "script") if city else self.bus
        bus.subscribe(subscription.kind, subscription.where, mailbox)
        return mailbox

    def run_for(self, span_s: float) -> None:
        """Run every step that is due within the next `span_s`, its end included."""
        self._run(self.now_ns + nanoseconds(span_s), lambda: False)

    def run_until(self, condition: Callable[[], bool], timeout_s: float, what: str = "") -> None:
        """Run instant by instant until the condition holds.

        Args:
            condition: Checked before the first and after every instant.
            timeout_s: Of the city's time.
            what: The condition in words, for the error: `n1 waits at the red light`.

        Raises:
            RunError: when the time is up.
        """
        began_ns = self.now_ns
        if not self._run(began_ns + nanoseconds(timeout_s), condition):
            awaited = what or getattr(condition, "__name__", repr(condition))
            msg = (
                f"did not happen within {timeout_s} s of the city's time "
                f"(from {seconds(began_ns):.3f} s to {seconds(self.now_ns):.3f} s): {awaited}; "
                f"running: {', '.join(r.part.name for r in self._running.values()) or 'nobody'}"
            )
            raise RunError(msg)

    def call(self, request: Request, timeout_s: float = 5.0) -> Message:
        """Send a request, run the city until the reply or a `Refused` arrives, and return it."""
        replies: list[Incoming] = []
        self.bus.call(Call(request, timeout_s), replies.append)
        self._run(self.now_ns + nanoseconds(timeout_s), lambda: bool(replies))
        self._network.expire()
        return replies[0].message

    def close(self) -> None:
        """Let every part finish, the last one added first; safe to call twice."""
        while self._running:
            self._running.popitem()[1].leave(self.now_ns)
        self.bus.close()

    def _run(self, until_ns: int, condition: Callable[[], bool]) -> bool:
        while not condition():
            if not self._due or self._due[0][0] > until_ns:
                self.clock.set_ns(until_ns)
                return condition()
            self._instant(self._due[0][0])
        return True

    def _instant(self, t_ns: int) -> None:
        """Make all steps that are due at one time."""
        self.clock.set_ns(t_ns)
        self._network.expire()
        while self._due and self._due[0][0] == t_ns:
            _, order = heapq.heappop(self._due)
            running = self._running.get(order)
            if running is not None:
                running.step(t_ns)
                heapq.heappush(self._due, (t_ns + running.part.period_ns, order))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class _Running:
    """A part at its memory bus."""

    def __init__(self, part: Part, bus: MemoryBus, station: Station) -> None:
        self.part = part
        self._bus = bus
        self._station = station

    def step(self, now_ns: int) -> None:
        try:
            self._station.send(self.part.step(now_ns, self._station.inbox()))
        except Exception as cause:
            cause.add_note(f"in the step of {self.part.name} at {seconds(now_ns):.3f} s")
            raise

    def leave(self, now_ns: int) -> None:
        with self._bus:
            self._station.send(self.part.finish(now_ns))
            self._station.close()

    def die(self) -> None:
        self._bus.close()
