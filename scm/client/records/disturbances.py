"""Records of disturbances.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class Disturbance(msgspec.Struct, kw_only=True, frozen=True):
    """Something that makes measurements void.

    Attributes:
        kind: Of which sort it is.
        source: The junction or part that it concerns.
        start_ns: When it began, on the clock of whoever reports it.
        end_ns: When it was over; None: it lasts.
        text: What is wrong, as a clause: `the signals of crossing flash`.
        advice: What a person can do, in a sentence; empty: nothing.
    """

    kind: Literal["flash", "late", "monitor", "part_lost", "silent"]
    source: str
    start_ns: int
    end_ns: int | None = None
    text: str
    advice: str = ""


class DisturbanceList(msgspec.Struct, kw_only=True, frozen=True):
    """What made measurements void in the last hour, the oldest first.

    Attributes:
        disturbances: What makes measurements void.
    """

    disturbances: tuple[Disturbance, ...]
