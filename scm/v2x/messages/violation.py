"""A rule of the road was broken, with the evidence for it."""

from typing import ClassVar, Literal

import msgspec

from scm.v2x.message import Delivery, Message
from scm.v2x.messages.spat import SignalGroup

Kind = Literal["red_light", "stop_line", "speed", "wrong_way", "collision"]


class TrackPoint(msgspec.Struct, kw_only=True, frozen=True):
    """Where the car was believed to be: rear axle, map frame; `source` says who told it."""

    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    source: str


class Violation(Message, kw_only=True, frozen=True):
    """One event: told once, however long it lasts.

    Attributes:
        number: Counts the violations that this observer has told, from 1.
        lane: Where it happened; empty: on no lane.
        at_m: Where along that lane the rear axle was.
        text: One sentence with what was allowed and what was done.
        certainty: That it was beyond what is allowed, from the doubt of the poses; 0 to 1.
        sources: Who told the poses, and what was shown: `eye`, `self`, `spat`, `contact`.
        junction, signal: Whose signal, and what its group showed then.
        against: In a collision: names of cars, or `wall`.
        track: The seconds before, oldest first.
    """

    KEY: ClassVar[str] = "violation/{vehicle}"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT
    KEEP: ClassVar[int] = 20

    vehicle: str
    number: int
    kind: Kind
    t_ns: int
    x_m: float
    y_m: float
    lane: str = ""
    at_m: float = 0.0
    text: str
    certainty: float
    sources: tuple[str, ...]
    junction: str = ""
    signal: SignalGroup | None = None
    against: tuple[str, ...] = ()
    track: tuple[TrackPoint, ...] = ()


MESSAGE = Violation
