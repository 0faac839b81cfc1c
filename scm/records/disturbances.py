"""What makes measurements void."""

from typing import Literal

import msgspec

Kind = Literal["flash", "monitor", "silent", "part_lost", "late"]


class Disturbance(msgspec.Struct, kw_only=True, frozen=True):
    """Something that makes measurements void.

    Attributes:
        source: The junction or part that it concerns.
        start_ns: When it began, on the clock of whoever reports it.
        end_ns: When it was over; None: it lasts.
        text: What is wrong, as a clause: `the signals of crossing flash`.
        advice: What a person can do, in a sentence; empty: nothing.
    """

    kind: Kind
    source: str
    start_ns: int
    end_ns: int | None = None
    text: str
    advice: str = ""


class RecordedDisturbance(msgspec.Struct, kw_only=True, frozen=True):
    """One of them, from when to when since the recording began; see `/disturbances`."""

    kind: str
    source: str
    text: str
    start_s: float
    end_s: float


class RecordedDisturbances(msgspec.Struct, kw_only=True, frozen=True):
    """What of a recording is void.

    Attributes:
        disturbances: The oldest first.
        void: What that means for the recording as a whole, in words; none: all of it counts.
    """

    disturbances: tuple[RecordedDisturbance, ...]
    void: tuple[str, ...]


class DisturbanceList(msgspec.Struct, kw_only=True, frozen=True):
    """What made measurements void in the last hour, the oldest first."""

    disturbances: tuple[Disturbance, ...]
