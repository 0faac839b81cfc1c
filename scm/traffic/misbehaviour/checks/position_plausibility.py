"""Position plausibility: cars are on roads.

    p = erfc of the distance beyond TOLERANCE_M to the nearest lane or paved area

Holds where the map has lanes. A car may drive over the kerb: an Eye that sees it there overrules
this.
"""

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import at_most

TOLERANCE_M = 0.10


def _judge(case: Case) -> float | None:
    if not case.ground.has_roads:
        return None
    beside = case.ground.off_road_m(*case.now.middle)
    return at_most(beside, TOLERANCE_M, 2.0 * case.now.own_m)


CHECK = Check(_judge, "position", floor=1e-3, witnessed=True)
