"""The hosted cars' dynamics: one fleet a car file, so that one kernel call moves all its cars."""

import logging
import threading
from collections.abc import Callable
from typing import cast

import numpy as np

from scm.arrays import AnyArray, Floats, Ints
from scm.geometry import Pose2
from scm.log import event
from scm.vehicles.battery_pack import Packs
from scm.vehicles.car import Car, car_names, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.ground import Ground
from scm.vehicles.handed import digest_of_car
from scm.vehicles.vehicle_status import VehicleStatus
from scm.world.hosted import ELSEWHERE
from scm.world.solids import Hull, hull_of
from scm.world.vehicle_arrays import VehicleArrays

_log = logging.getLogger(__name__)
_NOBODY: Ints = np.empty(0, np.int64)


class Garage:
    """Fleets by the name of their car file.

    Args:
        capacity: Most cars at a time.
        fit: What a car file's car is here; the floor may give it more effects.

    Attributes:
        fleets: Those in use; a row's index is its car's vehicle index.
    """

    def __init__(self, capacity: int, fit: Callable[[Car], Car]) -> None:
        self._capacity = capacity
        self._fit = fit
        self._cars: dict[str, Car] = {}
        self._digests: dict[str, str] = {}
        self._hulls: dict[tuple[str, bool], Hull] = {}
        self.fleets: dict[str, Fleet] = {}
        self._packs: dict[str, Packs] = {}
        self._rows: dict[str, Ints] = {}
        self._indices: dict[str, Ints] = {}
        self._elsewhere: dict[str, Ints] = {}
        self._threads = 1
        self._preparing = threading.Lock()

    def car(self, name: str) -> Car:
        """Return a car file, read once.

        Raises:
            CarError: when there is none of that name, or it is wrong.
        """
        if name not in self._cars:
            car = load_car(name)
            self._cars[name] = self._fit(car)
            self._digests[name] = digest_of_car(car)
            if given := [t.name for t in self._cars[name].terms if t not in car.terms]:
                event(_log, "car_given_effects", car=name, effects=",".join(given))
        return self._cars[name]

    def is_known(self, name: str) -> bool:
        """Return whether a text from outside is the name of a car file, and no path.

        Raises:
            CarError: when the folder of car files cannot be read.
        """
        return name in self._cars or name in car_names()

    def digest(self, name: str) -> str:
        """Return a hash of a car file as `car` has read it, without what the floor adds.

        Raises:
            CarError: when there is none of that name, or it is wrong.
        """
        self.car(name)
        return self._digests[name]

    def hull(self, name: str, *, movable: bool = True) -> Hull:
        """Return what cars of a file are to others, one for all of them.

        Raises:
            CarError: when there is no such car file.
        """
        if (name, movable) not in self._hulls:
            self._hulls[name, movable] = hull_of(self.car(name), movable=movable)
        return self._hulls[name, movable]

    def prepare(self, name: str) -> Fleet:
        """Return the fleet of a car file; the first call compiles or loads its kernel, for seconds.

        It may be called from any thread.

        Raises:
            CarError: when there is no such car file.
        """
        if name not in self.fleets:
            with self._preparing:
                if name not in self.fleets:
                    fleet = Fleet(self.car(name), self._capacity)
                    fleet.threads = self._threads
                    self._packs[name] = Packs(fleet)
                    self.fleets[name] = fleet
        return self.fleets[name]

    def park(self, name: str, pose: Pose2, index: int) -> tuple[Fleet, int]:
        """Put a car of a file on the floor; return its fleet and row.

        Raises:
            CarError: when there is no such car file.
            RunError: when the fleet is full.
        """
        fleet = self.prepare(name)
        row = fleet.add(pose)
        self._packs[name].renew(row)
        self._rows[name] = np.append(self.rows(name), row)
        self._indices[name] = np.append(self.indices(name), index)
        return fleet, row

    def scrap(self, name: str, row: int, index: int) -> None:
        """Remove a car from the floor, or forget that it is elsewhere."""
        if row == ELSEWHERE:
            self._elsewhere[name] = self._elsewhere[name][self._elsewhere[name] != index]
            return
        self.fleets[name].remove(row)
        others = self._rows[name] != row
        self._rows[name], self._indices[name] = (
            self._rows[name][others],
            self._indices[name][others],
        )

    def note_elsewhere(self, name: str, index: int) -> None:
        """Note that another process simulates a car of a file."""
        self._elsewhere[name] = np.append(self.elsewhere(name), index)

    def elsewhere(self, name: str) -> Ints:
        """Return the world's numbers of a file's cars that another process simulates."""
        return self._elsewhere.get(name, _NOBODY)

    def hand_out(self, name: str, row: int, index: int) -> None:
        """Remove a car whose memory was copied: from now on another process simulates it."""
        self.scrap(name, row, index)
        self.note_elsewhere(name, index)

    def accept(self, name: str, index: int) -> int:
        """Return a row for a car that another process simulated; its memory is to be written."""
        self.scrap(name, ELSEWHERE, index)
        row, at = self.prepare(name).claim_row(), int(np.searchsorted(self.indices(name), index))
        self._rows[name] = np.insert(self.rows(name), at, row)
        self._indices[name] = np.insert(self.indices(name), at, index)
        return row

    def memory(self, name: str, row: int) -> tuple[AnyArray, ...]:
        """Return views of all that is stored of a row: dynamics and battery."""
        return (*self.fleets[name].memory(row), *self._packs[name].memory(row))

    def rows(self, name: str) -> Ints:
        """Return the rows in use of a fleet, in the order its cars came."""
        return self._rows.get(name, _NOBODY)

    def indices(self, name: str) -> Ints:
        """Return the world's numbers of the cars in `rows`."""
        return self._indices.get(name, _NOBODY)

    def packs(self, name: str) -> Packs:
        """Return the batteries of a fleet in use."""
        return self._packs[name]

    def use_threads(self, count: int) -> None:
        """Advance fleets on several threads, existing and future ones."""
        self._threads = count
        for fleet in self.fleets.values():
            fleet.threads = count

    def command(self, vehicles: VehicleArrays) -> None:
        """Command all motors and servos."""
        for name, rows in self._rows.items():
            fleet, own = self.fleets[name], self._indices[name]
            fleet.throttle[rows] = vehicles.throttle[own]
            fleet.steering[rows] = vehicles.steering[own]

    def advance(self, ground: Ground, t_ns: int, duration: float) -> None:
        """Move all cars for a time [s] on the floor and in the wind of an instant."""
        for name, rows in self._rows.items():
            if len(rows):
                ground.feel(self.fleets[name], t_ns)
                self.fleets[name].advance(duration)

    def drain(self, duration: float) -> None:
        """Discharge all batteries by what the cars draw over a time [s]."""
        for name, rows in self._rows.items():
            self._packs[name].drain(rows, duration)

    def locate(self, vehicles: VehicleArrays) -> None:
        """Write where all cars are and how they move into the vehicle arrays."""
        for name, rows in self._rows.items():
            fleet, own = self.fleets[name], self._indices[name]
            vehicles.x[own] = fleet.x[rows]
            vehicles.y[own] = fleet.y[rows]
            vehicles.yaw[own] = fleet.yaw[rows]
            vehicles.speed[own] = fleet.speed[rows]
            vehicles.yaw_rate[own] = fleet.yaw_rate[rows]

    def signal(self, name: str) -> Floats:
        """Return one signal by vehicle index, (capacity,); 0 where there is no hosted car."""
        values = np.zeros(self._capacity)
        for car_file, rows in self._rows.items():
            of_fleet = cast("Floats", getattr(self.fleets[car_file], name))
            values[self._indices[car_file]] = of_fleet[rows]
        return values

    def batteries(self) -> tuple[Floats, Floats]:
        """Return voltage under load [V] and charge left by vehicle index; NaN: no battery."""
        volts, charge = np.full((2, self._capacity), np.nan)
        for name, rows in self._rows.items():
            own, packs = self._indices[name], self._packs[name]
            volts[own], charge[own] = packs.volts[rows], packs.charge[rows]
        return volts, charge

    def frozen(self) -> Ints:
        """Return the indices of cars whose dynamics diverged."""
        return np.concatenate(
            [
                self._indices[name][self.fleets[name].status[rows] != VehicleStatus.OK]
                for name, rows in self._rows.items()
            ]
            or [_NOBODY]
        )

    def poses(self, name: str) -> Floats:
        """Return the rear-axle poses of the cars in `rows`, (n, 3)."""
        fleet, rows = self.fleets[name], self.rows(name)
        return np.column_stack((fleet.x[rows], fleet.y[rows], fleet.yaw[rows]))

    def motion(self, name: str) -> Floats:
        """Return the motion of the centres of gravity of the cars in `rows`, (n, 6)."""
        return self.fleets[name].planar_cogs(self.rows(name))
