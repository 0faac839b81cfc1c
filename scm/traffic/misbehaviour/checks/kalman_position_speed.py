"""Kalman position and speed together (F2MD's PSCSP, PSCSS), near their prediction.

d^2 = (position innovation / sigma)^2 + (velocity innovation / sigma)^2
p = (1 + d^2/2) exp(-d^2 / 2)        the chi-squared tail of four dimensions
"""

import math

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import LEAST

TOLERANCE_M = 0.02
TOLERANCE_MPS = 0.03


def _judge(case: Case) -> float | None:
    kalman = case.kalman
    if not kalman.is_warm:
        return None
    position = max(0.0, kalman.moved_m - TOLERANCE_M) / (1.3 * kalman.position_std)
    speed = max(0.0, kalman.moved_mps - TOLERANCE_MPS) / (1.3 * kalman.velocity_std)
    half = min(40.0, 0.5 * (position * position + speed * speed))
    return max(LEAST, (1.0 + half) * math.exp(-half))


CHECK = Check(_judge, "speed")
