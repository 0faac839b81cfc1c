"""Each shipped fault of the output, injected into a controller in memory, is found by its name."""

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.maps.load import load_map
from scm.registry import load, names
from scm.selftest.signal_fault import SignalFault
from scm.selftest.signals import FAULTS, Outcome
from scm.selftest.stand_in import BentTraffic
from scm.selftest.table import markdown_table, text_table
from scm.traffic.conflict_table import card_of
from scm.traffic.monitor import Monitor
from scm.v2x.exchange import Incoming
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat

CITY = load_map("driving_school")
(JUNCTION,) = CITY.junctions
CARD = card_of(CITY, JUNCTION)
STEP_NS = 100 * NS_PER_MS
WARM_NS, LONG_NS = 10 * NS_PER_S, 40 * NS_PER_S


def fault_of(name):
    return load(FAULTS, name, "FAULT", SignalFault)


BENT = [name for name in names(FAULTS) if fault_of(name).bends is not None]


def drive(bend, monitor, until_ns=LONG_NS):
    """Run a bent controller under a monitor; return when it was first wrong, and when found."""
    part = BentTraffic(CITY, JUNCTION.name)
    for t_ns in range(0, until_ns, STEP_NS):
        if t_ns == WARM_NS:
            part.bend = bend
        for item in part.step(t_ns, []):
            if isinstance(item, Spat):
                monitor.see(item, t_ns)
        monitor.tick(t_ns)
        if monitor.fault is not None:
            return part.bent_ns, t_ns
    return part.bent_ns, None


@pytest.mark.parametrize("name", BENT)
def test_it_is_found_by_its_name_within_a_second(name):
    fault, monitor = fault_of(name), Monitor(CARD, 0)
    bent_ns, found_ns = drive(fault.bends(CARD), monitor)
    assert monitor.fault in fault.expects
    assert found_ns - bent_ns <= NS_PER_S


def test_an_unbent_controller_is_believed():
    monitor = Monitor(CARD, 0)
    assert drive(None, monitor) == (None, None)


def test_flash_is_shown_unbent():
    part = BentTraffic(CITY, JUNCTION.name)
    part.bend = lambda spat: None
    verdict = MonitorStatus(junction=JUNCTION.name, t_ns=0, fault="conflict", since_ns=0)
    shown = part.step(0, [Incoming(verdict, 0)]) + part.step(STEP_NS, [])
    flashing = [item for item in shown if isinstance(item, Spat)][-1]
    assert {group.colour for group in flashing.groups} == {"flashing_red"}


def test_every_fault_says_what_it_is_and_how_it_is_injected():
    for name in names(FAULTS):
        fault = fault_of(name)
        assert fault.what
        assert fault.expects
        assert (fault.bends is None) != (fault.process is None)


def test_a_missed_bar_stands_in_both_tables():
    missed = Outcome(what="x", said="", flash_ns=None, red_ns=0, back_ns=None, ok=False)
    head = ("a", "b", "c", "d", "e", "f")
    for table in (text_table(head, [missed.row()]), markdown_table(head, [missed.row()])):
        assert "nothing" in table
        assert "MISSED" in table
