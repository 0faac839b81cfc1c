"""The state of a controller: its steps, its policy, its shown colours and its forecast."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from scm.records.signals import Colour, SignalGroup
from scm.traffic.signals.detectors import Detector
from scm.traffic.signals.forecast import Coming, within
from scm.traffic.signals.guaranteed_time import LATE_STEPS_NS, GuaranteedTime
from scm.traffic.signals.kernel import Phase, Program
from scm.traffic.signals.policy import PriorityCall
from scm.traffic.signals.timetables import Tables
from scm.traffic.signals.timing import CarFacts

COLOUR_OF: dict[Phase, Colour] = {
    Phase.RED: "red",
    Phase.CLEARANCE: "red",
    Phase.GREEN: "green",
    Phase.YELLOW: "yellow",
    Phase.FLASH: "flashing_red",
}
NEXT_COLOUR: dict[Colour, Colour] = {
    "red": "green",
    "green": "yellow",
    "yellow": "red",
    "flashing_red": "red",
}


@dataclass(slots=True)
class ShownColour:
    """What one group shows, since when, and its guaranteed time."""

    colour: Colour
    since_ns: int
    guaranteed: GuaranteedTime

    def as_published(
        self, group: str, forecast_ns: int | None, now_ns: int, *, planned: bool | None
    ) -> SignalGroup:
        """Return it as `Spat` has it.

        Args:
            group: Its name.
            forecast_ns: When it will likely end; None: not known.
            now_ns: The present time.
            planned: Whether a timetable runs; None: the lights flash.
        """
        likely = None
        if planned is not None:
            red = self.colour == "red"
            likely = within(self.guaranteed, forecast_ns, now_ns, red=red, planned=planned)
        return SignalGroup(
            group=group,
            colour=self.colour,
            since_ns=self.since_ns,
            min_end_ns=self.guaranteed.min_end_ns,
            max_end_ns=self.guaranteed.max_end_ns,
            next_colour=NEXT_COLOUR[self.colour],
            likely_end_ns=likely and likely.end_ns,
            likely_confidence=likely and likely.confidence,
        )


class ShownColours(dict[str, ShownColour]):
    """What each group of a junction shows, by name."""

    def __init__(self, program: Program) -> None:
        super().__init__()
        self._program = program

    def green(self) -> frozenset[str]:
        """Return the groups that are green."""
        return frozenset(name for name, shown in self.items() if shown.colour == "green")

    def guarantees(self) -> list[GuaranteedTime | None]:
        """Return the guaranteed times of all groups, in the program's order; None: not yet."""
        shown = [self.get(name) for name in self._program.groups]
        return [one.guaranteed if one is not None else None for one in shown]

    def has_guaranteed_red_end(self) -> bool:
        """Return whether the end of a red is guaranteed: only the timetable can hold to that."""
        return any(
            shown.colour == "red" and shown.guaranteed.max_end_ns is not None
            for shown in self.values()
        )

    def changed_at(self, t_ns: int | None) -> tuple[list[str], list[str]]:
        """Return the groups whose green began, and those whose green ended, at a time."""
        new = {name: shown.colour for name, shown in self.items() if shown.since_ns == t_ns}
        return [n for n in new if new[n] == "green"], [n for n in new if new[n] == "yellow"]

    def gate(self, requested: frozenset[str], now_ns: int) -> frozenset[str]:
        """Return requests as far as the guaranteed times allow them."""
        passed = set(requested)
        for name, shown in self.items():
            is_green = shown.colour == "green"
            latest_ns = shown.guaranteed.max_end_ns
            if now_ns < shown.guaranteed.min_end_ns:
                (passed.add if is_green else passed.discard)(name)
            elif is_green and latest_ns is not None and now_ns >= latest_ns - LATE_STEPS_NS:
                passed.discard(name)
        return frozenset(passed)


@dataclass(frozen=True, slots=True)
class Timing:
    """What follows for a junction from the cars: its kernel's program, and its own timetables."""

    program: Program
    tables: Tables
    car: CarFacts


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


@dataclass(slots=True)
class LastShown:
    """What the last step showed, for as long as nothing changes it.

    Attributes:
        basis: What the guaranteed times follow from, beside the time.
        until_ns: When they may change though the basis does not.
        groups: As published; None: to be made anew.
        groups_until_ns: Until when a likely end of theirs stays ahead.
    """

    basis: tuple[object, ...] = ()
    until_ns: int = 0
    groups: tuple[SignalGroup, ...] | None = None
    groups_until_ns: int = 0


@dataclass(frozen=True, slots=True)
class Observations:
    """The inputs of a policy from detectors and vehicles at one step; see `JunctionView`."""

    detectors: Mapping[str, Detector]
    sees: bool = False
    priority: tuple[PriorityCall, ...] = ()


NO_OBSERVATIONS = Observations({})
