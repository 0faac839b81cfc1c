"""Kalman speed (F2MD's PSCS): the claimed velocity is the predicted one.

p = place(innovation of velocity, sigma of prediction and claim)
"""

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import of_place

TOLERANCE_MPS = 0.03


def _judge(case: Case) -> float | None:
    kalman = case.kalman
    if not kalman.is_warm:
        return None
    return of_place(kalman.moved_mps, TOLERANCE_MPS, 1.3 * kalman.velocity_std)


CHECK = Check(_judge, "speed")
