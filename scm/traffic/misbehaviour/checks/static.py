"""Static fields: a car's length and width do not change.

p = 1 within one step of the field, else the least
"""

from scm.traffic.misbehaviour.check import Case, Check
from scm.traffic.misbehaviour.likely import LEAST

STEP_M = 0.0145  # two steps of 0.1 m of the full-size city, one to either side


def _judge(case: Case) -> float | None:
    now, before = case.now, case.before
    if before is None:
        return None
    sizes = (now.length_m, before.length_m), (now.width_m, before.width_m)
    changes = [abs(a - b) for a, b in sizes if a is not None and b is not None]
    return 1.0 if max(changes, default=0.0) <= STEP_M else LEAST


CHECK = Check(_judge, "static")
