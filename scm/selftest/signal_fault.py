"""The contract of a signal fault: what it output, or which signal its process gets.

One file in `scm/selftest/signal_faults/` is one fault. A fault of the output is a function from
what the controller meant to what is shown instead; it is injected by a stand-in in the
controller's place. A fault of the process is a signal to the real controller.
"""

from collections.abc import Callable
from dataclasses import dataclass
from signal import Signals

import msgspec

from scm.clock import NS_PER_MS
from scm.records.signals import Colour, SignalGroup
from scm.traffic.monitor.conflict_table import ConflictTable
from scm.v2x.messages.spat import Spat

OutputFault = Callable[[Spat], Spat | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalFault:
    """One way in which signals fail.

    Attributes:
        what: A few words for a person.
        expects: What the monitor may call it.
        output: Makes the function that turns what was meant into what is shown, None for nothing;
            it is called once per injection, with the conflict table of the junction.
        process: What the real controller's process gets instead.
    """

    what: str
    expects: tuple[str, ...]
    output: Callable[[ConflictTable], OutputFault] | None = None
    process: Signals | None = None


def recolour(spat: Spat, colours: dict[str, Colour]) -> Spat:
    """Return the phases with some groups in another colour."""
    groups = tuple(
        msgspec.structs.replace(group, colour=colours.get(group.group, group.colour))
        for group in spat.groups
    )
    return msgspec.structs.replace(spat, groups=groups)


def cut_short(
    colour: Colour, to: Colour, *, after_ms: int
) -> Callable[[ConflictTable], OutputFault]:
    """Return a fault that ends each colour early, but not one that is already shown."""

    def output(table: ConflictTable) -> OutputFault:
        del table
        began_ns: list[int] = []

        def output_fault(spat: Spat) -> Spat:
            began_ns.append(spat.t_ns)
            early = {
                group.group: to
                for group in spat.groups
                if group.colour == colour
                and group.since_ns > began_ns[0]
                and spat.t_ns - group.since_ns >= after_ms * NS_PER_MS
            }
            return recolour(spat, early)

        return output_fault

    return output


def conflicting_groups(table: ConflictTable, group: str) -> list[str]:
    """Return the groups that must never be green together with one."""
    return [a if b == group else b for a, b in table.conflicts if group in (a, b)]


def long_green(spat: Spat) -> SignalGroup | None:
    """Return a group that has been green for half a second, or None."""
    lasted = (g for g in spat.groups if g.colour == "green")
    return next((g for g in lasted if spat.t_ns - g.since_ns >= 500 * NS_PER_MS), None)
