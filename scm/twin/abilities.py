"""What a car can do by its file: how fast it drives, how soon it stops, how tightly it turns.

Cars drawn from the file's standard deviations and correlations drive straight at the throttle of
ordinary driving, lose it as their guard stops them, and drive circles at full steering.

Their spread is what a fit does not know of the numbers. But no numbers make a simulator the car,
and a fit may have ended in a wrong minimum: so the interval has a part of model discrepancy, too
(Kennedy and O'Hagan, 2001), which is how far the file strays on driving that no fit has seen.
"""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.mismatch.findings import Fit, PartErrors
from scm.mismatch.validate.explain import NINETY
from scm.records.twins import TwinParameter
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet

DRAWN = 200
SEED = 1
CRUISE_THROTTLE = 0.8  # of ordinary driving, as drivers drive
SPED_UP_S, STOPPED_S, CIRCLED_S = 3.0, 3.0, 3.0
STEP_S = 0.02
INTERVAL = (5.0, 50.0, 95.0)  # percentiles
WHEEL, POSITION = "wheel_m", "position_m"  # errors of free runs
APART_M = 50.0


@dataclass(frozen=True, slots=True)
class Abilities:
    """What cars drawn from a file do, each (cars,).

    Attributes:
        speed: Straight on [m/s].
        stopping: Way from there until it stands [m].
        radius: Of the rear axle's circle at full steering, the wider of left and right [m].
    """

    speed: Floats
    stopping: Floats
    radius: Floats


def abilities_of(car: Car, count: int = DRAWN, seed: int = SEED) -> Abilities:
    """Return what cars of a file can do.

    Args:
        car: The file.
        count: Of cars; the first is as the file says, the others are drawn.
        seed: Of what is drawn.
    """
    fleet = _drawn(car, count, np.random.default_rng(seed))
    fleet.throttle[:count] = CRUISE_THROTTLE
    _drive(fleet, SPED_UP_S)
    speed, from_x = fleet.speed[:count].copy(), _places(fleet, count)
    fleet.throttle[:count] = 0.0
    _drive(fleet, STOPPED_S)
    stopping = np.hypot(*(_places(fleet, count) - from_x))
    radii = [_radius(car, count, seed, steering) for steering in (1.0, -1.0)]
    return Abilities(speed, stopping, np.maximum(*radii))


def _radius(car: Car, count: int, seed: int, steering: float) -> Floats:
    fleet = _drawn(car, count, np.random.default_rng(seed))
    fleet.throttle[:count], fleet.steering[:count] = CRUISE_THROTTLE, steering
    _drive(fleet, CIRCLED_S)
    rate: Floats = np.maximum(np.abs(fleet.yaw_rate[:count]), 1e-6)
    return np.abs(fleet.speed[:count]) / rate


def compared_abilities(before: Car, now: Car, fit: Fit | None = None) -> tuple[TwinParameter, ...]:
    """Return what a car can do by a new file, with 90 % intervals, and by the one before.

    Args:
        before: The file before.
        now: The new one.
        fit: How well it follows driving, some of which no fit has seen; None: nobody knows.
    """
    then, new = abilities_of(before), abilities_of(now)
    away_m, lasts_s = (0.0, 1.0) if fit is None else (strayed_m(fit.confirm), fit.horizon_s)
    return (
        _parameter("cruise_mps", "m/s", then.speed, new.speed, away_m / lasts_s),
        _parameter("stopping_m", "m", then.stopping, new.stopping, away_m),
        _parameter("turning_radius_m", "m", then.radius, new.radius),
    )


def strayed_m(part: PartErrors) -> float:
    """Return how far along its way a car strays in free runs, beyond noise; root mean square [m].

    By its wheels, where they are counted: what poses show is mostly their noise.
    """
    name = WHEEL if WHEEL in part.after else POSITION
    square = part.after.get(name, 0.0) ** 2 - part.noise_floor.get(name, 0.0) ** 2
    return math.sqrt(max(square, 0.0))


def _parameter(
    name: str, unit: str, then: Floats, now: Floats, discrepancy: float = 0.0
) -> TwinParameter:
    """Return an ability about what the file says.

    The median of cars drawn lies off it: numbers that cannot be negative, as friction, are cut,
    and those that make good for them are not. `discrepancy` is a standard deviation.
    """
    low, middle, high = np.percentile(now, INTERVAL).tolist()
    value, before, more = float(now[0]), float(then[0]), NINETY * discrepancy
    return TwinParameter(
        name=name, value=value, unit=unit, before=before,
        low=max(value - math.hypot(middle - low, more), 0.0),
        high=value + math.hypot(high - middle, more),
    )  # fmt: skip


def _drive(fleet: Fleet, lasts_s: float) -> None:
    """Drive on with the same commands; delays of commands are true to a step."""
    for _ in range(round(lasts_s / STEP_S)):
        fleet.advance(STEP_S)


def _drawn(car: Car, count: int, rng: np.random.Generator) -> Fleet:
    """Return cars that stand apart: the first as its file says, the others drawn."""
    fleet = Fleet(car, count)
    for row in range(count):
        fleet.add(Pose2(0.0, APART_M * row, 0.0))
    errors = dict[str, Floats]()
    for column in fleet.columns:
        quantity = car.values.get(column.param.key)
        if quantity is not None and quantity.std and isinstance(quantity.value, float):
            errors[column.param.key] = rng.standard_normal(count - 1)
    for group in car.correlated:
        known = [at for at, key in enumerate(group.numbers) if key in errors]
        root = np.linalg.cholesky(np.array(group.matrix)[np.ix_(known, known)])
        mixed = root @ np.array([errors[group.numbers[at]] for at in known])
        errors.update(zip((group.numbers[at] for at in known), mixed, strict=True))
    for at, column in enumerate(fleet.columns):
        key = column.param.key
        if key in errors:
            drawn = car.value(key) + (car.values[key].std or 0.0) * errors[key]
            fleet.parameters[1:count, at] = np.clip(drawn, *column.param.bounds)
    return fleet


def _places(fleet: Fleet, count: int) -> Floats:
    """Return where the rear axles are, (2, cars) [m]."""
    poses = [fleet.pose(row) for row in range(count)]
    return np.array([[one.x for one in poses], [one.y for one in poses]])
