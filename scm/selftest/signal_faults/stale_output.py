"""The same old sample is sent again and again."""

from scm.selftest.signal_fault import OutputFault, SignalFault
from scm.traffic.monitor.conflict_table import ConflictTable
from scm.v2x.messages.spat import Spat


def _output_fault(table: ConflictTable) -> OutputFault:
    del table
    first: list[Spat] = []

    def output_fault(spat: Spat) -> Spat:
        first.append(spat)
        return first[0]

    return output_fault


FAULT = SignalFault(
    what="stale output, sent again", expects=("stale", "overload"), output=_output_fault
)
