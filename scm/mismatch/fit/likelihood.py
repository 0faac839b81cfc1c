"""How well a car with given numbers explains recordings: weighted residuals of many sets at once.

A `Simulator` drives recordings again; a `Likelihood` is a simulator with a noise model. It never
changes: another noise model is another likelihood on the same simulator.
"""

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.budget import Budget
from scm.mismatch.fit.noise import Noise, usual_noise
from scm.mismatch.fit.rollouts import Motions, Rollouts, Tiles
from scm.mismatch.fit.sensor_prediction import Prediction
from scm.mismatch.fit.whitening import Whitener
from scm.replay.drive import Drive
from scm.replay.numbers import COMMAND_CLOCK, NEUTRAL, POSE_CLOCK, THROTTLE_CLOCK, Numbers
from scm.vehicles.car import Car
from scm.vehicles.param import Param

Key = frozenset[tuple[str, float]]


@dataclass(frozen=True, slots=True)
class NominalParameter:
    """A number of the car file that is free within the standard deviation that the file states."""

    key: str
    mean: float
    std: float
    bounds: tuple[float, float]


LOCK = "drive.axle_lock"
UNKNOWN = {LOCK: (0.5, 0.5)}  # what no car file says and every car has
TRANSIENT_S = 1.0  # of a drive, in which the unknown motion before it still shows
MAX_CACHED = 160  # sets whose residuals are cached for each drive
TIMING_S = 0.003  # no recording's stamps, and no model of a motor's controller, are better
MIN_RELATIVE_STD = {"body.mass_kg": 0.08}  # cars are weighed without cables, tape and battery
_CLOCKS = tuple(
    NominalParameter(key, 0.0, TIMING_S, (-3.0 * TIMING_S, 3.0 * TIMING_S))
    for key in (COMMAND_CLOCK, THROTTLE_CLOCK, POSE_CLOCK)
)


def nominal_parameters(car: Car, params: Sequence[Param]) -> tuple[NominalParameter, ...]:
    """Return every number of a car and of its sensors' faults that its file says is uncertain."""
    found = dict[str, NominalParameter]()
    for param in (*params, *fault_params(car)):
        std = car.quantity(param.key).std
        if param.key in UNKNOWN and not std:
            mean, std = UNKNOWN[param.key]
            found[param.key] = NominalParameter(param.key, mean, std, param.bounds)
        elif param.fit and std:
            mean = car.value(param.key)
            std = max(std, MIN_RELATIVE_STD.get(param.key, 0.0) * abs(mean))
            found[param.key] = NominalParameter(param.key, mean, std, param.bounds)
    return (*found.values(), *_CLOCKS)


def fault_params(car: Car) -> tuple[Param, ...]:
    """Return the parameters of the sensor faults that a car file states."""
    return tuple(
        param for fault in car.measures for param in fault.kind.params if param.key in NEUTRAL
    )


def prior_precision(car: Car, keys: Sequence[str]) -> Floats:
    """Return the inverse of the correlations that the car file states between numbers, (n, n)."""
    at, found = {key: i for i, key in enumerate(keys)}, np.eye(len(keys))
    for block in car.correlated:
        mine = [j for j, key in enumerate(block.numbers) if key in at]
        where = [at[block.numbers[j]] for j in mine]
        if where:
            matrix = np.array(block.matrix)[np.ix_(mine, mine)]
            found[np.ix_(where, where)] = np.linalg.inv(matrix)
    return found


class RecentSets:
    """Residuals of the sets of one drive that were requested last.

    They share one block: each alone would lie between large arrays that come and go, and leave
    gaps there that no other array fits into.
    """

    def __init__(self, events: int) -> None:
        self._block, self._ok = np.empty((MAX_CACHED, events)), np.zeros(MAX_CACHED, dtype=np.bool_)
        self._rows: OrderedDict[Key, int] = OrderedDict()

    def __contains__(self, key: Key) -> bool:
        return key in self._rows

    def of(self, key: Key) -> tuple[Floats, bool]:
        """Return a set's residuals, (events,), and whether it stayed physical."""
        row = self._rows[key]
        return self._block[row], bool(self._ok[row])

    def store(self, keys: Sequence[Key], left: Floats, ok: Bools) -> None:
        """Store sets, (events, sets); those requested last stay longest."""
        columns = dict[Key, int]()
        for column, key in enumerate(keys):
            columns.pop(key, None)
            columns[key] = column
            if key in self._rows:
                self._rows.move_to_end(key)
        newest = list(columns)[-MAX_CACHED:]
        more = sum(key not in self._rows for key in newest)
        while len(self._rows) + more > MAX_CACHED:
            self._rows.popitem(last=False)
        free = sorted(set(range(MAX_CACHED)) - set(self._rows.values()), reverse=True)
        for key in newest:
            if key not in self._rows:
                self._rows[key] = row = free.pop()
                self._block[row], self._ok[row] = left[:, columns[key]], ok[columns[key]]
            self._rows.move_to_end(key)


