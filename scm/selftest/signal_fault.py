"""The contract of a signal fault: what it bends, or which signal its process gets.

One file in `scm/selftest/signal_faults/` is one fault. A fault of the output is a function from
what the controller meant to what is shown instead; it is injected by a stand-in in the
controller's place. A fault of the process is a signal to the real controller.
"""

from collections.abc import Callable
from dataclasses import dataclass
from signal import Signals

import msgspec

from scm.clock import NS_PER_MS
from scm.traffic.conflict_table import Card
from scm.v2x.messages.spat import Colour, SignalGroup, Spat

Bend = Callable[[Spat], Spat | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalFault:
    """One way in which signals fail.

    Attributes:
        what: In a few words for a person.
        expects: What the monitor may call it.
        bends: Makes the function that turns what was meant into what is shown, None for nothing;
            it is called anew for each injection, with the card of the junction.
        process: What the real controller's process gets instead.
    """

    what: str
    expects: tuple[str, ...]
    bends: Callable[[Card], Bend] | None = None
    process: Signals | None = None


def recolour(spat: Spat, colours: dict[str, Colour]) -> Spat:
    """Return what is shown with some groups in another colour."""
    groups = tuple(
        msgspec.structs.replace(group, colour=colours.get(group.group, group.colour))
        for group in spat.groups
    )
    return msgspec.structs.replace(spat, groups=groups)


def cut_short(colour: Colour, to: Colour, *, after_ms: int) -> Callable[[Card], Bend]:
    """Return a fault that ends each colour early; one that was there before is left as it is."""

    def bends(card: Card) -> Bend:
        del card
        began_ns: list[int] = []

        def bend(spat: Spat) -> Spat:
            began_ns.append(spat.t_ns)
            early = {
                group.group: to
                for group in spat.groups
                if group.colour == colour
                and group.since_ns > began_ns[0]
                and spat.t_ns - group.since_ns >= after_ms * NS_PER_MS
            }
            return recolour(spat, early)

        return bend

    return bends


def rivals(card: Card, group: str) -> list[str]:
    """Return the groups that may never go together with one."""
    return [a if b == group else b for a, b in card.conflicts if group in (a, b)]


def long_green(spat: Spat) -> SignalGroup | None:
    """Return a group that has been green for half a second; None: there is none."""
    lasted = (g for g in spat.groups if g.colour == "green")
    return next((g for g in lasted if spat.t_ns - g.since_ns >= 500 * NS_PER_MS), None)
