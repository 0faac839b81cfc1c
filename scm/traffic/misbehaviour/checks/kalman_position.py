"""Kalman position (F2MD's PSCP): the claim is where the filter predicts it.

p = place(innovation, sigma of prediction and claim)
"""

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import of_place

TOLERANCE_M = 0.02


def _judge(case: Case) -> float | None:
    kalman = case.kalman
    if not kalman.is_warm:
        return None
    return of_place(kalman.moved_m, TOLERANCE_M, 1.3 * kalman.position_std)


CHECK = Check(_judge, "position")