class Simulator:
    """Recordings of one car, driven again with given numbers.

    Residuals of recent sets are cached: fits return to their best so far.

    Attributes:
        nominal: The car's own uncertain numbers, in the order of every `z`.
        budget: Checked before sets are driven and between, on all threads; what that raises ends
            the run, and caches nothing.
        runs: How many sets were requested so far.
    """

    def __init__(
        self,
        drives: Sequence[Drive],
        car: Car,
        tiles: Tiles | None = None,
        budget: Budget | None = None,
    ) -> None:
        self.car, self.drives, self.budget = car, drives, budget or Budget()
        self.tiles = tiles or Tiles(car)
        self.rollouts = [Rollouts(drive, car, self.tiles) for drive in drives]
        self._recent = [RecentSets(sum(len(s.t) for s in drive.streams)) for drive in drives]
        self.nominal = nominal_parameters(car, self.rollouts[0].params)
        self._predictions = [Prediction(drive) for drive in drives]
        self._stated = {param.key: car.value(param.key) for param in fault_params(car)}
        self.runs = 0

    @cached_property
    def prior(self) -> Floats:
        """Precision of the car's own numbers `z` before anything is measured, (n, n)."""
        return prior_precision(self.car, [o.key for o in self.nominal])

    def unit(self, key: str) -> str:
        """Return the unit of one of the car's numbers."""
        params = (*self.rollouts[0].params, *fault_params(self.car))
        return next((p.unit for p in params if p.key == key), "s")

    def residuals(self, sets: Sequence[Numbers]) -> tuple[list[list[Floats]], Bools]:
        """Return residuals of every drive's streams, and which sets stayed physical."""
        self.budget.check()
        self.runs += len(sets)
        found = [self.residuals_of(i, sets) for i in range(len(self.drives))]
        return [left for left, _ in found], np.all([ok for _, ok in found], axis=0)

    def residuals_of(self, i: int, sets: Sequence[Numbers]) -> tuple[list[Floats], Bools]:
        """Return residuals of one drive's streams, (samples, sets), and which sets are fine."""
        recent, keys = self._recent[i], [frozenset(numbers.items()) for numbers in sets]
        first = dict[Key, int]()
        for column, key in enumerate(keys):
            first.setdefault(key, column)
        new = [column for key, column in first.items() if key not in recent]
        cuts = np.cumsum([len(stream.t) for stream in self.drives[i].streams])
        left, ok = np.empty((cuts[-1], len(sets))), np.empty(len(sets), dtype=np.bool_)
        streams, driven = np.split(left, cuts[:-1]), [sets[column] for column in new]

        def collect(motions: Motions, which: Sequence[int]) -> None:
            self.budget.check()
            mine = [new[k] for k in which]
            residuals = self._predictions[i].residuals(motions, [driven[k] for k in which])
            for stream, residual in zip(streams, residuals, strict=True):
                stream[:, mine] = residual
            ok[mine] = motions.ok

        self.rollouts[i].each(driven, collect)
        for column, key in enumerate(keys):
            if key in recent:
                left[:, column], ok[column] = recent.of(key)
            elif first[key] != column:
                left[:, column], ok[column] = left[:, first[key]], ok[first[key]]
        recent.store(keys, left, ok)
        return streams, ok

    def numbers(self, z: Floats) -> dict[str, float]:
        """Return the car's own numbers at `z` standard deviations from the file's.

        Faults of sensors that the file states are among them.
        """
        own = {o.key: clipped(o, v) for o, v in zip(self.nominal, z, strict=True)}
        return self._stated | own

    def unfitted(self) -> Floats:
        """Return `z` of the car as it is driven where nothing is fitted.

        It is 0 except for what no file states: there the equations' own number is driven, which is
        not the likeliest.
        """
        own = [self.car.value(o.key) if o.key in UNKNOWN else o.mean for o in self.nominal]
        return np.array([(x - o.mean) / o.std for x, o in zip(own, self.nominal, strict=True)])


