"""The limits of a car that its driver needs, read from the car file."""

import math

from scm.vehicles.car import Car
from scm.vehicles.driver import CarLimits


def limits_of(car: Car) -> CarLimits:
    """Return the limits of a car.

    If the servo is a lag and not a rate, or the map from command to angle is curved, the numbers
    are those of the linear servo that is closest around the centre.
    """
    rear, front = car.vector("body.footprint_x_m")
    right, left = car.vector("body.footprint_y_m")
    limit = _steer_limit(car)
    known = car.has("drive.throttle_speed_m_s")
    return CarLimits(
        wheelbase=car.value("body.wheelbase_m"),
        steer_limit=limit,
        steer_rate=_steer_rate(car, limit),
        front=front,
        rear=-rear,
        width=left - right,
        speeds=car.vector("drive.throttle_speed_m_s") if known else (),
    )


def _steer_limit(car: Car) -> float:
    if any(term.name == "steer_map_tanh" for term in car.terms):
        slopes = [
            car.value(f"steering.map_{side}_rad") * car.value(f"steering.map_{side}_slope")
            for side in ("left", "right")
        ]
        return sum(slopes) / len(slopes)
    return car.value("steering.limit_rad")


def _steer_rate(car: Car, limit: float) -> float:
    if any(term.name == "steer_lag" for term in car.terms):
        return 0.5 * limit / max(0.01, car.value("steering.lag_s"))
    return car.value("steering.rate_rad_s")


def turning_radius_m(car: Car) -> float:
    """Return the radius of the tightest circle of the rear axle's centre [m]."""
    lock = _steer_limit(car)
    if any(term.name == "steer_map_tanh" for term in car.terms):
        lock = min(
            car.value(f"steering.map_{side}_rad")
            * math.tanh(car.value(f"steering.map_{side}_slope"))
            for side in ("left", "right")
        )
    return car.value("body.wheelbase_m") / math.tan(lock)
