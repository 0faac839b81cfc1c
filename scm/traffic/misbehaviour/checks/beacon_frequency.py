"""Beacon frequency: a CAM at most every 100 ms, and once a second if nothing changes.

    gap >= T_GenCamMin = 100 ms, and each CAM was made after the one before it
    after N_GenCam = 3 CAMs in which nothing changed, the next one comes T_GenCamMax = 1 s later

Times are those of the senders' clocks, so delays of the radio have no effect.
Source: EN 302 637-2 v1.4.1, 6.1.3.
"""

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import LEAST, at_most

SIGMA_S = 0.01
MAX_IDLE = 5  # fast CAMs in a row without change; N_GenCam is 3, and some may be lost


def _judge(case: Case) -> float | None:
    if case.before is None:
        return None
    if case.dt_s <= 0.0:
        return LEAST
    p = at_most(case.limits.interval_s - case.gap_s, 0.005, SIGMA_S)
    beyond = case.idle - MAX_IDLE
    return min(p, max(LEAST, 0.1**beyond)) if beyond > 0 else p


CHECK = Check(_judge, "beacon")