Signatures = Mapping[str, Sequence[Sequence[Floats]]]
"""What one unit of a sensor's effect adds to each stream of each drive, by the effect's key."""


class Likelihood:
    """One car's recordings under one noise model; it never changes.

    Attributes:
        t: Times of all innovations, (events,).
        valid: 0 while the start still matters and where poses are missing for long, else 1.
        signatures: Of the sensor effects that these recordings can show.
    """

    def __init__(
        self,
        simulator: Simulator,
        noise: Noise | None = None,
        signatures: Signatures | None = None,
        like: Sequence[Whitener] = (),
    ) -> None:
        self.simulator, self.signatures = simulator, signatures or {}
        self.drives, self.car, self.nominal = simulator.drives, simulator.car, simulator.nominal
        self.noise = self._allowed(noise or usual_noise(self.drives))
        self.whiteners = self._whiteners(like)
        self.t = np.concatenate([w.t for w in self.whiteners])
        self.valid = self._valid()

    @classmethod
    def of(
        cls,
        drives: Sequence[Drive],
        car: Car,
        tiles: Tiles | None = None,
        budget: Budget | None = None,
    ) -> Self:
        """Return the likelihood of recordings under the usual noise."""
        return cls(Simulator(drives, car, tiles, budget))

    def under(self, noise: Noise) -> Self:
        """Return the likelihood of the same recordings under another noise model."""
        if noise == self.noise:
            return self
        return type(self)(self.simulator, noise, self.signatures, self.whiteners)

    def with_signatures(self, signatures: Signatures) -> Self:
        """Return the same likelihood with what sensor effects would add."""
        return type(self)(self.simulator, self.noise, signatures, self.whiteners)

    def _allowed(self, noise: Noise) -> Noise:
        return noise

    def _whiteners(self, like: Sequence[Whitener]) -> Sequence[Whitener]:
        if like:
            return [whitener.under(self.noise) for whitener in like]
        return [Whitener(drive, self.noise) for drive in self.drives]

    def _valid(self) -> Floats:
        begun = [
            (w.t > d.edges[0] + TRANSIENT_S) & ~d.is_blind(w.t)
            for w, d in zip(self.whiteners, self.drives, strict=True)
        ]
        return np.concatenate(begun).astype(np.float64)

    @cached_property
    def log_size(self) -> Floats:
        """Logarithm of each innovation's variance, (events,)."""
        return np.concatenate([w.log_size for w in self.whiteners])

    def residuals(self, sets: Sequence[Numbers]) -> tuple[list[list[Floats]], Bools]:
        """Return residuals of all streams less sensor effects, and which sets are fine."""
        found, ok = self.simulator.residuals(sets)
        for row, numbers in enumerate(sets):
            for key in self.signatures.keys() & numbers.keys():
                for streams, adds in zip(found, self.signatures[key], strict=True):
                    for residual, add in zip(streams, adds, strict=True):
                        residual[:, row] -= numbers[key] * add
        return found, ok

    def weigh(
        self, residuals: Sequence[Sequence[Floats]], whiteners: Sequence[Whitener] | None = None
    ) -> Floats:
        """Return the unit innovations of all drives, (events, sets), by other whiteners too."""
        by = self.whiteners if whiteners is None else whiteners
        parts = [w.innovations(r) for w, r in zip(by, residuals, strict=True)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=0)

    def __call__(self, sets: Sequence[Numbers]) -> tuple[Floats, Bools]:
        """Return unit innovations of each set, (events, sets), and which stayed physical."""
        residuals, ok = self.residuals(sets)
        return self.weigh(residuals), ok


def clipped(parameter: NominalParameter, z: float) -> float:
    """Return a number at `z` standard deviations, within its bounds."""
    low, high = parameter.bounds
    return float(min(max(parameter.mean + z * parameter.std, low), high))
