"""Two conflicting groups turn green and stay green."""

from scm.records.signals import Colour
from scm.selftest.signal_fault import (
    OutputFault,
    SignalFault,
    conflicting_groups,
    long_green,
    recolour,
)
from scm.traffic.monitor.conflict_table import ConflictTable
from scm.v2x.messages.spat import Spat


def _output_fault(table: ConflictTable) -> OutputFault:
    stuck: dict[str, Colour] = {}

    def output_fault(spat: Spat) -> Spat:
        green = None if stuck else long_green(spat)
        if green is not None:
            other = conflicting_groups(table, green.group)[0]
            stuck.update({green.group: "green", other: "green"})
        return recolour(spat, stuck)

    return output_fault


FAULT = SignalFault(what="conflicting greens", expects=("conflict",), output=_output_fault)
