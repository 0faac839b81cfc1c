"""A rival gets green while those who went are not out of its way yet."""

from scm.clock import NS_PER_MS
from scm.selftest.signal_fault import Bend, SignalFault, recolour, rivals
from scm.traffic.conflict_table import Card
from scm.v2x.messages.spat import Spat


def _bends(card: Card) -> Bend:
    went: set[str] = set()
    early: list[str] = []

    def bend(spat: Spat) -> Spat:
        for group in spat.groups:
            just_red = group.colour == "red" and spat.t_ns - group.since_ns < 300 * NS_PER_MS
            if just_red and group.group in went and not early:
                early.append(rivals(card, group.group)[0])
            if group.colour in ("green", "yellow"):
                went.add(group.group)
        return recolour(spat, dict.fromkeys(early, "green"))

    return bend


FAULT = SignalFault(what="short clearance", expects=("short_clearance",), bends=_bends)
