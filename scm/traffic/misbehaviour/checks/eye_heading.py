"""Eye heading: the claimed heading is the one that the Eye measures of this car's tag.

p = erfc of |yaw - yaw_eye| beyond the tolerance, sigma of both

Holds while the Eye sees the tag, see `Case.eye_may_deny`.
"""

import math

from scm.geometry import wrap_angle
from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import of_number

TOLERANCE_RAD = 0.15


def _judge(case: Case) -> float | None:
    track, now = case.track, case.now
    if track is None or now.yaw_rad is None or not case.eye_may_deny:
        return None
    sigma = math.hypot(now.own_rad, math.sqrt(track.covariance[2][2]))
    return of_number(wrap_angle(now.yaw_rad - track.yaw_rad), TOLERANCE_RAD, sigma)


CHECK = Check(_judge, "position")
