"""The controller's clock jumps two seconds ahead."""

import msgspec

from scm.clock import NS_PER_S
from scm.selftest.signal_fault import Bend, SignalFault
from scm.traffic.conflict_table import Card
from scm.v2x.messages.spat import Spat

JUMP_NS = 2 * NS_PER_S


def _bends(card: Card) -> Bend:
    del card

    def bend(spat: Spat) -> Spat:
        return msgspec.structs.replace(spat, t_ns=spat.t_ns + JUMP_NS)

    return bend


FAULT = SignalFault(what="clock jumps forward", expects=("clock_jump",), bends=_bends)
