"""Inject each signal fault in turn and measure how long it takes until the signals flash.

A fault of the output is injected by a stand-in while the real controller is stopped; the time
counts from the first wrong thing shown. Flash counts from the monitor's verdict: every
car receives it and treats the junction as flashing red, whatever the controller still shows. A bar
is missed when that takes longer than a second, when the monitor reports another fault, or when
the city does not recover after a person's reset.
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
from scm.selftest.signal_fault import OutputFault, SignalFault
from scm.selftest.stand_in import StandIn
from scm.selftest.table import in_ms, in_s
from scm.traffic.monitor.conflict_table import conflict_table_of
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat

FAULTS = "scm.selftest.signal_faults"
BAR_NS = NS_PER_S
SHOWN_S = 30.0  # a whole cycle may pass before there is a yellow to cut short
BACK_S = 30.0
HANDOVER_S = 0.5
STEADY_NS = 600 * NS_PER_MS
HEAD = ("fault", "monitor reported", "flash after", "cars stop after", "recovered after", "")


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What came of one fault.

    Attributes:
        reported: The fault that the monitor reported; empty: none.
        flash_ns: From the fault to the verdict [ns]; None: never.
        red_ns: From the fault to the last moment a car took any signal for green [ns].
        back_ns: From the reset until the plan runs again [ns]; None: never.
        ok: Whether all bars are held.
    """

    what: str
    reported: str
    flash_ns: int | None
    red_ns: int
    back_ns: int | None
    ok: bool

    def row(self) -> tuple[str, ...]:
        """Return its row below `HEAD`."""
        reported, verdict = self.reported or "nothing", "ok" if self.ok else "MISSED"
        times = in_ms(self.flash_ns), in_ms(self.red_ns), in_s(self.back_ns)
        return (self.what, reported, *times, verdict)


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
        """Prepare to inject.

        Args:
            city_map: Whose first junction is disturbed.
            observer: Receives its messages.
            stand_in: Opens a controller to output_fault.
            controller: Sends a signal to the real controller's process.

        Raises:
            RunError: when the map has no signals.
        """
        if not city_map.junctions:
            msg = f"map {city_map.name}: has no signals to test"
            raise RunError(msg)
        self._conflict_table = conflict_table_of(city_map, city_map.junctions[0])
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
        if self._recover() is None:
            msg = (
                f"junction {self._junction}: got no steady signals within {BACK_S:g} s, expected "
                "their plan and a monitor without a fault before a fault is injected"
            )
            raise RunError(msg)
        for fault in chosen:
            if fault.process is not None:
                yield self._inject_process_fault(fault, fault.process)
        if any(fault.output for fault in chosen):
            with self._in_its_place() as stand_in:
                for fault in chosen:
                    if fault.output is not None:
                        yield self._inject_output_fault(
                            fault, fault.output(self._conflict_table), stand_in
                        )

    @contextmanager
    def _in_its_place(self) -> Iterator[StandIn]:
        self._controller(signal.SIGSTOP)
        try:
            with self._stand_in() as stand_in:
                self._wait_for_handover()
                yield stand_in
        finally:
            self._controller(signal.SIGCONT)
            self._wait_for_handover()

    def _wait_for_handover(self) -> None:
        """Let one controller follow another until nothing of the first is received of any more."""
        self._observer.listen(seconds(STEADY_NS) + HANDOVER_S)
        self._recover()

    def _inject_process_fault(self, fault: SignalFault, number: signal.Signals) -> Outcome:
        began_ns = self._observer.clock.now_ns()
        self._controller(number)
        reported, flash_ns = self._verdict(began_ns)
        red_ns = self._red_after(began_ns)
        if number == signal.SIGSTOP:
            self._controller(signal.SIGCONT)
        return self._outcome(fault, reported, flash_ns, red_ns)

    def _inject_output_fault(
        self, fault: SignalFault, output_fault: OutputFault, stand_in: StandIn
    ) -> Outcome:
        part = stand_in.part
        requested_ns = self._observer.clock.now_ns()
        part.first_fault_ns, part.output_fault = None, output_fault
        self._observer.wait(lambda: part.first_fault_ns is not None, SHOWN_S)
        began_ns = requested_ns if part.first_fault_ns is None else part.first_fault_ns
        reported, flash_ns = self._verdict(began_ns)
        red_ns = self._red_after(began_ns)
        part.output_fault = None
        return self._outcome(fault, reported, flash_ns, red_ns)

    def _verdict(self, began_ns: int) -> tuple[str, int | None]:
        """Return the fault that the monitor reports, and how long after the injection."""

        def is_flash(status: MonitorStatus) -> bool:
            return status.junction == self._junction and status.fault is not None

        observer = self._observer
        observer.wait(
            lambda: observer.first_ns(MonitorStatus, began_ns, is_flash) is not None, SHOWN_S / 6
        )
        for arrived_ns, status in observer.received(MonitorStatus, began_ns):
            if is_flash(status):
                return status.fault or "", arrived_ns - began_ns
        return "", None

    def _red_after(self, began_ns: int) -> int:
        self._observer.listen(0.3)
        return max(0, self._observer.went_ns(self._junction) - began_ns)

    def _outcome(
        self, fault: SignalFault, reported: str, flash_ns: int | None, red_ns: int
    ) -> Outcome:
        back_ns = self._recover()
        in_time = flash_ns is not None and max(flash_ns, red_ns) <= BAR_NS
        ok = in_time and reported in fault.expects and back_ns is not None
        return Outcome(
            what=fault.what,
            reported=reported,
            flash_ns=flash_ns,
            red_ns=red_ns,
            back_ns=back_ns,
            ok=ok,
        )

    def _recover(self) -> int | None:
        """Reset the monitor until the signals run their plan; return how long it took."""
        observer = self._observer
        began_ns = observer.clock.now_ns()
        while observer.clock.now_ns() - began_ns < BACK_S * NS_PER_S:
            if self._is_faulty():
                self._reset()
            if observer.wait(self._is_steady, 1.0):
                return observer.clock.now_ns() - began_ns
        return None

    def _reset(self) -> None:
        reset = MonitorReset(
            junction=self._junction,
            by="selftest",
            reason="the injected fault is over",
            request_id=uuid.uuid4().hex,
        )
        self._observer.request(reset)
        self._observer.listen(0.2)

    def _is_faulty(self) -> bool:
        statuses = self._observer.received(MonitorStatus)
        return any(s.fault is not None for _, s in statuses[-8:] if s.junction == self._junction)

    def _is_steady(self) -> bool:
        """Return whether plan and monitor have been fault-free for a while, by recent messages."""
        since_ns = self._observer.clock.now_ns() - STEADY_NS
        shown = [
            s for _, s in self._observer.received(Spat, since_ns) if s.junction == self._junction
        ]
        statuses = [
            s
            for _, s in self._observer.received(MonitorStatus, since_ns)
            if s.junction == self._junction
        ]
        runs = len(shown) >= 3 and all(spat.mode == "plan" for spat in shown)
        no_fault = bool(statuses) and all(status.fault is None for status in statuses)
        # A busy observer may receive old messages, and a busy monitor judge them.
        return runs and no_fault and min(shown[-1].t_ns, statuses[-1].t_ns) > since_ns
