"""Speed consistency: speed changes no faster than a car can brake or speed up.

p = erfc of what v1 - v0 lies beyond [-decel dt, accel dt]
"""

import math

from scm.v2x.misbehaviour.check import Case, Check
from scm.v2x.misbehaviour.likely import at_most


def _judge(case: Case) -> float | None:
    now, before, dt = case.now, case.before, case.dt_s
    if before is None or now.speed_mps is None or before.speed_mps is None or dt < 0.0:
        return None
    gain = now.speed_mps - before.speed_mps
    sigma = math.hypot(now.own_mps, before.own_mps)
    return min(
        at_most(gain, case.limits.accel_mps2 * dt, sigma),
        at_most(-gain, case.limits.decel_mps2 * dt, sigma),
    )


CHECK = Check(_judge, "speed")
