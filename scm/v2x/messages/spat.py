"""Signal phase and timing of a junction, native form: colours and promised change times."""

from typing import ClassVar, Literal

import msgspec

from scm.v2x.message import Message

Colour = Literal["red", "green", "yellow", "flashing_red", "dark"]


class SignalGroup(msgspec.Struct, kw_only=True, frozen=True):
    """One group of heads that always show the same.

    Attributes:
        min_end_ns: The colour will not change before; never moves earlier.
        max_end_ns: It will have changed by then, never moves later; None: not known.
        next_colour: What comes then; None: not known.
        likely_end_ns: A forecast between the two, no promise: it moves as cars come. None: nobody
            knows.
        likely_confidence: The share of such forecasts that come true within a second, 0 to 1.
    """

    group: str
    colour: Colour
    since_ns: int
    min_end_ns: int
    max_end_ns: int | None = None
    next_colour: Colour | None = None
    likely_end_ns: int | None = None
    likely_confidence: float | None = None


class Spat(Message, kw_only=True, frozen=True):
    """All groups of one junction at `t_ns`.

    Attributes:
        mode: `plan`, `start` (all red after start) or `flash` (monitor or operator).
        plan: Name of the plan in force.
        revision: Of the junction's map; cars compare it with theirs.
    """

    KEY: ClassVar[str] = "tl/{junction}/spat"
    RATE_HZ: ClassVar[float | None] = 10.0

    junction: str
    t_ns: int
    seq: int
    mode: str
    plan: str
    groups: tuple[SignalGroup, ...]
    revision: int = 1


MESSAGE = Spat
