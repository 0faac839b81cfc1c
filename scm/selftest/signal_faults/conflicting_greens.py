"""Two that would collide both have green, and keep it."""

from scm.selftest.signal_fault import Bend, SignalFault, long_green, recolour, rivals
from scm.traffic.conflict_table import Card
from scm.v2x.messages.spat import Colour, Spat


def _bends(card: Card) -> Bend:
    stuck: dict[str, Colour] = {}

    def bend(spat: Spat) -> Spat:
        green = None if stuck else long_green(spat)
        if green is not None:
            stuck.update({green.group: "green", rivals(card, green.group)[0]: "green"})
        return recolour(spat, stuck)

    return bend


FAULT = SignalFault(what="conflicting greens", expects=("conflict",), bends=_bends)
