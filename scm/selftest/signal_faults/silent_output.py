"""The controller runs, but nothing it shows arrives."""

from scm.selftest.signal_fault import Bend, SignalFault
from scm.traffic.conflict_table import Card
from scm.v2x.messages.spat import Spat


def _bends(card: Card) -> Bend:
    del card

    def bend(spat: Spat) -> Spat | None:
        del spat
        return None

    return bend


FAULT = SignalFault(what="silent output", expects=("stale", "overload"), bends=_bends)
