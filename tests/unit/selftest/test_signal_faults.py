"""Each shipped fault of the output, injected into a controller in memory, is found by its name."""

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.maps.load import load_map
from scm.registry import load, names
from scm.selftest.signal_fault import SignalFault
from scm.selftest.signals import FAULTS, Outcome
from scm.selftest.stand_in import FaultyTraffic
from scm.selftest.table import markdown_table, text_table
from scm.traffic.monitor.checks import Monitor
from scm.traffic.monitor.conflict_table import conflict_table_of
from scm.v2x.exchange import Incoming
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat

CITY = load_map("driving_school")
(JUNCTION,) = CITY.junctions
CARD = conflict_table_of(CITY, JUNCTION)
STEP_NS = 100 * NS_PER_MS
WARM_NS, LONG_NS = 10 * NS_PER_S, 40 * NS_PER_S


def fault_of(name):
    return load(FAULTS, name, "FAULT", SignalFault)


WITH_OUTPUT_FAULT = [name for name in names(FAULTS) if fault_of(name).output is not None]


def drive(output_fault, monitor, until_ns=LONG_NS):
    """Run a faulty controller under a monitor; return when it was first wrong, and when found."""
    part = FaultyTraffic(CITY, JUNCTION.name)
    for t_ns in range(0, until_ns, STEP_NS):
        if t_ns == WARM_NS:
            part.output_fault = output_fault
        for item in part.step(t_ns, []):
            if isinstance(item, Spat):
                monitor.see(item, t_ns)
        monitor.tick(t_ns)
        if monitor.fault is not None:
            return part.first_fault_ns, t_ns
    return part.first_fault_ns, None


@pytest.mark.parametrize("name", WITH_OUTPUT_FAULT)
def test_it_is_found_by_its_name_within_a_second(name):
    fault, monitor = fault_of(name), Monitor(CARD, 0)
    first_fault_ns, found_ns = drive(fault.output(CARD), monitor)
    assert monitor.fault in fault.expects
    assert found_ns - first_fault_ns <= NS_PER_S


def test_a_controller_without_a_fault_raises_no_alarm():
    monitor = Monitor(CARD, 0)
    assert drive(None, monitor) == (None, None)


def test_flash_is_never_corrupted():
    part = FaultyTraffic(CITY, JUNCTION.name)
    part.output_fault = lambda spat: None
    verdict = MonitorStatus(junction=JUNCTION.name, t_ns=0, fault="conflict", since_ns=0)
    shown = part.step(0, [Incoming(verdict, 0)]) + part.step(STEP_NS, [])
    flashing = [item for item in shown if isinstance(item, Spat)][-1]
    assert {group.colour for group in flashing.groups} == {"flashing_red"}


def test_every_fault_has_a_description_and_one_way_of_injection():
    for name in names(FAULTS):
        fault = fault_of(name)
        assert fault.what
        assert fault.expects
        assert (fault.output is None) != (fault.process is None)


def test_a_missed_bar_stands_in_both_tables():
    missed = Outcome(what="x", reported="", flash_ns=None, red_ns=0, back_ns=None, ok=False)
    head = ("a", "b", "c", "d", "e", "f")
    for table in (text_table(head, [missed.row()]), markdown_table(head, [missed.row()])):
        assert "nothing" in table
        assert "MISSED" in table
