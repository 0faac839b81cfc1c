"""Two that would collide both have green."""

from scm.selftest.signal_fault import Bend, SignalFault, long_green, recolour, rivals
from scm.traffic.card import Card
from scm.v2x.messages.spat import Spat


def _bends(card: Card) -> Bend:
    def bend(spat: Spat) -> Spat:
        green = long_green(spat)
        return spat if green is None else recolour(spat, {rivals(card, green.group)[0]: "green"})

    return bend


FAULT = SignalFault(what="conflicting greens", expects=("conflict",), bends=_bends)
