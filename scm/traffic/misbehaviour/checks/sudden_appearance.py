"""Sudden appearance: a new car appears at a spawn place.

    p = FLOOR for a first claim farther than NEAR_M from every spawn place

Not just after the start, when all cars are new. It is weak: a car may be put anywhere by hand.
VeReMi's 4.7 s is how long a car may be silent before it is new again.
"""

import math

from scm.traffic.misbehaviour.check import Case, Check

NEAR_M = 0.6  # two cars' lengths
STARTING_S = 3.0  # after the detector started
FLOOR = 0.02


def _judge(case: Case) -> float | None:
    if case.before is not None or case.since_start_s < STARTING_S:
        return None
    now = case.now
    spawns = case.ground.spawns
    away = min((math.hypot(now.x_m - x, now.y_m - y) for x, y in spawns), default=0.0)
    return FLOOR if away > NEAR_M else 1.0


CHECK = Check(_judge, "position", floor=FLOOR, witnessed=True)
