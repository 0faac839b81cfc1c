"""How well a car with given numbers explains recordings: weighed residuals of many sets at once."""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.fit.noise import Noise, usual_noise
from scm.mismatch.fit.rollouts import Motions, Rollouts, Tiles
from scm.mismatch.fit.sensor_prediction import Prediction
from scm.mismatch.fit.whitening import Whitener
from scm.replay.drive import Drive
from scm.replay.numbers import COMMAND_CLOCK, POSE_CLOCK, THROTTLE_CLOCK, Numbers
from scm.vehicles.car import Car
from scm.vehicles.param import Param

Key = frozenset[tuple[str, float]]


@dataclass(frozen=True, slots=True)
class NominalParameter:
    """A number of the car file that is free within the scatter that the file states."""

    key: str
    mean: float
    std: float
    bounds: tuple[float, float]


LOCK = "drive.axle_lock"
UNKNOWN = {LOCK: (0.5, 0.5)}  # what no car file says and every car has
SETTLED_S = 1.0
KEPT = 160  # sets whose residuals are remembered
TIMING_S = 0.003  # no recording's stamps, and no model of a motor's controller, are better
LEAST_SCATTER = {"body.mass_kg": 0.08}  # cars are weighed without cables, tape and battery
_CLOCKS = tuple(
    NominalParameter(key, 0.0, TIMING_S, (-3.0 * TIMING_S, 3.0 * TIMING_S))
    for key in (COMMAND_CLOCK, THROTTLE_CLOCK, POSE_CLOCK)
)


def nominal_parameters(car: Car, params: Sequence[Param]) -> tuple[NominalParameter, ...]:
    """Return every number of a car's equations that its file says is uncertain."""
    found = dict[str, NominalParameter]()
    for param in params:
        std = car.quantity(param.key).std
        if param.key in UNKNOWN and not std:
            mean, std = UNKNOWN[param.key]
            found[param.key] = NominalParameter(param.key, mean, std, param.bounds)
        elif param.fit and std:
            mean = car.value(param.key)
            std = max(std, LEAST_SCATTER.get(param.key, 0.0) * abs(mean))
            found[param.key] = NominalParameter(param.key, mean, std, param.bounds)
    return (*found.values(), *_CLOCKS)


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


class _Recent:
    """Residuals of the sets of one drive that were asked for last.

    They share one block: each alone would lie between large arrays that come and go, and leave
    gaps there that no other array fits into.
    """

    def __init__(self, events: int) -> None:
        self._block, self._ok = np.empty((KEPT, events)), np.zeros(KEPT, dtype=np.bool_)
        self._rows: OrderedDict[Key, int] = OrderedDict()

    def __contains__(self, key: Key) -> bool:
        return key in self._rows

    def of(self, key: Key) -> tuple[Floats, bool]:
        """Return a set's residuals, (events,), and whether it stayed physical."""
        row = self._rows[key]
        return self._block[row], bool(self._ok[row])

    def remember(self, keys: Sequence[Key], left: Floats, ok: Bools) -> None:
        """Remember sets, (events, sets), those asked for last the longest."""
        columns = dict[Key, int]()
        for column, key in enumerate(keys):
            columns.pop(key, None)
            columns[key] = column
            if key in self._rows:
                self._rows.move_to_end(key)
        latest = list(columns)[-KEPT:]
        more = sum(key not in self._rows for key in latest)
        while len(self._rows) + more > KEPT:
            self._rows.popitem(last=False)
        free = sorted(set(range(KEPT)) - set(self._rows.values()), reverse=True)
        for key in latest:
            if key not in self._rows:
                self._rows[key] = row = free.pop()
                self._block[row], self._ok[row] = left[:, columns[key]], ok[columns[key]]
            self._rows.move_to_end(key)


