"""Range plausibility: nobody is heard from farther away than the radio reaches.

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
    # The antenna may sit a car's length behind the bumper that is told.
    return at_most(away, case.ground.range_m + now.size[0], now.own_m)


CHECK = Check(_judge, "position")
