"""Eye position: the claimed rear axle is where the Eye sees this car's tag.

p = place(|claim - track|, sigma of both), the track predicted to the claim's time

An Eye that may not deny (`Case.eye_may_deny`) can still confirm.
"""

import math

from scm.traffic.misbehaviour.check import CONFIRMED, Case, Check
from scm.traffic.misbehaviour.likely import of_place

TOLERANCE_M = 0.03
MAX_CLOCK_ERROR_S = 0.06  # between a car and the Eye


def _judge(case: Case) -> float | None:
    track, now = case.track, case.now
    if track is None or now.yaw_rad is None:
        return None
    ahead = track.speed_mps * (now.t_ns - track.t_ns) * 1e-9
    x = track.x_m + ahead * math.cos(track.yaw_rad)
    y = track.y_m + ahead * math.sin(track.yaw_rad)
    # The track's own heading: the claimed one has a check of its own.
    front = case.limits.front_share * now.size[0]
    x += front * math.cos(track.yaw_rad)
    y += front * math.sin(track.yaw_rad)
    away = math.hypot(now.x_m - x, now.y_m - y)
    own = now.own_m + front * math.sqrt(track.covariance[2][2])
    eye = math.sqrt(max(track.covariance[0][0], track.covariance[1][1]))
    tolerance = TOLERANCE_M + MAX_CLOCK_ERROR_S * abs(track.speed_mps)
    p = of_place(away, tolerance, math.hypot(own, eye))
    return p if case.eye_may_deny or p >= CONFIRMED else None


CHECK = Check(_judge, "position")
