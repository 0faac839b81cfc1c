"""A group shows red and green at once."""

import msgspec

from scm.selftest.signal_fault import OutputFault, SignalFault
from scm.traffic.monitor.conflict_table import ConflictTable
from scm.v2x.messages.spat import Spat


def _output_fault(table: ConflictTable) -> OutputFault:
    def output_fault(spat: Spat) -> Spat:
        red = [g for g in spat.groups if g.colour == "red" and g.group == table.groups[0].name]
        twice = tuple(msgspec.structs.replace(group, colour="yellow") for group in red)
        return msgspec.structs.replace(spat, groups=spat.groups + twice)

    return output_fault


FAULT = SignalFault(what="dual indication", expects=("dual",), output=_output_fault)
