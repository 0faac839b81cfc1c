"""Inject each signal fault in turn and measure how long it takes until the signals flash.

A fault of the output is injected by a stand-in while the real controller is stopped; the time
counts from the first wrong thing shown. Flash is shown when the monitor's verdict is out: every
car hears it and takes the junction for flashing red, whatever the controller still says. A bar is
missed when that takes longer than a second, when the monitor calls it something else, or when the
city does not go on after a person's reset.
"""

import signal
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.errors import RunError
from scm.records.city_map import CityMap
from scm.registry import load, names
from scm.selftest.observer import Observer
from scm.selftest.signal_fault import Bend, SignalFault
from scm.selftest.stand_in import StandIn
from scm.selftest.table import in_ms, in_s
from scm.traffic.conflict_table import card_of
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat

FAULTS = "scm.selftest.signal_faults"
BAR_NS = NS_PER_S
SHOWN_S = 30.0  # a whole cycle may pass before there is a yellow to cut short
BACK_S = 30.0
TAKES_OVER_S = 0.5
CALM_NS = 600 * NS_PER_MS
HEAD = ("fault", "monitor said", "flash after", "cars stop after", "goes on after", "")


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What came of one fault.

    Attributes:
        said: What the monitor called it; empty: nothing.
        flash_ns: From the fault to the verdict [ns]; None: never.
        red_ns: From the fault to the last moment a car took any signal for green [ns].
        back_ns: From the reset until the plan runs again [ns]; None: never.
        ok: Whether all bars are held.
    """

    what: str
    said: str
    flash_ns: int | None
    red_ns: int
    back_ns: int | None
    ok: bool

    def row(self) -> tuple[str, ...]:
        """Return its row below `HEAD`."""
        said, verdict = self.said or "nothing", "ok" if self.ok else "MISSED"
        times = in_ms(self.flash_ns), in_ms(self.red_ns), in_s(self.back_ns)
        return (self.what, said, *times, verdict)


def faults_of(wanted: Sequence[str]) -> list[SignalFault]:
    """Return the faults of these names; of none: all.

    Raises:
        RunError: when one is not known.
    """
    return [load(FAULTS, name, "FAULT", SignalFault, RunError) for name in wanted or names(FAULTS)]


class SignalTrials:
    """Injects faults into one junction of a city."""

    def __init__(
        self,
        city_map: CityMap,
        observer: Observer,
        stand_in: Callable[[], StandIn],
        controller: Callable[[signal.Signals], None],
    ) -> None:
        """Take the city.

        Args:
            city_map: Whose first junction is disturbed.
            observer: Hears it.
            stand_in: Opens a controller to bend.
            controller: Sends a signal to the real controller's process.

        Raises:
            RunError: when the map has no signals.
        """
        if not city_map.junctions:
            msg = f"map {city_map.name}: has no signals to test"
            raise RunError(msg)
        self._card = card_of(city_map, city_map.junctions[0])
        self._junction = city_map.junctions[0].name
        self._observer = observer
        self._stand_in = stand_in
        self._controller = controller

    def run(self, wanted: Sequence[str] = ()) -> Iterator[Outcome]:
        """Inject the named faults, or all: first those of the process, then those of the output.

        Raises:
            RunError: when the signals do not run undisturbed before.
        """
        faults = {
            name: load(FAULTS, name, "FAULT", SignalFault, RunError) for name in names(FAULTS)
        }
        chosen = [load(FAULTS, name, "FAULT", SignalFault, RunError) for name in wanted or faults]
        if self._settle() is None:
            msg = (
                f"junction {self._junction}: got no calm signals within {BACK_S:g} s, expected "
                "their plan and a monitor that believes it before anything is disturbed"
            )
            raise RunError(msg)
        for fault in chosen:
            if fault.process is not None:
                yield self._hurt(fault, fault.process)
        if any(fault.bends for fault in chosen):
            with self._in_its_place() as stand_in:
                for fault in chosen:
                    if fault.bends is not None:
                        yield self._bend(fault, fault.bends(self._card), stand_in)

    @contextmanager
    def _in_its_place(self) -> Iterator[StandIn]:
        self._controller(signal.SIGSTOP)
        try:
            with self._stand_in() as stand_in:
                self._take_over()
                yield stand_in
        finally:
            self._controller(signal.SIGCONT)
            self._take_over()

    def _take_over(self) -> None:
        """Let one controller follow another until nothing of the first is heard of any more."""
        self._observer.listen(seconds(CALM_NS) + TAKES_OVER_S)
        self._settle()

    def _hurt(self, fault: SignalFault, number: signal.Signals) -> Outcome:
        began_ns = self._observer.clock.now_ns()
        self._controller(number)
        said, flash_ns = self._verdict(began_ns)
        red_ns = self._red_after(began_ns)
        if number == signal.SIGSTOP:
            self._controller(signal.SIGCONT)
        return self._outcome(fault, said, flash_ns, red_ns)

    def _bend(self, fault: SignalFault, bend: Bend, stand_in: StandIn) -> Outcome:
        part = stand_in.part
        asked_ns = self._observer.clock.now_ns()
        part.bent_ns, part.bend = None, bend
        self._observer.wait(lambda: part.bent_ns is not None, SHOWN_S)
        began_ns = asked_ns if part.bent_ns is None else part.bent_ns
        said, flash_ns = self._verdict(began_ns)
        red_ns = self._red_after(began_ns)
        part.bend = None
        return self._outcome(fault, said, flash_ns, red_ns)

    def _verdict(self, began_ns: int) -> tuple[str, int | None]:
        """Return what the monitor says, and how long after the fault."""

        def is_flash(status: MonitorStatus) -> bool:
            return status.junction == self._junction and status.fault is not None

        observer = self._observer
        observer.wait(
            lambda: observer.first_ns(MonitorStatus, began_ns, is_flash) is not None, SHOWN_S / 6
        )
        for arrived_ns, status in observer.heard(MonitorStatus, began_ns):
            if is_flash(status):
                return status.fault or "", arrived_ns - began_ns
        return "", None

    def _red_after(self, began_ns: int) -> int:
        self._observer.listen(0.3)
        return max(0, self._observer.went_ns(self._junction) - began_ns)

    def _outcome(self, fault: SignalFault, said: str, flash_ns: int | None, red_ns: int) -> Outcome:
        back_ns = self._settle()
        in_time = flash_ns is not None and max(flash_ns, red_ns) <= BAR_NS
        ok = in_time and said in fault.expects and back_ns is not None
        return Outcome(
            what=fault.what, said=said, flash_ns=flash_ns, red_ns=red_ns, back_ns=back_ns, ok=ok
        )

    def _settle(self) -> int | None:
        """Reset the monitor until the signals run their plan; return how long it took."""
        observer = self._observer
        began_ns = observer.clock.now_ns()
        while observer.clock.now_ns() - began_ns < BACK_S * NS_PER_S:
            if self._is_faulty():
                self._reset()
            if observer.wait(self._is_calm, 1.0):
                return observer.clock.now_ns() - began_ns
        return None

    def _reset(self) -> None:
        reset = MonitorReset(
            junction=self._junction,
            by="selftest",
            reason="the injected fault is over",
            request_id=uuid.uuid4().hex,
        )
        self._observer.ask(reset)
        self._observer.listen(0.2)

    def _is_faulty(self) -> bool:
        told = self._observer.heard(MonitorStatus)
        return any(s.fault is not None for _, s in told[-8:] if s.junction == self._junction)

    def _is_calm(self) -> bool:
        """Say whether the plan has run for a while, the monitor believes it, and both is news."""
        since_ns = self._observer.clock.now_ns() - CALM_NS
        shown = [s for _, s in self._observer.heard(Spat, since_ns) if s.junction == self._junction]
        told = [
            s
            for _, s in self._observer.heard(MonitorStatus, since_ns)
            if s.junction == self._junction
        ]
        runs = len(shown) >= 3 and all(spat.mode == "plan" for spat in shown)
        believed = bool(told) and all(status.fault is None for status in told)
        # A busy observer may hear what is long past, and a busy monitor judge it.
        return runs and believed and min(shown[-1].t_ns, told[-1].t_ns) > since_ns
