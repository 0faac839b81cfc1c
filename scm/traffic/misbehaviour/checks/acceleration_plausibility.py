"""Acceleration plausibility: no car accelerates or brakes harder than it can.

    p = erfc((a - a_max) / sigma) for speeding up, likewise for braking

Only if two claims in a row are both beyond it: a bump is over at once, and cars do bump. Never
while another car touches: a pushed car has no limit.
"""

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import at_most


def _judge(case: Case) -> float | None:
    now, before = case.now, case.before
    one, two = now.accel_range, None if before is None else before.accel_range
    if one is None or two is None:
        return None
    sigma = case.limits.own_mps2
    gain, loss = min(one[0], two[0]), -max(one[1], two[1])
    p = min(
        at_most(gain, case.limits.accel_mps2, sigma), at_most(loss, case.limits.decel_mps2, sigma)
    )
    return 1.0 if p < 1.0 and case.touches() else p


CHECK = Check(_judge, "longAcc")
