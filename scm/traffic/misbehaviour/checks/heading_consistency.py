"""Heading consistency: no car turns on the spot.

p = erfc of |yaw1 - yaw0| beyond the tightest curve over the longest possible way
"""

from scm.geometry import wrap_angle
from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import of_number

TIGHTEST_PER_M = 5.0  # curvature: a radius of 0.2 m
TOLERANCE_RAD = 0.15


def _judge(case: Case) -> float | None:
    now, before = case.now, case.before
    if before is None or now.yaw_rad is None or before.yaw_rad is None:
        return None
    reach = 1.2 * case.limits.speed_mps * max(0.0, case.dt_s)
    turned = wrap_angle(now.yaw_rad - before.yaw_rad)
    tolerance = TIGHTEST_PER_M * reach + TOLERANCE_RAD
    return of_number(turned, tolerance, now.own_rad + before.own_rad)


CHECK = Check(_judge, "position")
