"""What makes measurements void."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.fields import EndNs, EndS, KindName, SourceName, StartNs, StartS, Text, VoidReasons

Kind = Literal["flash", "monitor", "silent", "part_lost", "late"]


class Disturbance(msgspec.Struct, kw_only=True, frozen=True):
    """Something that makes measurements void.

    Attributes:
        kind: Of which sort it is.
        source: The junction or part that it concerns.
        start_ns: When it began, on the reporter's clock.
        end_ns: When it was over; None: it lasts.
        text: What is wrong, as a clause: `the signals of crossing flash`.
        advice: What a person can do, in a sentence; empty: nothing.
    """

    kind: Kind
    source: SourceName
    start_ns: StartNs
    end_ns: EndNs | None = None
    text: Text
    advice: Annotated[str, Meta(examples=["Start the city again with fewer cars."])] = ""


class RecordedDisturbance(msgspec.Struct, kw_only=True, frozen=True):
    """One of them, from when to when since the recording began; see `/disturbances`."""

    kind: KindName
    source: SourceName
    text: Text
    start_s: StartS
    end_s: EndS


class RecordedDisturbances(msgspec.Struct, kw_only=True, frozen=True):
    """What of a recording is void.

    Attributes:
        disturbances: The oldest first.
        void: What that means for the recording as a whole, in words; none: all of it counts.
    """

    disturbances: tuple[RecordedDisturbance, ...]
    void: VoidReasons


class DisturbanceList(msgspec.Struct, kw_only=True, frozen=True):
    """What made measurements void in the last hour, the oldest first.

    Attributes:
        disturbances: What makes measurements void.
    """

    disturbances: tuple[Disturbance, ...]
