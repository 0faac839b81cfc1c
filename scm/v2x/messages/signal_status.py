"""What runs at a junction and who wants what of it: for people; cars need `Spat` alone."""

from typing import ClassVar

from scm.records.signal_plans import SignalStage
from scm.records.signals import SignalDetector, SignalOverride, SignalTurn
from scm.v2x.message import Message


class SignalStatus(Message, kw_only=True, frozen=True):
    """Published once a second, and at once when what runs or an override changes.

    Attributes:
        plan: Of the timetable, also while another policy runs.
        pending: Plan or policy to come at the next safe moment; empty: none.
        wishes: Overrides of people and scripts, in force.
        detectors: Of the groups; none: detectors are off.
        turns: Greens to come, by the timetable or as the policy foresees; none: unknown.
        failure: Why a policy was given up for fixed time; empty: none was.
        stages, offset_s: Of the plan in force, where somebody made it: as it runs, whatever it was
            edited to since. No stages: it is one of the junction's own.
    """

    KEY: ClassVar[str] = "tl/{junction}/status"
    RATE_HZ: ClassVar[float | None] = 1.0

    junction: str
    t_ns: int
    policy: str
    plan: str
    pending: str = ""
    wishes: tuple[SignalOverride, ...] = ()
    detectors: tuple[SignalDetector, ...] = ()
    turns: tuple[SignalTurn, ...] = ()
    failure: str = ""
    stages: tuple[SignalStage, ...] = ()
    offset_s: float | None = None


MESSAGE = SignalStatus
