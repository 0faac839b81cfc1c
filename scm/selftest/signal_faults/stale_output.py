"""The same old sample is shown again and again."""

from scm.selftest.signal_fault import Bend, SignalFault
from scm.traffic.conflict_table import Card
from scm.v2x.messages.spat import Spat


def _bends(card: Card) -> Bend:
    del card
    first: list[Spat] = []

    def bend(spat: Spat) -> Spat:
        first.append(spat)
        return first[0]

    return bend


FAULT = SignalFault(what="stale output, sent again", expects=("stale", "overload"), bends=_bends)
