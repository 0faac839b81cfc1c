"""One case as a scenario gets it: its city's parts with everything that the factors changed."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from scm.camera.daylight import Daylight
from scm.fleet import City, LockstepLink
from scm.records.city_map import CityMap
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Part
from scm.study.study_file import Value
from scm.study.targets import Setting
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.faults import FaultRates, Faults
from scm.vehicles.car import Car
from scm.world.part import ROOM, WorldPart
from scm.world.world import generator

MakeLockstep = Callable[[Iterable[Part], Faults | None], Lockstep]


def plain_lockstep(parts: Iterable[Part], faults: Faults | None) -> Lockstep:
    """Return a city as fast as it can be computed."""
    return Lockstep(parts, faults=faults)


@dataclass(frozen=True, slots=True)
class Case:
    """One case of a study.

    Attributes:
        study: Name of the study.
        number: Which case.
        seed: Of all its randomness.
        values: Of the factors.
        setting: Map, cars and network as the factors make them.
        make: How `lockstep` makes a city: a replay makes one that can be watched.
    """

    study: str
    number: int
    seed: int
    values: Mapping[str, Value]
    setting: Setting
    make: MakeLockstep = field(default=plain_lockstep, repr=False)

    @property
    def map(self) -> CityMap:
        """The map."""
        return self.setting.city_map

    @property
    def cars(self) -> Mapping[str, Car]:
        """The car files that the study names or changes, by name."""
        return self.setting.cars

    @property
    def network(self) -> FaultRates:
        """What happens to messages between parts."""
        return self.setting.network

    @property
    def daylight(self) -> Daylight:
        """The light for `scm.camera.part.CameraPart`."""
        return self.setting.daylight

    def generator(self, *names: str) -> np.random.Generator:
        """Return random numbers of this case; equal names, equal numbers."""
        return generator(self.seed, "study", *names)

    def world(self, hosted: tuple[tuple[str, str], ...] = (), room: int = ROOM) -> WorldPart:
        """Return the world of this case.

        Args:
            hosted: (name, car file) of cars that are there from the start, and circulate.
            room: How many more may come.
        """
        return WorldPart(self.map, self.seed, hosted, room)

    def lockstep(self, parts: Iterable[Part]) -> Lockstep:
        """Return a city of these parts, with this case's network between them."""
        rates = self.network
        return self.make(parts, None if rates == FaultRates() else Faults(self.seed, rates))

    @contextmanager
    def open_city(self) -> Iterator[City]:
        """Open a city for a fleet script: world, traffic signals and monitor."""
        parts: list[Part] = [self.world(), TrafficPart(self.map), MonitorPart(self.map)]
        with self.lockstep(parts) as lockstep:
            yield City(LockstepLink(lockstep))
