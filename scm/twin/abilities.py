"""What a car can do by its file: how fast it drives, how soon it stops, how tightly it turns.

Cars drawn from the file's standard deviations and correlations drive straight at the throttle of
ordinary driving, lose it as their guard stops them, and drive circles at full steering.
"""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.records.twins import TwinParameter
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet

DRAWN = 200
SEED = 1
CRUISE_THROTTLE = 0.8  # of ordinary driving, as drivers drive
SPED_UP_S, STOPPED_S, CIRCLED_S = 3.0, 3.0, 3.0
STEP_S = 0.02
INTERVAL = (5.0, 50.0, 95.0)  # percentiles
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


def compared_abilities(before: Car, now: Car) -> tuple[TwinParameter, ...]:
    """Return what a car can do by a new file, with 90 % intervals, and by the one before."""
    then, new = abilities_of(before), abilities_of(now)
    return tuple(
        _parameter(name, unit, getattr(then, field), getattr(new, field))
        for name, unit, field in (
            ("cruise_mps", "m/s", "speed"),
            ("stopping_m", "m", "stopping"),
            ("turning_radius_m", "m", "radius"),
        )
    )


def _parameter(name: str, unit: str, then: Floats, now: Floats) -> TwinParameter:
    low, value, high = np.percentile(now, INTERVAL).tolist()
    before = float(np.median(then))
    return TwinParameter(name=name, value=value, low=low, high=high, unit=unit, before=before)


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
