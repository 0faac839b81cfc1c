"""All cars' devices of one kind: who is due, what they read, and what comes out of them when.

    due -> lost? -> measure -> bias, noise, limits (`spoil`) -> under way for the latency -> out

Arrays by slot, the number that a car has in its world. Noise is counted, not drawn (`noise.py`), by
the number of the reading since the car came: a car's readings depend on no other car, and those of
a device that nobody wanted for a while go on as if it had been wanted all along.
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
from scm.vehicles.sensor import Facts, Sensor, Sight, Truth
from scm.vehicles.sensor_noise import spoil, wander

NEVER = np.iinfo(np.int64).max
LOSS = np.uint64(0x10553B6E0D1C4F27)
NOBODY = -1


@dataclass(frozen=True, slots=True)
class Readings:
    """What came out of the devices of one instant, of cars of one file.

    Attributes:
        t_ns: The instant that the values were true at.
        slots: (k,) whose they are, each once, rising.
        values: (k, n) as `Sensor.values` names them.
    """

    car: Car
    t_ns: int
    slots: Ints
    values: Floats


@dataclass(slots=True)
class _Model:
    """The devices in the cars of one truth, all alike."""

    car: Car
    truth: Truth
    facts: Facts
    cars: int = 0
    under_way: deque[tuple[Readings, Ints]] = field(default_factory=deque)


class Bank:
    """The devices of one kind in all cars.

    Args:
        sensor: The kind.
        seed: The run's; with the names of car and sensor it makes their noise.
        capacity: Slots to begin with; more are made when a higher slot is fitted.

    Attributes:
        wanted: By slot, whether anybody wants its readings; write here. A car that nobody wants is
            not measured. Read the attribute anew after `fit`: it may have grown.
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
        self, slot: int, name: str, car: Car, truth: Truth, row: int, now_ns: int,
        offset: float = 0.0,
    ) -> bool:  # fmt: skip
        """Give a car its device, if its file describes one; return whether it did.

        Args:
            slot: The car's number from now on.
            name: The car's; its noise hangs on it.
            car: Describes the device.
            truth: What is measured, read at every step.
            row: The car's in the truth.
            now_ns: Its schedule starts here.
            offset: Share of a period that the first reading waits, so that not all cars read
                at once.
        """
        if not self.sensor.is_fitted(car):
            return False
        if slot >= len(self.wanted):
            self._grow(max(slot + 1, 2 * len(self.wanted)))
        self.unfit(slot)
        model = self._model_of(car, truth)
        period = round(NS_PER_S / self._models[model].facts.rate_hz)
        self._models[model].cars += 1
        self._model[slot], self._row[slot], self._period[slot] = model, row, period
        self._start[slot] = self._next[slot] = now_ns + round(offset * period)
        self._key[slot] = key_of(self._seed, name, self.sensor.name)
        self._life[slot] += 1
        self._second[slot] = NOBODY
        self.wanted[slot] = True
        return True

    def unfit(self, slot: int) -> None:
        """Take a car's device out, and all its readings under way; the slot is free again."""
        if slot >= len(self.wanted) or self._model[slot] == NOBODY:
            return
        self._models[self._model[slot]].cars -= 1
        self._model[slot] = NOBODY
        self._next[slot] = NEVER
        self._life[slot] += 1
        self.wanted[slot] = False

    def is_fitted(self, slot: int) -> bool:
        """Return whether the car of a slot has such a device."""
        return slot < len(self.wanted) and bool(self._model[slot] != NOBODY)

    def step(self, now_ns: int, scene: Callable[[], Scene] | None = None) -> list[Readings]:
        """Read the devices that are due; return what has come out by now, oldest first.

        A device reads once a period; instants that no step came near are not made up for. `scene`
        is asked, at most once, when devices are due that look around.
        """
        due = self._due(now_ns)
        if len(due):
            seen = scene() if scene is not None else None
            models = self._model[due]
            for number, model in enumerate(self._models):
                slots = due if len(self._models) == 1 else due[models == number]
                if len(slots):
                    self._read(model, slots, now_ns, seen)
        out = [r for model in self._models for r in self._come_out(model, now_ns)]
        return [readings for readings in out if len(readings.slots)]

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

    def _read(self, model: _Model, slots: Ints, now_ns: int, scene: Scene | None) -> None:
        facts, numbers = model.facts, self._number[slots]
        if facts.drop_out:
            lost = uniforms(bases_of(self._key[slots] ^ LOSS, numbers), 1)[:, 0] < facts.drop_out
            slots, numbers = slots[~lost], numbers[~lost]
        if len(slots) == 0:
            return
        around = None if scene is None else Sight(scene, slots)
        exact = self.sensor.measure(model.car, model.truth, self._row[slots], around)
        bias = self._bias(facts, slots, now_ns, exact.shape[1])
        values = spoil(facts, exact, bias, bases_of(self._key[slots], numbers))
        model.under_way.append((Readings(model.car, now_ns, slots, values), self._life[slots]))

    def _bias(self, facts: Facts, slots: Ints, now_ns: int, count: int) -> Floats:
        """Return the bias of each value now, (k, n) or (n,) or (1,)."""
        bias = np.array(facts.bias)
        if not any(facts.walk):
            return bias
        if self._wandered.shape != (len(self.wanted), count):
            self._wandered = np.zeros((len(self.wanted), count))
            self._second[:] = NOBODY
        keys = self._key[slots]
        # not all cars' biases step in the same tick
        phase = (keys % np.uint64(NS_PER_S)).astype(np.int64)
        second = (now_ns - self._start[slots] + phase) // NS_PER_S
        stale = second != self._second[slots]
        if stale.any():
            self._wandered[slots[stale]] = wander(keys[stale], second[stale], count)
            self._second[slots[stale]] = second[stale]
        return bias + np.array(facts.walk) * self._wandered[slots]

    def _come_out(self, model: _Model, now_ns: int) -> Iterable[Readings]:
        latency_ns = round(model.facts.latency_s * NS_PER_S)
        while model.under_way and model.under_way[0][0].t_ns + latency_ns <= now_ns:
            readings, lives = model.under_way.popleft()
            same = self._life[readings.slots] == lives
            if same.all():
                yield readings
            else:
                yield Readings(
                    readings.car, readings.t_ns, readings.slots[same], readings.values[same]
                )

    def _model_of(self, car: Car, truth: Truth) -> int:
        for i, model in enumerate(self._models):
            if model.truth is truth and model.car is car:
                return i
        new = _Model(car, truth, self.sensor.facts(car))
        for i, model in enumerate(self._models):
            if model.cars == 0:  # what it still had under way was nobody's
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
    """Compile or load the kernels now, and not at the first reading."""
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
    """Write the slots that read now into `due` and the number of each one's reading; count them."""
    count = 0
    for slot in range(len(wanted)):
        if not wanted[slot] or following[slot] > now_ns:
            continue
        at = following[slot]
        if at <= before_ns:  # nobody wanted it when it was due
            at += ((before_ns - at) // period[slot] + 1) * period[slot]
            following[slot] = at
        if at > now_ns:
            continue
        number[slot] = (now_ns - start[slot]) // period[slot]
        following[slot] = start[slot] + (number[slot] + 1) * period[slot]
        due[count] = slot
        count += 1
    return count
