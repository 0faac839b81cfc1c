"""What came of one case."""

from collections.abc import Mapping
from typing import Literal

import msgspec

from scm.study.study_file import Value

Outcome = Literal["success", "failure", "error", "time_limit", "memory_limit"]


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """One case: what was varied, and what came of it.

    Attributes:
        case: Its number.
        outcome: `success` and `failure` by the limits of the measures; else it did not end.
        detail: Why it did not end.
        seconds: How long it took on the clock on the wall; the only value that differs when a case
            is run again.
        values: Of the factors.
        measures: Empty if it did not end.
    """

    case: int
    replication: int
    seed: int
    outcome: Outcome
    detail: str = ""
    seconds: float
    values: Mapping[str, Value]
    measures: Mapping[str, float] = {}

    @property
    def has_ended(self) -> bool:
        """Whether the scenario returned measures."""
        return self.outcome in {"success", "failure"}
