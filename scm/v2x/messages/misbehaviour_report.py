"""A station is suspected of false messages: what was observed, and the messages that show it."""

from typing import Annotated, ClassVar, Literal

import msgspec
from msgspec import Meta

from scm.records.fields import TNs
from scm.records.traffic import EvidencePose
from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.message import Delivery, Message


class Observation(msgspec.Struct, kw_only=True, frozen=True):
    """What one check found.

    Attributes:
        kind: Class of observations of ETSI TS 103 759.
        check: Name of the check, a file of `scm/traffic/misbehaviour/checks`.
        plausibility: Of the worst claim: how often an honest car would seem so bad.
        claims: How many were at least doubtful.
    """

    kind: Literal["beacon", "static", "security", "position", "speed", "longAcc"]
    check: Annotated[str, Meta(examples=["speed_jump"])]
    plausibility: float
    claims: int


class EvidenceCam(msgspec.Struct, kw_only=True, frozen=True):
    """A CAM that was judged, and when it was sent.

    Attributes:
        body: The message itself, by the names of the standard.
    """

    t_ns: TNs
    body: CamBody


class MisbehaviourReport(Message, kw_only=True, frozen=True):
    """After ETSI TS 103 759: who, since when, which classes of observations, and the evidence.

    Published when a station becomes suspect, and every ten seconds while it remains so.

    Attributes:
        suspect: The station by its name on the bus.
        suspect_id: Its number in the CAMs; not that of its name where it lies about it.
        since_ns: Since when it is suspected.
        score: What is held against it, as in `MisbehaviourScores`.
        observations: The worst first.
        evidence: CAMs in order of time: each that gave points, and the one before it.
        seen: Where the Eye saw it, if it did.
    """

    KEY: ClassVar[str] = "misbehaviour/{suspect}/report"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT
    HISTORY_DEPTH: ClassVar[int] = 5

    suspect: Annotated[str, Meta(examples=["n5"])]
    suspect_id: int
    t_ns: TNs
    since_ns: int
    score: float
    observations: tuple[Observation, ...]
    evidence: tuple[EvidenceCam, ...]
    seen: EvidencePose | None = None


MESSAGE = MisbehaviourReport
