"""The misbehaviour score of each transmitting station."""

from typing import ClassVar

from scm.records.misbehaviour import StationScore
from scm.v2x.message import Message


class MisbehaviourScores(Message, kw_only=True, frozen=True):
    """All stations received within the last minute, once a second.

    Attributes:
        witness: Whether an Eye is there to hold CAMs against.
    """

    KEY: ClassVar[str] = "misbehaviour/scores"
    RATE_HZ: ClassVar[float | None] = 1.0

    t_ns: int
    witness: bool
    stations: tuple[StationScore, ...]


MESSAGE = MisbehaviourScores
