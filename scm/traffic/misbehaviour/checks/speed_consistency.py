"""Speed consistency: speed changes no faster than a car can brake or accelerate.

p = erfc of v1 - v0 beyond [-most(decel, stop), most(accel, start)]
most(a, b) = max(a dt, min(b dt, v_max))

a is a driver's, for any time. b is that of full throttle at rest, or of a guard that stops a car
whose commands are late: it ends at the car's top speed, or at rest.
"""

import math

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import at_most

TOLERANCE = 1.1


def _judge(case: Case) -> float | None:
    now, before, dt = case.now, case.before, case.dt_s
    if before is None or now.speed_mps is None or before.speed_mps is None or dt < 0.0:
        return None
    gain = now.speed_mps - before.speed_mps
    sigma = math.hypot(now.own_mps, before.own_mps)
    limits, fastest = case.limits, TOLERANCE * case.limits.speed_mps
    gain_most = max(limits.accel_mps2 * dt, min(limits.start_mps2 * dt, fastest))
    loss_most = max(limits.decel_mps2 * dt, min(limits.stop_mps2 * dt, fastest))
    return min(at_most(gain, gain_most, sigma), at_most(-gain, loss_most, sigma))


CHECK = Check(_judge, "speed")
