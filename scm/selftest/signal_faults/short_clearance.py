"""A conflicting group turns green before the junction is clear."""

from scm.clock import NS_PER_MS
from scm.selftest.signal_fault import OutputFault, SignalFault, conflicting_groups, recolour
from scm.traffic.monitor.conflict_table import ConflictTable
from scm.v2x.messages.spat import Spat


def _output_fault(table: ConflictTable) -> OutputFault:
    went: set[str] = set()
    early: list[str] = []

    def output_fault(spat: Spat) -> Spat:
        for group in spat.groups:
            just_red = group.colour == "red" and spat.t_ns - group.since_ns < 300 * NS_PER_MS
            if just_red and group.group in went and not early:
                early.append(conflicting_groups(table, group.group)[0])
            if group.colour in ("green", "yellow"):
                went.add(group.group)
        return recolour(spat, dict.fromkeys(early, "green"))

    return output_fault


FAULT = SignalFault(what="short clearance", expects=("short_clearance",), output=_output_fault)
