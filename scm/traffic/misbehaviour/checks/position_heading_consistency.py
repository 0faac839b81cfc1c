"""Position-heading consistency: a car moves along its heading, forward or in reverse.

p = erfc of the angle between the rear axle's way and the mean heading, beyond 76 degrees
"""

import math

from scm.geometry import wrap_angle
from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import at_most
from scm.traffic.misbehaviour.limits import HEADING_RAD

MIN_WAY_M = 0.05  # a shorter way has no direction
MIN_WAY_STDS = 4.0


def _judge(case: Case) -> float | None:
    now, before = case.now, case.before
    if before is None or now.yaw_rad is None or before.yaw_rad is None:
        return None
    # The front bumper: the rear axle would depend on the claimed heading.
    dx, dy = now.x_m - before.x_m, now.y_m - before.y_m
    way = math.hypot(dx, dy)
    if way < max(MIN_WAY_M, MIN_WAY_STDS * now.own_m):
        return None
    turned = wrap_angle(now.yaw_rad - before.yaw_rad)
    heading = before.yaw_rad + turned / 2.0
    off = abs(wrap_angle(math.atan2(dy, dx) - heading))
    if now.speed_mps is None or before.speed_mps is None:
        off = min(off, math.pi - off)  # it may drive in reverse
    elif now.speed_mps + before.speed_mps < 0.0:
        off = math.pi - off
    sigma = math.hypot(now.own_rad, (now.own_m + before.own_m) / way)
    return at_most(off, HEADING_RAD, sigma)


CHECK = Check(_judge, "position")
