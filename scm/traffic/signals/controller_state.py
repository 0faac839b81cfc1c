"""What a controller knows of its steps, its policy, its colours and its forecast."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from scm.records.signals import Colour
from scm.traffic.signals.detectors import Detector
from scm.traffic.signals.forecast import Coming
from scm.traffic.signals.guaranteed_time import GuaranteedTime
from scm.traffic.signals.policy import PriorityCall


@dataclass(slots=True)
class ShownColour:
    """What one group shows, since when, and what was promised of it."""

    colour: Colour
    since_ns: int
    guaranteed: GuaranteedTime


@dataclass(slots=True)
class StepTimes:
    """The last step: its time, that of its colours, and whether it came too late."""

    last_ns: int | None = None
    shown_ns: int | None = None
    is_late: bool = False


@dataclass(slots=True)
class PolicyState:
    """The default policy, the memory of the current one, and the one that failed, if any."""

    default: str
    memory: Any = None
    failed: str = ""


@dataclass(slots=True)
class Outlook:
    """The forecast: likely ends of the present colours, and the greens to come."""

    updated_ns: int = 0
    ends: Mapping[str, int | None] = field(default_factory=dict)
    coming: tuple[Coming, ...] = ()


@dataclass(frozen=True, slots=True)
class Observations:
    """What detectors and vehicles tell a policy at one step; see `JunctionView`."""

    detectors: Mapping[str, Detector]
    sees: bool = False
    priority: tuple[PriorityCall, ...] = ()


NO_OBSERVATIONS = Observations({})
