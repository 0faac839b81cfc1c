"""Variables on which a number of a car may depend, as a recording shows them.

A search drives a recording again with numbers that follow these curves; the car file that it
writes computes the same from the simulated car.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.replay.drive import CREEPING_MPS, STEP_S, Drive
from scm.vehicles.jit import array_kernel

WARM_S, HOT_S = 10.0, 40.0  # of the throttle, over which parts warm up and cool down
USUAL = 95  # percentile of a curve that counts as its usual most
LEAST_SPREAD = 0.15  # of the usual most: a curve that hardly varies is a constant
ENDS = (0.5, 99.5)  # percentiles of a curve that count as the ends of its range


@dataclass(frozen=True, slots=True)
class RecordedVariable:
    """A variable of a car as a function of a recording.

    Attributes:
        name: As it is reported.
        curve: Returns it at the edges of a drive's steps, (steps + 1,); never negative, except a
            place.
        least: Usual most below which a recording's noise hides it.
    """

    name: str
    unit: str
    curve: Callable[[Drive], Floats]
    least: float = 0.0


def usual_most(variable: RecordedVariable, drives: Sequence[Drive]) -> float:
    """Return the usual most of a variable; 0 where it hardly varies or noise hides it."""
    values = np.concatenate([variable.curve(drive) for drive in drives])
    most = float(np.percentile(values, USUAL))
    varies = most > variable.least and float(values.std()) > LEAST_SPREAD * most
    return most if varies else 0.0


def range_of(variable: RecordedVariable, drives: Sequence[Drive]) -> tuple[float, float] | None:
    """Return the range of a variable while the car moves; None where it never does."""
    values = np.concatenate([variable.curve(drive)[moving(drive)] for drive in drives])
    if not len(values):
        return None
    low, high = np.percentile(values, ENDS)
    return float(low), float(high)


def moving(drive: Drive) -> Bools:
    """Return whether the car moves and is seen at the edges of a drive's steps, (steps + 1,)."""
    return (_speed(drive) > CREEPING_MPS) & ~drive.is_blind(drive.edges)


def _commanded(drive: Drive, name: str) -> Floats:
    command = drive.throttle if name == "throttle" else drive.steering
    values = command.means(drive.edges, np.zeros(1))[:, 0]
    return np.append(values, values[-1:])


def _throttle(drive: Drive) -> Floats:
    return np.abs(_commanded(drive, "throttle"))


def _speed(drive: Drive) -> Floats:
    x, y = (drive.smoothed[f"pose.{axis}"].rate_at(drive.edges) for axis in ("x", "y"))
    return np.hypot(x, y)


def _yaw_rate(drive: Drive) -> Floats:
    return np.abs(drive.smoothed["pose.yaw"].rate_at(drive.edges))


def _load(drive: Drive) -> Floats:
    return _speed(drive) * _yaw_rate(drive)


def _lateral(drive: Drive) -> Floats:
    """Return the acceleration across at the centre of gravity, where turning faster counts too."""
    turns = drive.smoothed["pose.yaw"].rate_at(drive.edges)
    ahead = drive.car.value("body.cog_to_rear_axle_m")
    return np.abs(_speed(drive) * turns + ahead * np.gradient(turns, STEP_S))


def _place(axis: int) -> Callable[[Drive], Floats]:
    """Return the curve of a coordinate of the centre of gravity."""

    def curve(drive: Drive) -> Floats:
        x, y, yaw = (drive.smoothed[f"pose.{name}"].at(drive.edges) for name in ("x", "y", "yaw"))
        ahead, left = drive.car.value("body.cog_to_rear_axle_m") - drive.point[0], -drive.point[1]
        c, s = np.cos(yaw), np.sin(yaw)
        return y + s * ahead + c * left if axis else x + c * ahead - s * left

    return curve


def _angle(drive: Drive) -> Floats:
    limit = drive.car.value("steering.limit_rad") if drive.car.has("steering.limit_rad") else 1.0
    return limit * np.abs(_commanded(drive, "steering"))


def _left(drive: Drive) -> Floats:
    return np.asarray(_commanded(drive, "steering") > 0.0, dtype=np.float64)


def _right(drive: Drive) -> Floats:
    return np.asarray(_commanded(drive, "steering") < 0.0, dtype=np.float64)


def _used(memory_s: float) -> Callable[[Drive], Floats]:
    return lambda drive: _remembered(_throttle(drive), STEP_S / (memory_s + STEP_S))


@array_kernel
def _remembered(values: Floats, share: float) -> Floats:
    out, now = np.empty_like(values), 0.0
    for i in range(len(values)):
        now += share * (values[i] - now)
        out[i] = now
    return out


VARIABLES = (
    RecordedVariable("throttle", "1", _throttle),
    RecordedVariable("speed", "m/s", _speed),
    RecordedVariable("load", "m/s^2", _load, least=0.5),
    RecordedVariable("steering angle", "rad", _angle),
    RecordedVariable("left turns", "1", _left),
    RecordedVariable("right turns", "1", _right),
    RecordedVariable("use", "1", _used(WARM_S)),
    RecordedVariable("long use", "1", _used(HOT_S)),
)
PLACES = {variable.name: place for place, variable in enumerate(VARIABLES)}
YAW_RATE = RecordedVariable("yaw rate", "rad/s", _yaw_rate)
LATERAL = RecordedVariable("lateral acceleration", "m/s^2", _lateral)
PLACE = tuple(RecordedVariable(name, "m", _place(axis)) for axis, name in enumerate("xy"))


def mean_throttle(memory_s: float) -> RecordedVariable:
    """Return the mean size of the throttle over so long, which fades."""
    return RecordedVariable("mean throttle", "1", _used(memory_s))
