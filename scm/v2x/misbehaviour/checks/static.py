"""Static fields: a car keeps its length and width.

p = 1 within one step of the field, else the least
"""

from scm.v2x.misbehaviour.check import Case, Check
from scm.v2x.misbehaviour.likely import LEAST

STEP_M = 0.0145
"""Two steps of 0.1 m of the enlarged city: one to either side."""


def _judge(case: Case) -> float | None:
    now, before = case.now, case.before
    if before is None:
        return None
    changed = max(abs(now.length_m - before.length_m), abs(now.width_m - before.width_m))
    return 1.0 if changed <= STEP_M else LEAST


CHECK = Check(_judge, "static")
