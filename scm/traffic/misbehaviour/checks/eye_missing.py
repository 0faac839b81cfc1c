"""Eye missing: within the Eye's view, a car that sends CAMs has a visible tag.

    p = FLOOR where it sees no tag within NEAR_M of the claim

A ghost is not seen. A tag may be hidden for a while, so this needs several claims. A car of the
city whose tag no camera has ever seen, or that has none, is no ghost: that is an event of its own.
"""

from scm.traffic.misbehaviour.check import Case, Check

NEAR_M = 0.2  # from a claim to a track
FLOOR = 0.1


def _judge(case: Case) -> float | None:
    if not case.eye_sees or case.track is not None or case.is_tag_unseen:
        return None
    return FLOOR if case.nearest_track_m > NEAR_M else 1.0


CHECK = Check(_judge, "position", floor=FLOOR)
