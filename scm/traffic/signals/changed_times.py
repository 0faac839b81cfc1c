"""Least times of all junctions, made anew when the version of a car in force makes the worst worse.

One junction is checked a step, as all are when a map is loaded. Only when every junction is proven
are the new times requested; each controller uses them from its next safe moment on.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Literal

from scm.clock import NS_PER_S
from scm.errors import PlanError
from scm.records.city_map import CityMap
from scm.traffic.signals.changed_cars import ChangedCars
from scm.traffic.signals.controller_state import Timing
from scm.traffic.signals.junction_timings import check_timing, timings_for
from scm.traffic.signals.kernel import GroupTimes
from scm.traffic.signals.timing import CarFacts
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.twin_status import TwinStatus

LEFT, ENTERED = ("vehicle_removed", "vehicle_left"), ("vehicle_spawned", "vehicle_joined")
Timings = Mapping[str, Timing]
TIMES: tuple[tuple[str, Callable[[GroupTimes], int], tuple[str, ...]], ...] = (
    ("yellow", lambda times: times.yellow, ("reaction_s", "speed_mps")),
    ("red clear", lambda times: times.clearance, ("slow_mps",)),
    ("minimum green", lambda times: times.min_green, ("slow_mps", "reaction_s")),
)
"""What a group has, and the facts of cars that it follows from."""
FACTS = ("reaction_s", "slow_mps", "speed_mps")


class ChangedTimes:
    """The least times that follow from the cars' versions in force.

    Args:
        city_map: Whose junctions.
        given: The cars that the city was given by hand: no time gets shorter than theirs.
        timings: Of all junctions, for these.
    """

    def __init__(self, city_map: CityMap, given: CarFacts, timings: Timings) -> None:
        self._map, self._given = city_map, given
        self._least, self._requested = timings, timings
        self._cars = ChangedCars(given)
        self._target = given
        self._proving: Iterator[None] = iter(())
        self._made: Timings = timings
        self._events: list[Outgoing] = []

    def receive(self, message: TwinStatus | CityEvent, now_ns: int) -> None:
        """Take a car's version in force, or that a car came or went."""
        if isinstance(message, TwinStatus):
            nonsense = self._cars.receive(message)
            if nonsense:
                text = f"signals do not follow {message.vehicle}, version {message.version}: "
                self._event("warning", "abilities_ignored", text + nonsense, now_ns)
        elif message.vehicle is not None and message.name in LEFT:
            self._cars.leave(message.vehicle)
        elif message.vehicle is not None and message.name in ENTERED:
            self._cars.enter(message.vehicle)

    def step(self, now_ns: int) -> tuple[Timings, list[Outgoing]]:
        """Check one more junction; return timings to request, if any, and events."""
        if self._cars.worst != self._target:
            self._target = self._cars.worst
            self._proving = self._prove(self._target)
        timings: Timings = {}
        try:
            next(self._proving)
        except StopIteration:
            if self._made is not self._requested:
                self._announce(now_ns)
                timings = self._requested = self._made
        except PlanError as wrong:
            self._made = self._requested
            text = f"signal times stay as they are, though {self._cars.why(FACTS)}: {wrong}"
            self._event("warning", "signal_times_refused", text, now_ns)
        events, self._events = self._events, []
        return timings, events

    def _prove(self, car: CarFacts) -> Iterator[None]:
        """Make the times for a car, and check them, one junction a step."""
        if car == self._given:
            self._made = self._least
            return
        made = timings_for(self._map, car, longer=True)
        for name, timing in made.items():
            check_timing(name, timing)
            yield
        self._made = made
        if all(timing.program == self._least[name].program for name, timing in made.items()):
            self._made = self._least  # worse by less than a step of the signals

    def _announce(self, now_ns: int) -> None:
        """Say what changes, and why."""
        facts, words, is_longer = list[str](), list[str](), False
        for what, of, follows in TIMES:
            before, now = (_longest_s(timings, of) for timings in (self._requested, self._made))
            if before != now:
                words.append(f"{what} {before:.1f} to {now:.1f} s")
                facts += follows
                is_longer |= now > before
        why = (
            self._cars.why(dict.fromkeys(facts))
            or "as given by hand: no version in force needs more"
        )
        text = f"{', '.join(words) or 'signal times'}, from the next safe moment on: {why}"
        self._event("warning" if is_longer else "info", "signal_times", text, now_ns)

    def _event(self, severity: Literal["info", "warning"], name: str, text: str, t_ns: int) -> None:
        self._events.append(
            CityEvent(severity=severity, source="traffic", t_ns=t_ns, name=name, text=text)
        )


def _longest_s(timings: Timings, of: Callable[[GroupTimes], int]) -> float:
    times = (of(times) for timing in timings.values() for times in timing.program.times)
    return max(times, default=0) / NS_PER_S
