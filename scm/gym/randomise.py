"""Numbers of cars that are drawn anew for each episode (domain randomisation).

    by the file     each number with a standard deviation: normal, with the file's correlations
    by ranges       any number of any known effect: uniform between two ends

An effect that the car file does not name is added where a range is of one of its numbers.
Source: Tobin et al., "Domain randomization for transferring deep neural networks from simulation to
the real world", 2017.
"""

from collections.abc import Mapping

import numpy as np

from scm.arrays import Floats, Ints
from scm.errors import CarError, nearest
from scm.vehicles.car import Car, all_terms
from scm.vehicles.fleet import Fleet
from scm.vehicles.noise import Keys, normals, uniforms

NORMAL, EVEN = np.uint64(0x4EA1), np.uint64(0xE7E4)

Ranges = Mapping[str, tuple[float, float]]


def with_effects(car: Car, ranges: Ranges) -> Car:
    """Return a car that has every number of some ranges, with effects that do nothing yet.

    Raises:
        CarError: No effect has such a number, or its range is none or beyond its bounds.
    """
    owners = {param.key: term for term in all_terms().values() for param in term.params}
    for key, (low, high) in ranges.items():
        if not car.has(key) and key not in owners:
            known = [*owners, *car.values]
            raise CarError(f"randomise: {key}: no effect has it{nearest(key, sorted(known))}")
        if not low <= high:
            raise CarError(f"randomise: {key}: expected low and high, got {low} and {high}")
    new = {owners[key].name: owners[key] for key in ranges if not car.has(key)}.values()
    neutral = {
        param.key: term.neutral[param.name]
        for term in new
        for param in term.params
        if param.name in term.neutral
    }
    return car.with_terms(list(new), neutral) if new else car


class Randomise:
    """Draws numbers of a fleet's cars.

    Args:
        fleet: Of cars of one file.
        spread: Of numbers by the file, as a multiple of their standard deviations; 0: none.
        ranges: Low and high of others, by `section.key`.

    Raises:
        CarError: A range lies beyond the number's bounds.
    """

    def __init__(self, fleet: Fleet, spread: float, ranges: Ranges) -> None:
        self._fleet, car = fleet, fleet.car
        keys = [column.param.key for column in fleet.columns]
        self._bounds = np.array([column.param.bounds for column in fleet.columns]).T
        self._mean = np.array([car.value(key) for key in keys])
        stds = [(car.values[key].std or 0.0) if key in car.values else 0.0 for key in keys]
        self._std = spread * np.array(stds)
        self._root = np.eye(len(keys))
        for group in car.correlated:
            known = [k for k, key in enumerate(group.numbers) if key in keys]
            at = [keys.index(group.numbers[k]) for k in known]
            root = np.linalg.cholesky(np.array(group.matrix)[np.ix_(known, known)])
            self._root[np.ix_(at, at)] = root
        self._columns: Ints = np.array([keys.index(key) for key in ranges], np.int64)
        self._low, self._high = np.array(list(ranges.values())).reshape(-1, 2).T
        low, high = self._bounds[:, self._columns]
        for k, key in enumerate(ranges):
            if not low[k] <= self._low[k] <= self._high[k] <= high[k]:
                raise CarError(
                    f"randomise: {key} from {self._low[k]:g} to {self._high[k]:g}: expected "
                    f"{low[k]:g} to {high[k]:g} {fleet.columns[self._columns[k]].param.unit}"
                )

    @property
    def is_any(self) -> bool:
        """Whether anything is drawn at all."""
        return bool(self._std.any()) or len(self._columns) > 0

    def draw(self, rows: Ints, keys: Keys) -> None:
        """Draw the numbers of cars (n,) by their episodes' keys (n,)."""
        if self._std.any():
            errors: Floats = normals(keys ^ NORMAL, len(self._mean)) @ self._root.T
            drawn = self._mean + self._std * errors
            self._fleet.parameters[rows] = np.clip(drawn, *self._bounds)
        if len(self._columns):
            share = uniforms(keys ^ EVEN, len(self._columns))
            drawn = self._low + share * (self._high - self._low)
            self._fleet.parameters[rows[:, None], self._columns] = drawn
