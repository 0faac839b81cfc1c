"""Position-speed consistency, extremes: the way is between full braking and full throttle.

least = the way at full braking from v0, most = at full acceleration to v_max
p = erfc of what lies outside of [least, most]
"""

import math

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import of_number

TOLERANCE_M = 0.01


def _judge(case: Case) -> float | None:
    now, before, dt = case.now, case.before, case.driven_s
    if before is None or dt <= 0.0 or now.speed_mps is None or before.speed_mps is None:
        return None
    share, limits = case.limits.front_share, case.limits
    (x1, y1), (x0, y0) = now.rear(share), before.rear(share)
    way = math.hypot(x1 - x0, y1 - y0)
    v0, v1 = abs(before.speed_mps), abs(now.speed_mps)
    least = _way(v0, v1, dt, limits.decel_mps2, 0.0)
    most = -_way(-v0, -v1, dt, limits.accel_mps2, -1.1 * limits.speed_mps)
    middle, half = (most + least) / 2.0, max(0.0, most - least) / 2.0
    sigma = math.hypot(now.own_m + before.own_m, now.own_mps * dt)
    return of_number(way - middle, half + TOLERANCE_M, sigma)


def _way(v0: float, v1: float, dt: float, rate: float, floor: float) -> float:
    """Return the shortest way from speed v0 to v1: fall at `rate`, stay at `floor`, rise again."""
    low = (v0 + v1 - rate * dt) / 2.0
    if low >= floor:
        down = (v0 - low) / rate
        return (v0 + low) / 2.0 * down + (v1 + low) / 2.0 * (dt - down)
    down, up = max(0.0, v0 - floor) / rate, max(0.0, v1 - floor) / rate
    rest = max(0.0, dt - down - up)
    return (v0 + floor) / 2.0 * down + (v1 + floor) / 2.0 * up + floor * rest


CHECK = Check(_judge, "speed")
