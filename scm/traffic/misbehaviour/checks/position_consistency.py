"""Position consistency: between two claims no car gets farther than it can drive.

p = place(|p1 - p0|, v_max dt)
"""

import math

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import of_place

TOLERANCE_M = 0.03
SPEED_MARGIN = 1.2  # times the top speed


def _judge(case: Case) -> float | None:
    now, before = case.now, case.before
    if before is None:
        return None
    away = math.hypot(now.x_m - before.x_m, now.y_m - before.y_m)
    reach = SPEED_MARGIN * case.limits.speed_mps * max(case.dt_s, 0.0) + TOLERANCE_M
    return of_place(away, reach, now.own_m + before.own_m)


CHECK = Check(_judge, "position")
