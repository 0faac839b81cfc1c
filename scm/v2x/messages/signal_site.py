"""What a junction's signals are: groups with their least times, conflicts, rings, and its plans."""

from typing import ClassVar

import msgspec

from scm.v2x.message import Delivery, Message
from scm.v2x.messages.plan_request import SignalStage


class SignalPhase(msgspec.Struct, kw_only=True, frozen=True):
    """A phase: one signal group, and the times that the kernel and the rings keep.

    Attributes:
        yellow_s: Yellow change.
        red_clear_s: Red clear, all red before anybody in conflict may start.
        passage_s: A green gaps out this long after the last vehicle.
        max1_s, max2_s: A green ends after it once others are called; max 2 holds in queues.
    """

    group: str
    min_green_s: float
    yellow_s: float
    red_clear_s: float
    passage_s: float
    max1_s: float
    max2_s: float


class SignalSlot(msgspec.Struct, kw_only=True, frozen=True):
    """A stage of a cycle: green from `start_s` to `end_s` after the cycle's begin."""

    groups: tuple[str, ...]
    start_s: float
    end_s: float


class SignalPlan(msgspec.Struct, kw_only=True, frozen=True):
    """A fixed-time plan as this junction runs it.

    Attributes:
        stages: What makes it.
        slots: Its timetable; yellow and red clear lie between two of them, for groups that are
            not in both.
        in_step: Whether it keeps a common cycle with other junctions: a green wave.
        offset_s: When its cycle begins in the common one; None: it keeps none.
    """

    plan: str
    about: str
    cycle_s: float
    stages: tuple[SignalStage, ...]
    slots: tuple[SignalSlot, ...]
    in_step: bool = False
    offset_s: float | None = None


class SignalPolicy(msgspec.Struct, kw_only=True, frozen=True):
    """A policy that may be asked for; `has_detectors`: it listens for cars."""

    policy: str
    about: str
    has_detectors: bool


class SignalSite(Message, kw_only=True, frozen=True):
    """One junction for whoever joins; told at the start and every 10 s.

    Attributes:
        conflicts: Pairs of groups that are never green together.
        rings: `rings[section][ring]` is the sequence of groups between two barriers.
    """

    KEY: ClassVar[str] = "tl/{junction}/site"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    junction: str
    t_ns: int
    phases: tuple[SignalPhase, ...]
    conflicts: tuple[tuple[str, str], ...]
    rings: tuple[tuple[tuple[str, ...], ...], ...]
    plans: tuple[SignalPlan, ...]
    policies: tuple[SignalPolicy, ...]


MESSAGE = SignalSite
