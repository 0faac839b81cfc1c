"""A signal plan that a person made, as it is stored, proven and shown: for one junction as it is.

What is proven is the stages together with the junction's times and conflicts: its `digest`. When
the junction changes, or one stage does, or what stages mean, the proof is one of something else.
"""

import hashlib

import msgspec

from scm.records.signal_plans import PlanProof, SignalPhase, SignalStage
from scm.v2x.messages.signal_site import SignalSite

MEANING = 2
"""Of stages, and of what the search proves of them; 1: all went red between two stages."""


class PlanFile(msgspec.Struct, kw_only=True, frozen=True):
    """A plan with the junction that it is for.

    Attributes:
        phases, conflicts: Of the junction when the plan was made.
        offset_s: When its cycle begins, see `PlanRequest`; no part of what is proven.
        by: Who saved it; `reason` why, `saved_ns` when.
    """

    junction: str
    plan: str
    stages: tuple[SignalStage, ...]
    phases: tuple[SignalPhase, ...]
    conflicts: tuple[tuple[str, str], ...]
    about: str = ""
    offset_s: float | None = None
    by: str = ""
    reason: str = ""
    saved_ns: int = 0
    proof: PlanProof | None = None

    @property
    def digest(self) -> str:
        """Name of what a proof of it proves."""
        times = [(p.group, p.min_green_s, p.yellow_s, p.red_clear_s) for p in self.phases]
        proven_parts = [MEANING, self.junction, self.stages, times, self.conflicts]
        proven = msgspec.json.encode(proven_parts)
        return hashlib.sha256(proven).hexdigest()[:16]

    @property
    def is_proven(self) -> bool:
        """Whether its proof is of what it says."""
        return self.proof is not None and self.proof.digest == self.digest


def fits(file: PlanFile, site: SignalSite) -> bool:
    """Return whether a plan was made for a junction as it is now."""
    return (
        file.junction == site.junction
        and file.phases == site.phases
        and file.conflicts == site.conflicts
    )
