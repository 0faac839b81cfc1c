"""Identity: the number in a CAM is that of the station whose key it came under.

    p = 1 if it is, else the least

The city's router lets a station write under its own name alone, so the key replaces the certificate
of a real road.
"""

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import LEAST


def _judge(case: Case) -> float | None:
    return 1.0 if case.is_own_number else LEAST


CHECK = Check(_judge, "security")
