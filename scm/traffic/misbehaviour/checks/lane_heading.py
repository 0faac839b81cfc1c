"""Lane heading: a car on a lane drives in its direction.

    p = erfc of the least angle to a lane there, beyond 76 degrees

A mirrored position is on the other side of the road and heads against it. So does a real wrong-way
driver: an Eye that confirms the position overrules this, and without an Eye it weighs little.
"""

from scm.geometry import wrap_angle
from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import at_most
from scm.traffic.misbehaviour.limits import HEADING_RAD

SIGMA_RAD = 0.1


def _judge(case: Case) -> float | None:
    now = case.now
    if now.yaw_rad is None:
        return None
    ways = case.ground.ways_at(*now.middle)
    if not ways:
        return None
    yaw = now.yaw_rad
    off = min(abs(wrap_angle(yaw - way)) for way in ways)
    return at_most(off, HEADING_RAD, SIGMA_RAD)


CHECK = Check(_judge, "position", floor=1e-2, witnessed=True)
