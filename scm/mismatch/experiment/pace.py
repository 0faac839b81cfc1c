"""What a car may do on a floor: how fast it went when recorded, and how far there is to go."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scm.geometry import Pose2
from scm.replay.drive import Drive
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet

LEVELS = np.linspace(0.05, 1.0, 20)
SETTLING_S = 6.0
STEP_S = 0.01
WALL_M = 0.1
SIDEWAYS_M_S2 = 3.0  # what ordinary tyres hold on an ordinary floor


@dataclass(frozen=True, slots=True)
class Floor:
    """The rectangle that is free to drive on [m]."""

    x_m: tuple[float, float]
    y_m: tuple[float, float]

    @property
    def size(self) -> tuple[float, float]:
        """Its width along x and along y [m]."""
        return self.x_m[1] - self.x_m[0], self.y_m[1] - self.y_m[0]


@dataclass(frozen=True, slots=True)
class Pace:
    """How manoeuvres are scaled.

    Attributes:
        throttle: The highest that is used.
        speeds: Steady speed of the nominal car at `LEVELS` of throttle [m/s].
        rise_s: Until it is two thirds as fast as it gets.
        run_m: Length of the longest straight run that fits, the car's own length taken off.
        turn_m: Radius of the largest circle that fits.
        tightest_m: Radius at full lock.
        margin_m: What the car needs around its rear axle.
    """

    floor: Floor
    throttle: float
    speeds: tuple[float, ...]
    rise_s: float
    run_m: float
    turn_m: float
    wheelbase_m: float
    limit_rad: float
    margin_m: float

    @property
    def tightest_m(self) -> float:
        """Radius at full lock [m]."""
        return self.wheelbase_m / math.tan(self.limit_rad)

    def speed(self, throttle: float) -> float:
        """Return the steady speed on the level [m/s]."""
        return float(np.interp(throttle, (0.0, *LEVELS), (0.0, *self.speeds)))

    def lasts(self, throttle: float, longest_s: float = 12.0) -> float:
        """Return how long a straight run from standstill may take, in half seconds."""
        reach = self.run_m / max(self.speed(throttle), 1e-3) + 0.7 * self.rise_s
        return max(math.floor(2.0 * min(reach, longest_s)) / 2.0, 0.5)

    def steering(self, radius_m: float) -> float:
        """Return the command for a circle, at most 0.95."""
        return min(math.atan(self.wheelbase_m / radius_m) / self.limit_rad, 0.95)

    def radius(self, steering: float) -> float:
        """Return the radius that a steering command only_for for [m]."""
        return self.wheelbase_m / math.tan(abs(steering) * self.limit_rad)


def pace_of(car: Car, drives: Sequence[Drive], floor: Floor | None = None) -> Pace:
    """Return what a car may do, from what it did; without a floor, where it was recorded."""
    floor = floor or _driven_on(drives)
    commands = np.concatenate([np.abs(d.throttle.values) for d in drives])
    top = min(round(float(np.percentile(commands, 98)), 2), 1.0)
    top = max(top, 0.1)
    speeds, rise = _answers(car)
    base = car.value("body.wheelbase_m")
    known = car.has("body.footprint_x_m")
    ends = car.vector("body.footprint_x_m") if known else (-0.5 * base, 1.5 * base)
    margin = max(abs(end) for end in ends) + WALL_M
    wide, narrow = max(floor.size), min(floor.size)
    limit = car.value("steering.limit_rad") if car.has("steering.limit_rad") else 0.5
    return Pace(
        floor, top, speeds, rise, max(wide - 2.0 * margin, 0.2),
        max(0.5 * narrow - margin, 0.1), base, limit, margin,
    )  # fmt: skip


def _driven_on(drives: Sequence[Drive]) -> Floor:
    spans = [
        (
            min(float(d.stream(name).values.min()) for d in drives),
            max(float(d.stream(name).values.max()) for d in drives),
        )
        for name in ("pose.x", "pose.y")
    ]
    return Floor(*((low - 0.3, high + 0.3) for low, high in spans))


def _answers(car: Car) -> tuple[tuple[float, ...], float]:
    """Return the speeds that throttles give after a while, and how fast they are reached [s]."""
    fleet, n = Fleet(car, len(LEVELS)), len(LEVELS)
    for _ in range(n):
        fleet.add(Pose2(0.0, 0.0, 0.0))
    steps = round(SETTLING_S / STEP_S)
    throttle = np.tile(LEVELS, (steps, 1))
    speed = fleet.rollout(throttle, np.zeros_like(throttle), STEP_S, ("speed",))["speed"]
    middle = speed[:, n // 2]
    rise = STEP_S * float(np.argmax(middle >= 0.63 * middle[-1]))
    return tuple(float(v) for v in np.maximum.accumulate(speed[-1])), rise
