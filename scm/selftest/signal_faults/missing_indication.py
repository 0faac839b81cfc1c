"""All lamps of a group are out."""

from scm.selftest.signal_fault import Bend, SignalFault, recolour
from scm.traffic.conflict_table import Card
from scm.v2x.messages.spat import Spat


def _bends(card: Card) -> Bend:
    def bend(spat: Spat) -> Spat:
        return recolour(spat, {card.groups[0].name: "dark"})

    return bend


FAULT = SignalFault(what="missing indication", expects=("dark",), bends=_bends)
