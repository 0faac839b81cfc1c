"""All cars' devices of one kind: which are due, what they read, and when readings come out.

    due -> lost? -> measure -> bias, noise, limits -> pending for the latency -> out

Arrays by vehicle index. Noise is counter-based (`noise.py`), by the number of the reading since the
car was fitted: a car's readings depend on no other car, and a device that was not wanted for a
while continues as if it had been.
"""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.vehicles.car import Car
from scm.vehicles.jit import array_kernel
from scm.vehicles.noise import Keys, bases_of, key_of, normals, uniforms
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import Device, Sensor, Surroundings, Truth
from scm.vehicles.sensor_noise import add_device_errors, wander

NEVER = np.iinfo(np.int64).max
LOSS = np.uint64(0x10553B6E0D1C4F27)
NOBODY = -1


@dataclass(frozen=True, slots=True)
class Readings:
    """The readings of one instant, of cars of one file.

    Attributes:
        t_ns: Time of measurement.
        indices: (k,) vehicle indices, ascending.
        values: (k, n) in the order of `Sensor.values`.
    """

    car: Car
    t_ns: int
    indices: Ints
    values: Floats


@dataclass(slots=True)
class _Model:
    """The identical devices in the cars of one file."""

    car: Car
    truth: Truth
    device: Device
    cars: int = 0
    under_way: deque[tuple[Readings, Ints]] = field(default_factory=deque)

    def add(self, new: Readings, lives: Ints) -> None:
        """Add readings to those of the same instant, or in order of time."""
        at = len(self.under_way)
        while at and self.under_way[at - 1][0].t_ns > new.t_ns:
            at -= 1
        if not at or self.under_way[at - 1][0].t_ns < new.t_ns:
            self.under_way.insert(at, (new, lives))
            return
        old, old_lives = self.under_way[at - 1]
        indices = np.concatenate((old.indices, new.indices))
        order = np.argsort(indices, kind="stable")
        values = np.vstack((old.values, new.values))[order]
        merged = Readings(self.car, new.t_ns, indices[order], values)
        self.under_way[at - 1] = merged, np.concatenate((old_lives, lives))[order]


