"""How fast a car can go and turn at all, from its file: what its sensors cannot truly exceed."""

import math
from dataclasses import dataclass

from scm.data_quality.other_car import steady_speed
from scm.recording.units import G
from scm.vehicles.car import Car

GENEROUS = 3.0  # times what the file says: a car is pushed, rolls downhill, spins, or is tuned
FULL_SPEED = "drive.full_speed_m_s"
WIDEST_LOCK_RAD = 0.7  # of a car whose file does not say how far its wheels turn
GRIP = 1.0  # of a tyre whose file does not say what force it passes on, over its load


@dataclass(frozen=True, slots=True)
class Limits:
    """What a car's motion stays below, `GENEROUS` times what its file says.

    Attributes:
        speed: [m/s]; `acceleration`: in any direction [m/s^2]; `turning`: of its heading [rad/s].
        wheels: Angular speed of its wheels [rad/s].
        counts: Of its encoders a second; `turn`: a turn; None where the file does not say it.
        length: Its wheelbase [m].
    """

    speed: float
    acceleration: float
    turning: float
    wheels: float
    counts: float | None
    turn: float | None
    length: float


def limits_of(car: Car) -> Limits:
    """Return what a car's motion stays below."""
    steady = steady_speed(car)
    top = car.value(FULL_SPEED) if steady is None else steady.top
    lock = _value(car, "steering.limit_rad", WIDEST_LOCK_RAD)
    grip = G * max(
        _value(car, key, GRIP) for key in ("tyre.force_extremum", "tyre.lateral_force_extremum")
    )
    length = car.value("body.wheelbase_m")
    curvature = math.tan(min(lock, 1.5)) / length
    turning = min(top * curvature, math.sqrt(grip * curvature))  # its tyres slip beyond
    wheels = top / car.value("wheel.radius_m")
    key = "encoder.counts_per_revolution"
    turn = car.value(key) if car.has(key) else None
    return Limits(
        speed=GENEROUS * top,
        acceleration=GENEROUS * grip,
        turning=GENEROUS * turning,
        wheels=GENEROUS * wheels,
        counts=None if turn is None else GENEROUS * wheels * turn / math.tau,
        turn=turn,
        length=length,
    )


def _value(car: Car, key: str, default: float) -> float:
    return car.value(key) if car.has(key) else default
