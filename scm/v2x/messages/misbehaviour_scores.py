"""What is held against each station that speaks on the air."""

from typing import ClassVar

import msgspec

from scm.v2x.message import Message


class StationScore(msgspec.Struct, kw_only=True, frozen=True):
    """One station.

    Attributes:
        station: Its name on the bus.
        station_id: Its number in the CAMs.
        score: 0 is ordinary; from 5 up it is suspected, until it falls below 2.
        worst: The check that last gave it points; empty: none.
        suspected: Whether a report stands against it.
        tag_unseen: Whether it is a car of the city whose tag the Eye cannot see though it overlooks
            its place: nobody confirms where it is. No accusation.
    """

    station: str
    station_id: int
    score: float
    worst: str
    suspected: bool
    tag_unseen: bool = False


class MisbehaviourScores(Message, kw_only=True, frozen=True):
    """All stations heard within the last minute, once a second.

    Attributes:
        witness: Whether an Eye is there to hold CAMs against.
    """

    KEY: ClassVar[str] = "misbehaviour/scores"
    RATE_HZ: ClassVar[float | None] = 1.0

    t_ns: int
    witness: bool
    stations: tuple[StationScore, ...]


MESSAGE = MisbehaviourScores
