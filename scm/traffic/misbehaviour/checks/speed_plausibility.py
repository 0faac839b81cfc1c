"""Speed plausibility: no claim is faster than the car's top speed.

p = erfc((|v| - v_max) / sigma)        v_max of the car itself, not VeReMi's 62 m/s
"""

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import LEAST, at_most

TOLERANCE = 1.1


def _judge(case: Case) -> float | None:
    speed = case.now.speed_mps
    if speed is None:
        return LEAST if case.now.is_beyond_speed else None
    return at_most(abs(speed), TOLERANCE * case.limits.speed_mps, case.now.own_mps)


CHECK = Check(_judge, "speed")