class Bank:
    """The devices of one kind in all cars.

    Args:
        sensor: The kind.
        seed: Of the run; with the names of car and sensor it determines the noise.
        capacity: Initial number of vehicle indices; it grows when a higher one is fitted.

    Attributes:
        wanted: By vehicle index, whether its readings are wanted; write here. Other cars are not
            measured. Read the attribute again after `fit`: it may have grown.
    """

    def __init__(self, sensor: Sensor, seed: int, capacity: int = 64) -> None:
        self.sensor = sensor
        self._seed = seed
        self._models: list[_Model] = []
        self._before_ns = -NEVER
        self.wanted: Bools = np.zeros(0, np.bool_)
        self._model = self._row = self._start = self._next = self._period = np.zeros(0, np.int64)
        self._life = self._number = self._second = np.zeros(0, np.int64)
        self._key: Keys = np.zeros(0, np.uint64)
        self._wandered: Floats = np.zeros((0, 0))
        self._grow(capacity)
        _warm()

    def fit(
        self, index: int, name: str, car: Car, truth: Truth, row: int, now_ns: int,
        offset: float = 0.0,
    ) -> bool:  # fmt: skip
        """Fit a car's device if its file describes one; return whether it does.

        Args:
            index: The vehicle index.
            name: Of the car; it determines the noise.
            car: Describes the device.
            truth: What is measured, read at every step.
            row: The car's row in the truth.
            now_ns: Start of its schedule.
            offset: Delay of the first reading as a share of a period, to spread the cars.
        """
        if not self.sensor.is_fitted(car):
            return False
        if index >= len(self.wanted):
            self._grow(max(index + 1, 2 * len(self.wanted)))
        self.unfit(index)
        model = self._model_of(car, truth)
        period = round(NS_PER_S / self._models[model].device.rate_hz)
        self._models[model].cars += 1
        self._model[index], self._row[index], self._period[index] = model, row, period
        self._start[index] = self._next[index] = now_ns + round(offset * period)
        self._key[index] = key_of(self._seed, name, self.sensor.name)
        self._life[index] += 1
        self._second[index] = NOBODY
        self.wanted[index] = True
        return True

    def unfit(self, index: int) -> None:
        """Remove a car's device with its pending readings; the index is free again."""
        if index >= len(self.wanted) or self._model[index] == NOBODY:
            return
        self._models[self._model[index]].cars -= 1
        self._model[index] = NOBODY
        self._next[index] = NEVER
        self._life[index] += 1
        self.wanted[index] = False

    def pending(self, index: int) -> tuple[tuple[int, bytes], ...]:
        """Return a car's readings that have not come out yet: time of measurement and values."""
        if not self.is_fitted(index):
            return ()
        found = list[tuple[int, bytes]]()
        for readings, lives in self._models[self._model[index]].under_way:
            own = (readings.indices == index) & (lives == self._life[index])
            found += [(readings.t_ns, values.tobytes()) for values in readings.values[own]]
        return tuple(found)

    def hand_out(self, index: int) -> None:
        """Forget a car's `pending` readings: its device goes on in another process."""
        if index < len(self._life):
            self._life[index] += 1

    def accept(self, index: int, row: int, pending: Iterable[tuple[int, bytes]]) -> None:
        """Go on with the device of a car that is in a row of its truth from now on."""
        if not self.is_fitted(index):
            return
        self._row[index] = row
        self._life[index] += 1
        self._second[index] = NOBODY
        model = self._models[self._model[index]]
        for t_ns, values in pending:
            one = Readings(model.car, t_ns, np.array([index]), np.frombuffer(values).reshape(1, -1))
            model.add(one, self._life[[index]])

    def is_fitted(self, index: int) -> bool:
        """Return whether the car at an index has such a device."""
        return index < len(self.wanted) and bool(self._model[index] != NOBODY)

    def step(self, now_ns: int, scene: Callable[[], Scene] | None = None) -> list[Readings]:
        """Read the devices that are due; return the readings that have come out, oldest first.

        A device reads once a period; missed instants are not made up for. `scene` is called at most
        once, when devices are due that need it.
        """
        due = self._due(now_ns)
        if len(due):
            seen = scene() if scene is not None else None
            models = self._model[due]
            for number, model in enumerate(self._models):
                indices = due if len(self._models) == 1 else due[models == number]
                if len(indices):
                    self._read(model, indices, now_ns, seen)
        out = [r for model in self._models for r in self._come_out(model, now_ns)]
        return [readings for readings in out if len(readings.indices)]

    def _due(self, now_ns: int) -> Ints:
        due = np.empty(len(self.wanted), np.int64)
        count = 0
        if self.wanted.any():
            count = _find_due(
                now_ns, self._before_ns, self.wanted, self._start, self._next, self._period,
                self._number, due,
            )  # fmt: skip
        self._before_ns = now_ns
        return due[:count]

    def _read(self, model: _Model, indices: Ints, now_ns: int, scene: Scene | None) -> None:
        device, numbers = model.device, self._number[indices]
        if device.drop_out:
            lost = uniforms(bases_of(self._key[indices] ^ LOSS, numbers), 1)[:, 0] < device.drop_out
            indices, numbers = indices[~lost], numbers[~lost]
        if len(indices) == 0:
            return
        around = None if scene is None else Surroundings(scene, indices)
        exact = self.sensor.measure(model.car, model.truth, self._row[indices], around)
        bias = self._bias(device, indices, now_ns, exact.shape[1])
        values = add_device_errors(device, exact, bias, bases_of(self._key[indices], numbers))
        model.under_way.append((Readings(model.car, now_ns, indices, values), self._life[indices]))

    def _bias(self, device: Device, indices: Ints, now_ns: int, count: int) -> Floats:
        """Return the bias of each value now, (k, n) or (n,) or (1,)."""
        bias = np.array(device.bias)
        if not any(device.walk):
            return bias
        if self._wandered.shape != (len(self.wanted), count):
            self._wandered = np.zeros((len(self.wanted), count))
            self._second[:] = NOBODY
        keys = self._key[indices]
        # spread the steps of the biases over all ticks
        phase = (keys % np.uint64(NS_PER_S)).astype(np.int64)
        second = (now_ns - self._start[indices] + phase) // NS_PER_S
        stale = second != self._second[indices]
        if stale.any():
            self._wandered[indices[stale]] = wander(keys[stale], second[stale], count)
            self._second[indices[stale]] = second[stale]
        return bias + np.array(device.walk) * self._wandered[indices]

    def _come_out(self, model: _Model, now_ns: int) -> Iterable[Readings]:
        latency_ns = round(model.device.latency_s * NS_PER_S)
        while model.under_way and model.under_way[0][0].t_ns + latency_ns <= now_ns:
            readings, lives = model.under_way.popleft()
            same = self._life[readings.indices] == lives
            if same.all():
                yield readings
            else:
                yield Readings(
                    readings.car, readings.t_ns, readings.indices[same], readings.values[same]
                )

    def _model_of(self, car: Car, truth: Truth) -> int:
        for i, model in enumerate(self._models):
            if model.truth is truth and model.car is car:
                return i
        new = _Model(car, truth, self.sensor.device(car))
        for i, model in enumerate(self._models):
            if model.cars == 0:  # its pending readings belong to removed cars
                self._models[i] = new
                return i
        self._models.append(new)
        return len(self._models) - 1

    def _grow(self, capacity: int) -> None:
        def longer(array: Any, filler: Any) -> Any:
            return np.concatenate((array, np.full(capacity - len(array), filler, array.dtype)))

        self.wanted = longer(self.wanted, filler=False)
        self._model, self._row = longer(self._model, NOBODY), longer(self._row, 0)
        self._start, self._next = longer(self._start, 0), longer(self._next, NEVER)
        self._period, self._number = longer(self._period, 1), longer(self._number, 0)
        self._life, self._second = longer(self._life, 0), longer(self._second, NOBODY)
        self._key = longer(self._key, 0)


@cache
def _warm() -> None:
    """Compile or load the kernels before the first reading."""
    nobody: Ints = np.zeros(0, np.int64)
    normals(bases_of(nobody.astype(np.uint64), nobody), 1)
    _find_due(0, 0, np.zeros(0, np.bool_), nobody, nobody, nobody, nobody, nobody)


@array_kernel
def _find_due(
    now_ns: int,
    before_ns: int,
    wanted: Bools,
    start: Ints,
    following: Ints,
    period: Ints,
    number: Ints,
    due: Ints,
) -> int:
    """Write the indices that read now into `due` and their reading numbers; return the count."""
    count = 0
    for index in range(len(wanted)):
        if not wanted[index] or following[index] > now_ns:
            continue
        at = following[index]
        if at <= before_ns:  # it was not wanted when it was due
            at += ((before_ns - at) // period[index] + 1) * period[index]
            following[index] = at
        if at > now_ns:
            continue
        number[index] = (now_ns - start[index]) // period[index]
        following[index] = start[index] + (number[index] + 1) * period[index]
        due[count] = index
        count += 1
    return count
