"""Position-speed consistency: the way between two claims is the mean speed times the time.

    r = (rear1 - rear0) . (cos yaw, sin yaw) - (v0 + v1) / 2 dt        yaw: the mean of both
    p = erfc of |r| beyond the tolerance, for one claim; and of the mean of r over the last seconds

Along the heading, because a length would grow with noise; over seconds, because there the noise of
positions cancels and a small constant error remains.

Between two CAMs the speed may differ from both by DRIFT_MPS: beyond it another CAM would have been
due (EN 302 637-2, 6.1.3). Lost CAMs make the tolerance grow with the square of the time. A car
faster than a Nigel slips more: all tolerances of a speed grow in that ratio.
"""

import math

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import of_number
from scm.traffic.misbehaviour.limits import NIGEL_MPS

DRIFT_MPS = 0.03
TOLERANCE_M = 0.006
MIN_MEAN_S = 2.0  # of claims, before their mean counts
MEAN_MPS, SIGMA_MPS = 0.02, 0.006  # tolerance and standard deviation of the mean


def _judge(case: Case) -> float | None:
    now, before, dt = case.now, case.before, case.driven_s
    if before is None or dt <= 0.0 or now.speed_mps is None or before.speed_mps is None:
        return None
    spread = abs(now.speed_mps - before.speed_mps)
    faster = max(1.0, abs(now.speed_mps) / NIGEL_MPS, abs(before.speed_mps) / NIGEL_MPS)
    tolerance = TOLERANCE_M + (DRIFT_MPS * faster + 0.25 * spread) * dt + 0.02 * faster * dt * dt
    sigma = math.hypot(now.own_m + before.own_m, now.own_mps * dt)
    strayed = case.strayed
    p = of_number(strayed.last_m, tolerance, sigma)
    if strayed.over_s < MIN_MEAN_S:
        return p
    mean = strayed.sum_m / strayed.over_s
    unsure_m = math.hypot(2.0 * now.own_m, math.sqrt(strayed.variance_m2))
    std_mps = math.hypot(SIGMA_MPS, unsure_m / strayed.over_s)
    return min(p, of_number(mean, MEAN_MPS * faster, std_mps))


CHECK = Check(_judge, "speed")
