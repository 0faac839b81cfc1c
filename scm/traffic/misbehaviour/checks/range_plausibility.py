"""Range plausibility: no car is received from beyond the radio's range.

p = place(|claimed - receiver|, range)        range of the map, 20 m; VeReMi's 418 m is 30 m
"""

import math

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import at_most


def _judge(case: Case) -> float | None:
    now = case.now
    receiver = case.ground.receivers.get(now.receiver)
    if receiver is None:
        return None
    away = math.hypot(now.x_m - receiver[0], now.y_m - receiver[1])
    # The antenna may be a car's length behind the claimed bumper.
    return at_most(away, case.ground.range_m + now.size[0], now.own_m)


CHECK = Check(_judge, "position")
