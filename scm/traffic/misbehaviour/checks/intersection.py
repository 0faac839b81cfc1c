"""Intersection: two cars do not stand in each other.

    p = erfc of the depth of their outlines in each other, beyond TOLERANCE_M

Both say so, one lies: the one that more is held against, else the one that spoke for less time.
"""

from scm.clock import NS_PER_S
from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.claim import Claim
from scm.traffic.misbehaviour.likely import Box, at_most, overlap_m

TOLERANCE_M = 0.03
DRIVEN_S = 1.3
LONGER_NS = NS_PER_S


def _judge(case: Case) -> float | None:
    now = case.now
    if now.yaw_rad is None:
        return None
    box: Box = (*now.middle, now.yaw_rad, *now.size)
    least = 1.0
    for other in case.neighbours:
        age_s = (now.t_ns - other.t_ns) * 1e-9
        if other.yaw_rad is None or abs(age_s) > DRIVEN_S:
            continue
        if _is_other(case, other):
            continue
        there: Box = (*other.middle, other.yaw_rad, *other.size)
        speed = case.limits.speed_mps if other.speed_mps is None else other.speed_mps
        moved = abs(speed * age_s)
        depth = overlap_m(box, there)
        least = min(least, at_most(depth, TOLERANCE_M + moved, now.own_m + other.own_m))
    return least


def _is_other(case: Case, other: Claim) -> bool:
    """Return whether the other one is rather to blame."""
    one, two = case.standings.get(case.now.who), case.standings.get(other.who)
    if two is None:
        return False
    score = 0.0 if one is None else one.score
    known_ns = case.now.sent_ns if one is None else one.since_ns
    return two.score > score or two.since_ns > known_ns + LONGER_NS


CHECK = Check(_judge, "position", floor=1e-2, witnessed=True)
