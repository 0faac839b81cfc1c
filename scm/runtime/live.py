"""Run one part on a real bus and clock: one process, one loop, steps on absolute deadlines.

The loop decides nothing. A step that is due while the last one still runs is not made up for: the
part simply sees more time pass, and the lateness is counted and reported.
"""

import gc
import logging
import signal
import threading
from types import FrameType

import msgspec

from scm.clock import NS_PER_MS, NS_PER_S, Clock, next_tick_ns
from scm.errors import LinkError, ScmError
from scm.log import event
from scm.runtime.part import Part
from scm.runtime.station import Station
from scm.store.repository import Repository
from scm.v2x.bus import Bus
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.write_ahead import BackgroundWriter

_log = logging.getLogger(__name__)


def run(
    part: Part,
    bus: Bus,
    clock: Clock,
    stop: threading.Event,
    state: Repository | None = None,
    *,
    on_tick: bool = False,
) -> None:
    """Step a part until `stop` is set, then let it finish and close the bus.

    With a store, answers leave only when they and the state behind them are in it. `on_tick` aligns
    the steps with the ticks of the clock, for parts of which a city has many: on all computers with
    synchronised clocks their messages arrive together and wake the router less often.

    `PartStatus` goes out once a second, merged into the part's own one if it sends it. An exception
    of the part is logged, published as a `CityEvent` and raised: the process should die.
    """
    with bus:
        keeper = None if state is None else BackgroundWriter(state, part.name, bus.session)
        begin_ns = next_tick_ns(clock.now_ns()) if on_tick else clock.now_ns()
        loop = _Loop(part, Station(part, bus, keeper), clock, begin_ns)
        try:
            while not clock.wait_until(loop.due_ns, stop):
                loop.step()
            loop.finish()
        except Exception as cause:
            trace = None if isinstance(cause, ScmError) else cause  # bad input needs no place
            _log.error("part_failed part=%s reason=%s", part.name, cause, exc_info=trace)
            _publish_failure(part, bus, clock, cause)
            raise


def stop_on_signal() -> threading.Event:
    """Return an event that SIGINT and SIGTERM set; a second signal ends the process at once.

    Call it from the main thread.
    """
    stop = threading.Event()

    def on_signal(number: int, _frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_DFL)
        # The main thread may hold the event's lock just now: let another one set it.
        threading.Thread(target=stop.set, daemon=True).start()

    signal.signal(signal.SIGINT, on_signal)
    signal.signal(signal.SIGTERM, on_signal)
    return stop


class _Loop:
    """The steps of one part, when the next is due, and its timing statistics."""

    def __init__(self, part: Part, station: Station, clock: Clock, begin_ns: int) -> None:
        self._part = part
        self._station = station
        self._clock = clock
        self.due_ns = begin_ns
        self._status_due_ns = self.due_ns + NS_PER_S
        self._steps = 0
        self._late_steps = 0
        self._slowest_ns = 0
        self._is_first = True

    def step(self) -> None:
        """Make the step that is due, and skip those that are overdue as well."""
        began_ns = self._clock.now_ns()
        outbox = self._part.step(began_ns, self._station.inbox())
        ended_ns = self._clock.now_ns()
        self._slowest_ns = max(self._slowest_ns, ended_ns - began_ns)
        self._station.send(self._with_vital_signs(outbox, ended_ns))
        if self._is_first:
            self._is_first = False
            gc.collect()
            gc.freeze()  # what is there by now stays: to walk over it again makes steps late
        overdue = (began_ns - self.due_ns) // self._part.period_ns
        self._steps += 1
        self._late_steps += overdue
        self.due_ns += (overdue + 1) * self._part.period_ns

    def finish(self) -> None:
        """Send the part's last messages."""
        self._station.send(self._part.finish(self._clock.now_ns()))
        self._station.close()

    def _with_vital_signs(self, outbox: list[Outgoing], now_ns: int) -> list[Outgoing]:
        own = [item for item in outbox if isinstance(item, PartStatus)]
        if not own and now_ns < self._status_due_ns:
            return outbox
        status = own[-1] if own else PartStatus(station=self._part.name, t_ns=now_ns)
        status = msgspec.structs.replace(
            status,
            step_ms=self._slowest_ns / NS_PER_MS,
            steps=self._steps,
            late_steps=self._late_steps,
            dropped=self._station.dropped,
        )
        self._slowest_ns = 0
        self._status_due_ns = now_ns + NS_PER_S
        return [item for item in outbox if not isinstance(item, PartStatus)] + [status]


def _publish_failure(part: Part, bus: Bus, clock: Clock, cause: Exception) -> None:
    text = f"{part.name} stopped: {type(cause).__name__}: {cause}"
    try:
        bus.publish(
            CityEvent(
                severity="error",
                source=part.name,
                t_ns=clock.now_ns(),
                name="part_failed",
                text=text,
            )
        )
    except LinkError as closed:
        event(_log, "failure_not_published", level=logging.WARNING, part=part.name, reason=closed)
