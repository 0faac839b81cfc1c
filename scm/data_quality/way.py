"""How far the car has gone, as each sensor that knows it says; and turned, as its wheels say."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from scm.data_quality.problem import DataProblem
from scm.data_quality.track import Series, series
from scm.recording.read import Recording
from scm.vehicles.car import Car

SIDES = (("encoder.left", "encoder.right"), ("wheel_speed.rl", "wheel_speed.rr"))


@dataclass(frozen=True, slots=True)
class Way:
    """Distance since the start [m], forward counted positive.

    Attributes:
        name: Of the sensor, such as `encoder.*`.
        channels: It is made of.
        wheels: Whether it is counted on wheels, so that their radius enters.
        scale_std: What the car file, or the last digit, leaves open about its scale.
        turned: Yaw as the wheels' difference says [rad]; None where there is none.
    """

    name: str
    channels: tuple[str, ...]
    wheels: bool
    scale_std: float
    distance: Series
    turned: Series | None = None


def ways(recording: Recording, car: Car | None) -> list[Way]:
    """Return every sensor of distance; wheels need the car's radius."""
    found = [_counted(recording, car), _rolled(recording, car)]
    for name in ("speed", "velocity.x"):
        speed = series(recording, name)
        if speed is not None:
            found.append(Way(name, (name,), False, _rounded(speed), speed.integral()))
    return [way for way in found if way is not None and np.ptp(way.distance.values) > 0.0]


def uncounted(recording: Recording, car: Car) -> Iterator[DataProblem]:
    """Yield that encoders are of no use where the car file does not say what they count."""
    names = [name for name in SIDES[0] if name in recording.channels]
    if names and not car.has("encoder.counts_per_revolution"):
        yield DataProblem(
            channel="encoder.*",
            name="unknown_counts",
            text=f"The car file {car.name!r} does not say how many counts a turn makes: encoders "
            "are not used.",
            record_instead="Nothing: state encoder.counts_per_revolution in the car file.",
        )


def _rounded(speed: Series) -> float:
    """Return by how much a speed is off where its last digit is cut instead of rounded."""
    steps = np.diff(np.unique(speed.values))
    moving = float(np.percentile(np.abs(speed.values), 75))
    return 0.5 * float(np.percentile(steps, 10)) / moving if len(steps) and moving > 0.0 else 0.0


def _counted(recording: Recording, car: Car | None) -> Way | None:
    left, right = (series(recording, name) for name in SIDES[0])
    if car is None or left is None or right is None or not car.has("encoder.counts_per_revolution"):
        return None
    metre = math.tau * car.value("wheel.radius_m") / car.value("encoder.counts_per_revolution")
    return _pair("encoder.*", SIDES[0], left, right, metre, car)


def _rolled(recording: Recording, car: Car | None) -> Way | None:
    left, right = (series(recording, name) for name in SIDES[1])
    if car is None or left is None or right is None:
        return None
    radius = car.value("wheel.radius_m")
    return _pair("wheel_speed.*", SIDES[1], left.integral(), right.integral(), radius, car)


def _pair(
    name: str, channels: tuple[str, str], left: Series, right: Series, metre: float, car: Car
) -> Way:
    l_m, r_m = left.values * metre, right.at(left.t) * metre
    turned = Series(left.t, (r_m - l_m) / car.value("body.track_m"))
    std = (car.quantity("wheel.radius_m").std or 0.0) / car.value("wheel.radius_m")
    return Way(name, channels, True, std, Series(left.t, 0.5 * (l_m + r_m)), turned)
