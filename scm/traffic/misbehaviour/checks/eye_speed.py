"""Eye speed: the claimed speed is the one that the Eye measures of this car's tag.

p = erfc of |v - v_eye| beyond the tolerance, sigma of both

Holds while the Eye sees the tag, see `Case.eye_may_deny`, and not by hand or in a stop of the city:
a car that stops within a tenth of a second is faster than the Eye's filter.
"""

import math

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import of_number

TOLERANCE_MPS = 0.035


def _judge(case: Case) -> float | None:
    track, now = case.track, case.now
    if track is None or now.speed_mps is None or not case.eye_may_deny or case.is_hard:
        return None
    sigma = math.hypot(now.own_mps, math.sqrt(track.covariance[3][3]))
    return of_number(now.speed_mps - track.speed_mps, TOLERANCE_MPS, sigma)


CHECK = Check(_judge, "speed", floor=1e-2)