class Likelihood:
    """One car's recordings under one belief about noise.

    Attributes:
        nominal: The car's own uncertain numbers, in the order of every `z`.
        t: Times of all innovations, (events,).
        settled: 0 while the start still matters and where poses are missing for long, else 1.
        is_late: Says that no time is left: a fit ends with the round that it is in.
        asked: Is called before sets are driven and between, on all threads; what it raises ends
            that, and leaves nothing behind.
    """

    def __init__(self, drives: Sequence[Drive], car: Car, tiles: Tiles | None = None) -> None:
        self.car, self.drives = car, drives
        self.tiles = tiles or Tiles(car)
        self._rollouts = [Rollouts(drive, car, self.tiles) for drive in drives]
        self._recent = [_Recent(sum(len(s.t) for s in drive.streams)) for drive in drives]
        self.nominal = nominal_parameters(car, self._rollouts[0].params)
        self._predictions = [Prediction(drive) for drive in drives]
        self.whiteners = [Whitener(drive, usual_noise(drives)) for drive in drives]
        self.believe(usual_noise(drives))
        self.runs = 0
        self.asked: Callable[[], None] = lambda: None
        self.is_late: Callable[[], bool] = lambda: False

    @cached_property
    def prior(self) -> Floats:
        """Precision of the car's own numbers `z` before anything is measured, (n, n)."""
        return prior_precision(self.car, [o.key for o in self.nominal])

    def unit(self, key: str) -> str:
        """Return the unit of one of the car's numbers."""
        return next((p.unit for p in self._rollouts[0].params if p.key == key), "s")

    def believe(self, noise: Noise) -> None:
        """Take another belief about noise."""
        self.noise = noise
        self.whiteners = self.under(noise)
        self.t = np.concatenate([w.t for w in self.whiteners])
        begun = [
            (w.t > d.edges[0] + SETTLED_S) & ~d.is_blind(w.t)
            for w, d in zip(self.whiteners, self.drives, strict=True)
        ]
        self.settled = np.concatenate(begun).astype(np.float64)

    def under(self, noise: Noise) -> list[Whitener]:
        """Return what weighs residuals of every drive under some belief about noise."""
        return [whitener.under(noise) for whitener in self.whiteners]

    @property
    def log_size(self) -> Floats:
        """Logarithm of each innovation's variance, (events,)."""
        return np.concatenate([w.log_size for w in self.whiteners])

    def residuals(self, sets: Sequence[Numbers]) -> tuple[list[list[Floats]], Bools]:
        """Return residuals of every drive's streams, and which sets stayed physical."""
        self.asked()
        self.runs += len(sets)
        found = [self._left(i, sets) for i in range(len(self.drives))]
        return [left for left, _ in found], np.all([ok for _, ok in found], axis=0)

    def _left(self, i: int, sets: Sequence[Numbers]) -> tuple[list[Floats], Bools]:
        """Return residuals of each stream of one drive, (samples, sets), and which sets were fine.

        A set that was driven lately is not driven again: fits return to their best so far.
        """
        recent, keys = self._recent[i], [frozenset(numbers.items()) for numbers in sets]
        first = dict[Key, int]()
        for column, key in enumerate(keys):
            first.setdefault(key, column)
        new = [column for key, column in first.items() if key not in recent]
        cuts = np.cumsum([len(stream.t) for stream in self.drives[i].streams])
        left, ok = np.empty((cuts[-1], len(sets))), np.empty(len(sets), dtype=np.bool_)
        streams, driven = np.split(left, cuts[:-1]), [sets[column] for column in new]

        def take(motions: Motions, which: Sequence[int]) -> None:
            self.asked()
            mine = [new[k] for k in which]
            residuals = self._predictions[i].residuals(motions, [driven[k] for k in which])
            for stream, residual in zip(streams, residuals, strict=True):
                stream[:, mine] = residual
            ok[mine] = motions.ok

        self._rollouts[i].each(driven, take)
        for column, key in enumerate(keys):
            if key in recent:
                left[:, column], ok[column] = recent.of(key)
            elif first[key] != column:
                left[:, column], ok[column] = left[:, first[key]], ok[first[key]]
        recent.remember(keys, left, ok)
        return streams, ok

    def weigh(
        self, residuals: Sequence[Sequence[Floats]], whiteners: Sequence[Whitener] | None = None
    ) -> Floats:
        """Return the unit innovations of all drives, (events, sets), under another belief too."""
        by = self.whiteners if whiteners is None else whiteners
        parts = [w.innovations(r) for w, r in zip(by, residuals, strict=True)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=0)

    def __call__(self, sets: Sequence[Numbers]) -> tuple[Floats, Bools]:
        """Return unit innovations of each set, (events, sets), and which stayed physical."""
        residuals, ok = self.residuals(sets)
        return self.weigh(residuals), ok

    def numbers(self, z: Floats) -> dict[str, float]:
        """Return the car's own numbers at `z` standard deviations from the file's."""
        return {o.key: clipped(o, v) for o, v in zip(self.nominal, z, strict=True)}

    def as_said(self) -> Floats:
        """Return `z` of the car as it is driven where nothing is fitted.

        It is 0 but for what no file says: there a car is driven by its equations' own number, and
        likeliest is another.
        """
        own = [self.car.value(o.key) if o.key in UNKNOWN else o.mean for o in self.nominal]
        return np.array([(x - o.mean) / o.std for x, o in zip(own, self.nominal, strict=True)])


def clipped(parameter: NominalParameter, z: float) -> float:
    """Return a number at `z` standard deviations, within its bounds."""
    low, high = parameter.bounds
    return float(min(max(parameter.mean + z * parameter.std, low), high))
