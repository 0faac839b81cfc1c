"""The controller's clock jumps two seconds ahead."""

import msgspec

from scm.clock import NS_PER_S
from scm.selftest.signal_fault import OutputFault, SignalFault
from scm.traffic.monitor.conflict_table import ConflictTable
from scm.v2x.messages.spat import Spat

JUMP_NS = 2 * NS_PER_S


def _output_fault(table: ConflictTable) -> OutputFault:
    del table

    def output_fault(spat: Spat) -> Spat:
        return msgspec.structs.replace(spat, t_ns=spat.t_ns + JUMP_NS)

    return output_fault


FAULT = SignalFault(what="clock jumps forward", expects=("clock_jump",), output=_output_fault)
