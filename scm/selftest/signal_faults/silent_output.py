"""The controller runs, but none of its output arrives."""

from scm.selftest.signal_fault import OutputFault, SignalFault
from scm.traffic.monitor.conflict_table import ConflictTable
from scm.v2x.messages.spat import Spat


def _output_fault(table: ConflictTable) -> OutputFault:
    del table

    def output_fault(spat: Spat) -> Spat | None:
        del spat
        return None

    return output_fault


FAULT = SignalFault(what="silent output", expects=("stale", "overload"), output=_output_fault)
