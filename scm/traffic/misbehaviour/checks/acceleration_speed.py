"""Acceleration against speed (F2MD's SCC): speed changes by the claimed acceleration.

    r = v1 - v0 - (a0 + a1) / 2 dt        p = erfc of |r| beyond a share of |a1 - a0| dt

An acceleration beyond the field's range, "16 m/s^2 or more", bounds r to one side only.

Holds for claims within MAX_GAP_S of each other. An acceleration is of one instant, so alone it
needs many claims. It does not apply while another car touches, just after time passed without the
car moving, nor by hand or in a stop of the city, when throttle changes several times between two
CAMs.
"""

import math

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import at_most

MAX_GAP_S = 0.25
TOLERANCE_MPS = 0.01
CHANGE_SHARE = 0.5  # of a change of acceleration, whose time between the CAMs is unknown


def _judge(case: Case) -> float | None:
    now, before, dt = case.now, case.before, case.dt_s
    if (
        before is None
        or not 0.0 < dt <= MAX_GAP_S
        or case.since_lost_s <= MAX_GAP_S
        or case.is_hard
    ):
        return None
    if now.speed_mps is None or before.speed_mps is None:
        return None
    one, two = now.accel_range, before.accel_range
    if one is None or two is None:
        return None
    gain = now.speed_mps - before.speed_mps
    least, most = (one[0] + two[0]) / 2.0, (one[1] + two[1]) / 2.0
    spread = max(0.0, one[0] - two[1], two[0] - one[1])
    sigma = math.hypot(math.hypot(now.own_mps, before.own_mps), case.limits.own_mps2 * dt)
    strayed = max(gain - most * dt, least * dt - gain)
    p = at_most(strayed, TOLERANCE_MPS + CHANGE_SHARE * spread * dt, sigma)
    return 1.0 if p < 1.0 and case.touches() else p


CHECK = Check(_judge, "longAcc", floor=1e-2)
