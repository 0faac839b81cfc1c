"""The contract of a sensor: exact values, rate and errors, and its part of `VehicleSensors`.

A sensor module defines its keys of the car file (`KEYS`), how to `measure` the exact values of many
cars at once, the properties of its device, and the message fields that it fills. A `Bank` turns the
exact values into readings at the device's rate, with noise, latency and drop-outs; without these
the readings are exact. To add one, copy `sensors/encoders.py` and add its fields to
`VehicleSensors`.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

import numpy as np

from scm import registry
from scm.arrays import Floats, Ints
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import Car
from scm.vehicles.car_file_schema import SENSORS
from scm.vehicles.rays.scene import Scene

ENCODERS = "encoders"
"""Its readings trigger `VehicleSensors`."""
REQUIRED = ("encoder_left", "accel_mps2")
"""Fields without which there is no message."""


class Truth(Protocol):
    """The true state that sensors measure, as `Fleet` has it. Arrays over the fleet's rows.

    `x y yaw` is the rear axle's pose; accelerations are those of the centre of gravity without
    gravity, in the level frame that turns with yaw. `contact_accel_x`, `contact_accel_y` and
    `contact_yaw_accel` are added by contacts, averaged over the last tick. Angles and rates are
    right-handed.
    """

    @property
    def x(self) -> Floats: ...  # noqa: D102
    @property
    def y(self) -> Floats: ...  # noqa: D102
    @property
    def yaw(self) -> Floats: ...  # noqa: D102
    @property
    def roll(self) -> Floats: ...  # noqa: D102
    @property
    def pitch(self) -> Floats: ...  # noqa: D102
    @property
    def roll_rate(self) -> Floats: ...  # noqa: D102
    @property
    def pitch_rate(self) -> Floats: ...  # noqa: D102
    @property
    def yaw_rate(self) -> Floats: ...  # noqa: D102
    @property
    def roll_accel(self) -> Floats: ...  # noqa: D102
    @property
    def pitch_accel(self) -> Floats: ...  # noqa: D102
    @property
    def yaw_accel(self) -> Floats: ...  # noqa: D102
    @property
    def accel_x(self) -> Floats: ...  # noqa: D102
    @property
    def accel_y(self) -> Floats: ...  # noqa: D102
    @property
    def accel_z(self) -> Floats: ...  # noqa: D102
    @property
    def contact_accel_x(self) -> Floats: ...  # noqa: D102
    @property
    def contact_accel_y(self) -> Floats: ...  # noqa: D102
    @property
    def contact_yaw_accel(self) -> Floats: ...  # noqa: D102
    @property
    def speed(self) -> Floats: ...  # noqa: D102
    @property
    def lateral_speed(self) -> Floats: ...  # noqa: D102
    @property
    def throttle(self) -> Floats: ...  # noqa: D102
    @property
    def steer_angle(self) -> Floats: ...  # noqa: D102
    @property
    def wheel_angle(self) -> Floats: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What surrounds the measured cars; `own` (k,) are their indices: none sees itself."""

    scene: Scene
    own: Ints


@dataclass(frozen=True, slots=True)
class Device:
    """The properties of a device. A tuple holds one number per value, or one for all.

    A reading is the exact value plus bias plus noise, then clipped to the limits, then rounded,
    then angles are wrapped.

    Attributes:
        noise: Standard deviation of each reading, independent of all others.
        latency_s: From the instant of the reading to its output.
        drop_out: Share of the readings that are lost.
        quantum: Resolution; readings are rounded down to its multiples; 0: none.
        bias: Added to every reading.
        walk: Bias instability: standard deviation of the bias after one second, growing with the
            root of the time. It steps once a second.
        saturates_at: Readings are clipped to plus and minus this.
        seen: Lowest and highest measurable value; readings beyond are a miss, inf.
        angles: Indices of values that are angles, wrapped to (-pi, pi].
    """

    rate_hz: float
    noise: tuple[float, ...] = (0.0,)
    latency_s: float = 0.0
    drop_out: float = 0.0
    quantum: float = 0.0
    bias: tuple[float, ...] = (0.0,)
    walk: tuple[float, ...] = (0.0,)
    saturates_at: tuple[float, ...] = (math.inf,)
    seen: tuple[float, float] | None = None
    angles: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Sensor:
    """One kind of sensor.

    Attributes:
        values: Names of the values in order, with units; one name when all are of a kind.
        needs: Keys of the car file that describe the device.
        device: The device's properties from a car file.
        measure: (car, truth, rows, surroundings) to exact values, (k, number of values).
        fields: Readings (k, n) to columns of `VehicleSensors` fields; None: it has a message of its
            own.
    """

    name: str
    values: tuple[str, ...]
    needs: tuple[str, ...]
    device: Callable[[Car], Device]
    measure: Callable[[Car, Truth, Ints, Surroundings | None], Floats]
    fields: Callable[[Floats], Mapping[str, list[Any]]] | None = None

    def is_fitted(self, car: Car) -> bool:
        """Return whether a car has such a device: its file describes it."""
        return all(car.has(key) for key in self.needs)


@cache
def all_sensors() -> Mapping[str, Sensor]:
    """Return every kind of sensor, by name."""
    names = registry.names(SENSORS)
    return {name: registry.load(SENSORS, name, "SENSOR", Sensor) for name in names}


def sensor_messages(
    vehicles: Sequence[str], t_ns: int, readings: Mapping[str, Floats]
) -> Iterator[VehicleSensors]:
    """Yield a message for each car that has readings of encoders and IMU.

    Args:
        vehicles: Names of the cars (k,).
        t_ns: The instant of the encoders' reading.
        readings: By kind of sensor, the newest values (k, n); NaN rows have no reading yet.
    """
    columns: dict[str, list[Any]] = {}
    for kind, values in readings.items():
        fields = all_sensors()[kind].fields
        if fields is None:
            continue
        is_known = ~np.isnan(values[:, 0])
        for name, known in fields(values[is_known]).items():
            cells = iter(known)
            columns[name] = [next(cells) if ok else None for ok in is_known.tolist()]
    for vehicle, row in zip(vehicles, zip(*columns.values(), strict=True), strict=True):
        given = dict(zip(columns, row, strict=True))
        if all(given.get(name) is not None for name in REQUIRED):
            yield VehicleSensors(vehicle=vehicle, t_ns=t_ns, **given)
