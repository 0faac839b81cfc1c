"""The contract of a sensor: what it measures exactly, how often, and how its readings are spoilt.

A sensor module says two things: how to `measure` the exact values of many cars at once, and the
facts of its device, read from the car file. A `Bank` then makes readings of them: at the device's
rate, with noise of its own, late, and sometimes lost. Without noise, bias, latency and drop-out the
readings are the truth. To add one, copy `sensors/encoders.py`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.rays.scene import Scene


class Truth(Protocol):
    """What sensors may see of the cars of one file; `Fleet` has it. Arrays over the fleet's rows.

    `x y yaw` is the rear axle's pose; accelerations are those of the centre of gravity without
    gravity, in the level frame that turns with yaw. `impact_x`, `impact_y` and `impact_yaw` are
    what contacts added to them, as a mean over the last tick. Angles and rates are right-handed.
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
    def impact_x(self) -> Floats: ...  # noqa: D102
    @property
    def impact_y(self) -> Floats: ...  # noqa: D102
    @property
    def impact_yaw(self) -> Floats: ...  # noqa: D102
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
class Sight:
    """What stands around the measured cars; `own` (k,) are their slots: none sees itself."""

    scene: Scene
    own: Ints


@dataclass(frozen=True, slots=True)
class Facts:
    """What a device is like. A tuple holds a number for each value, or one for all.

    A reading is the exact value, plus bias, plus noise; then it is held within its limits, then
    rounded, then angles are wrapped.

    Attributes:
        noise: Standard deviation of each reading, independent of all others.
        latency_s: From the instant of the reading to when it can be had.
        drop_out: Share of the readings that never come.
        quantum: Readings are whole multiples of it, rounded towards minus infinity; 0: any value.
        bias: Added to every reading.
        walk: How far the bias wanders: its standard deviation after one second, growing with the
            root of the time. It steps once a second.
        saturates_at: Readings are held within plus and minus this.
        seen: Lowest and highest value that the device can tell; what lies beyond is a miss, inf.
        angles: Which values are angles, kept in (-pi, pi].
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
        facts: The device as a car file describes it.
        measure: (car, truth, rows, around) to exact values, (k, number of values). One that
            looks `around` gets what stands there, or None where nothing does.
    """

    name: str
    values: tuple[str, ...]
    needs: tuple[str, ...]
    facts: Callable[[Car], Facts]
    measure: Callable[[Car, Truth, Ints, Sight | None], Floats]

    def is_fitted(self, car: Car) -> bool:
        """Return whether a car has such a device: its file describes it."""
        return all(car.has(key) for key in self.needs)
