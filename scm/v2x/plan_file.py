"""A user-made signal plan of one junction, as it is stored, proven and shown.

The proof covers the stages with the junction's times and conflicts, identified by `digest`. When
the junction, a stage or the meaning of stages changes, the proof no longer applies.
"""

import hashlib

import msgspec

from scm.records.signal_plans import PlanProof, SignalPhase, SignalStage
from scm.v2x.messages.signal_site import SignalSite

MEANING = 2
"""Version of the meaning of stages and their proof; in version 1 all went red between stages."""


class PlanFile(msgspec.Struct, kw_only=True, frozen=True):
    """A plan with its junction.

    Attributes:
        phases, conflicts: Of the junction when the plan was made.
        offset_s: When its cycle begins, see `PlanRequest`; not part of the proof.
        by: Who saved it; `reason` is why, `saved_ns` when.
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
        """Identifies what a proof of this plan covers."""
        times = [(p.group, p.min_green_s, p.yellow_s, p.red_clear_s) for p in self.phases]
        proven_parts = [MEANING, self.junction, self.stages, times, self.conflicts]
        proven = msgspec.json.encode(proven_parts)
        return hashlib.sha256(proven).hexdigest()[:16]

    @property
    def is_proven(self) -> bool:
        """Whether its proof covers its present content."""
        return self.proof is not None and self.proof.digest == self.digest


def fits(file: PlanFile, site: SignalSite) -> bool:
    """Return whether a plan fits the present state of a junction."""
    return (
        file.junction == site.junction
        and file.phases == site.phases
        and file.conflicts == site.conflicts
    )
