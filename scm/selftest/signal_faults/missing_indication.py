"""All lamps of a group are out."""

from scm.selftest.signal_fault import OutputFault, SignalFault, recolour
from scm.traffic.monitor.conflict_table import ConflictTable
from scm.v2x.messages.spat import Spat


def _output_fault(table: ConflictTable) -> OutputFault:
    def output_fault(spat: Spat) -> Spat:
        return recolour(spat, {table.groups[0].name: "dark"})

    return output_fault


FAULT = SignalFault(what="missing indication", expects=("dark",), output=_output_fault)
