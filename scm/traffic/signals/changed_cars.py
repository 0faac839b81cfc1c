"""What signals must know of cars that have changed: the versions in force of their car files.

A version's `abilities` say how fast the car drives and how far it rolls until it stands, each with
a 90 % interval. Signals follow the worse end of it:

    slow      the lowest speed at 0.8 throttle
    speed     the fastest approach, faster by as much as 0.8 throttle gives at most more than before
    reaction  longer by as long as the car takes for the way that it needs at most more to stop

"Before" is by the file that the car came with. What the city was given by hand is the least: no
version makes any time shorter. `MAX_FACTOR` bounds what a version can do.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from scm.records.twins import TwinVersion
from scm.traffic.car_facts import slowest_of
from scm.traffic.signals.timing import LANE_MPS, CarFacts
from scm.v2x.messages.twin_status import TwinStatus, ability_problem

MAX_FACTOR = 4.0  # times what was given by hand: a car worse than that does not belong on the road
MAX_CARS = 10_000  # of different names; a station could invent them


@dataclass(frozen=True, slots=True)
class _Changed:
    """A car by its version in force: its facts, and each that is worse in words."""

    facts: CarFacts
    words: dict[str, str]


class ChangedCars:
    """The worst of all cars by their versions in force.

    Args:
        given: The cars that the city was given by hand.
    """

    def __init__(self, given: CarFacts) -> None:
        self._given = given
        self._cars: dict[str, _Changed] = {}
        self._away: dict[str, _Changed] = {}
        self._versions: dict[str, tuple[str, int]] = {}

    def receive(self, status: TwinStatus) -> str:
        """Take a car's version in force; return what of it is nonsense, once a version."""
        version = status.in_force
        known = status.car, status.version
        is_new = self._versions.get(status.vehicle) != known
        if version is None or (is_new and len(self._versions) >= MAX_CARS):
            return ""
        self._versions[status.vehicle] = known
        self._away.pop(status.vehicle, None)
        self._cars.pop(status.vehicle, None)
        nonsense = [ability_problem(one) for one in version.abilities]
        changed = _changed(status, version, self._given)
        if changed.words:
            self._cars[status.vehicle] = changed
        return "; ".join(filter(None, nonsense)) if is_new else ""

    def leave(self, vehicle: str) -> None:
        """Forget a car for as long as it is gone."""
        if vehicle in self._cars:
            self._away[vehicle] = self._cars.pop(vehicle)

    def enter(self, vehicle: str) -> None:
        """Take a car as it was when it left."""
        if vehicle in self._away:
            self._cars[vehicle] = self._away.pop(vehicle)

    @property
    def worst(self) -> CarFacts:
        """One car that is as bad as the worst of all in everything."""
        return slowest_of([self._given, *(car.facts for car in self._cars.values())])

    def why(self, facts: Iterable[str]) -> str:
        """Return which cars make facts worse than those given by hand; empty: none.

        Args:
            facts: Of `CarFacts`, by name.
        """
        worst, found = self.worst, list[str]()
        for fact in facts:
            worst_cars = (
                f"{name} {car.words[fact]}"
                for name, car in self._cars.items()
                if fact in car.words and getattr(car.facts, fact) == getattr(worst, fact)
            )
            found += list(worst_cars)[:1]
        return ", ".join(found)


def _changed(status: TwinStatus, version: TwinVersion, given: CarFacts) -> _Changed:
    """Return a car by its version in force, no better in anything than what was given."""
    now = {one.name: one for one in version.abilities if not ability_problem(one)}
    before = {one.name: one.before for one in _first(status, version).abilities}
    facts, words = given, dict[str, str]()
    speed, stop = now.get("cruise_mps"), now.get("stopping_m")
    if speed is not None:
        slowest_mps = min(given.slow_mps, LANE_MPS) / MAX_FACTOR
        if speed.low < given.slow_mps:
            facts = replace(facts, slow_mps=max(speed.low, slowest_mps))
            words["slow_mps"] = f"may drive only {speed.low:.2g} m/s at 0.8 of its throttle"
        faster = _ratio(speed.high, before.get("cruise_mps"))
        if faster > 1.0 and math.isfinite(given.speed_mps):
            facts = replace(facts, speed_mps=given.speed_mps * min(faster, MAX_FACTOR))
            words["speed_mps"] = f"may drive {100.0 * (faster - 1.0):.2g} % faster than before"
    was_m = before.get("stopping_m")
    if stop is not None and was_m is not None and 0.0 <= was_m < stop.high:
        later_s = (stop.high - was_m) / max(facts.slow_mps if speed is None else speed.low, 1e-3)
        latest_s = MAX_FACTOR * given.reaction_s
        facts = replace(facts, reaction_s=min(given.reaction_s + later_s, latest_s))
        words["reaction_s"] = f"may need {stop.high:.2g} m to stop, {was_m:.2g} before"
    return _Changed(facts, words)


def _first(status: TwinStatus, version: TwinVersion) -> TwinVersion:
    """Return the first version of those from which one was found: its "before" is the car's own."""
    return list(_line(status, version))[-1]


def _line(status: TwinStatus, version: TwinVersion) -> Iterator[TwinVersion]:
    by_number = {one.number: one for one in status.versions if one.abilities}
    yield version
    while version.after in by_number and version.after < version.number:
        version = by_number[version.after]
        yield version


def _ratio(now: float, before: float | None) -> float:
    is_known = before is not None and math.isfinite(before) and before > 0.0
    return now / before if before is not None and is_known else 1.0
