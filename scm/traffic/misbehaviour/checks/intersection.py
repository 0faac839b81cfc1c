"""Intersection: two cars do not overlap.

    p = erfc of the overlap of their outlines, beyond TOLERANCE_M

One of the two claims is false: that of the higher score, else that of the more recent station.
"""

from scm.clock import NS_PER_S
from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.claim import Claim
from scm.traffic.misbehaviour.likely import Box, at_most, overlap_m

TOLERANCE_M = 0.03
MAX_AGE_S = 1.3  # of the other claim: a standing car sends once a second
CLEARLY_LONGER_NS = NS_PER_S


def _judge(case: Case) -> float | None:
    now = case.now
    if now.yaw_rad is None:
        return None
    box: Box = (*now.middle, now.yaw_rad, *now.size)
    least = 1.0
    for other in case.neighbours:
        age_s = (now.t_ns - other.t_ns) * 1e-9
        if other.yaw_rad is None or abs(age_s) > MAX_AGE_S:
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
    """Return whether the other claim is more likely false."""
    one, two = case.standings.get(case.now.who), case.standings.get(other.who)
    if two is None:
        return False
    score = 0.0 if one is None else one.score
    known_ns = case.now.sent_ns if one is None else one.since_ns
    return two.score > score or two.since_ns > known_ns + CLEARLY_LONGER_NS


CHECK = Check(_judge, "position", floor=1e-2, witnessed=True)
