"""Witness to nothing: where the Eye overlooks the floor, a car that speaks is a car that is seen.

    p = FLOOR where it sees no tag within NEAR_M of the claim

A ghost is not seen. A car that is seen and does not speak is silent, which is no misbehaviour. A
tag may be hidden for a while, so this needs several claims. A car of the city whose tag no camera
has ever seen, or that has none, is no ghost: that the Eye cannot see its tag is said as such.
"""

from scm.traffic.misbehaviour.check import Case, Check

NEAR_M = 0.2
FLOOR = 0.1


def _judge(case: Case) -> float | None:
    if not case.eye_sees or case.track is not None or case.is_tag_unseen:
        return None
    return FLOOR if case.nearest_track_m > NEAR_M else 1.0


CHECK = Check(_judge, "position", floor=FLOOR)
