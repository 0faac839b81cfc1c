"""How fast: the speed the way allows, the speed that still stops in time, and the throttle for it.

v(d) = sqrt((a/k)^2 + 2 a d) - a/k        stops at d = 0, deceleration below a, the end of it
exponential with k: no jerk at the stop
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.memory import (
    ACCEL,
    BRAKE,
    PACE,
    SPEEDS,
    STEPS,
    SUM,
)
from scm.vehicles.drivers.streets import CURVATURE, LIMIT
from scm.vehicles.jit import law

END_RATE = 5.0
STANDSTILL = 0.02
START_SPEED = 0.04
LEAD = 0.15
LONGEST_PAUSE = 0.1
MOST_SUM = 0.3


@law
def stopping_speed(distance: float, decel: float) -> float:
    """Return from which speed the car still stops comfortably within a distance [m/s]."""
    soft = decel / END_RATE
    return math.sqrt(soft * soft + 2.0 * decel * max(0.0, distance)) - soft


@law
def free_speed(
    segments: Floats,
    ids: Ints,
    begins: Floats,
    count: int,
    here: int,
    lateral_accel: float,
    decel: float,
) -> float:
    """Return the speed that lanes and curves allow here, and in time for what comes [m/s]."""
    slowest = math.inf
    for at in range(here, count):
        limit = segments[ids[at], LIMIT]
        curve = lateral_accel / max(abs(segments[ids[at], CURVATURE]), 1e-3)
        allowed = min(limit * limit, curve)
        slowest = min(slowest, allowed + 2.0 * decel * max(0.0, begins[at]))
        if slowest <= 2.0 * decel * max(0.0, begins[at + 1]):
            break
    return math.sqrt(slowest)


@law
def throttle(kind: Floats, floats: Floats, wished: float, speed: float, passed: float) -> float:
    """Return the throttle that brings a car to a speed [m/s] without haste, -1 to 1.

    The car's own table gives the steady throttle, feedback the rest.

    Args:
        kind: The row of its kind.
        floats: Its memory.
        wished: The speed it should have [m/s].
        speed: That it has [m/s].
        passed: Since the last time [s]; negative: there was none.
    """
    if passed < 0.0:
        floats[PACE] = speed
        passed = 0.0
    passed = min(LONGEST_PAUSE, passed)
    if wished < (START_SPEED if speed < STANDSTILL else STANDSTILL):
        floats[PACE] = floats[SUM] = 0.0
        return 0.0
    risen = min(floats[PACE], speed + LEAD) + kind[ACCEL] * passed
    floats[PACE] = min(wished, max(risen, START_SPEED))
    error = floats[PACE] - speed
    known = kind[STEPS] > 0.0
    proportional, integral = (4.0, 2.0) if known else (1.0, 1.0)
    value = steady(kind, floats[PACE]) + proportional * error + floats[SUM]
    bounded = max(kind[BRAKE], min(1.0, value))
    if bounded == value:
        floats[SUM] = max(-MOST_SUM, min(MOST_SUM, floats[SUM] + integral * error * passed))
    return float(bounded)


@law
def steady(kind: Floats, speed: float) -> float:
    """Return the throttle that keeps a speed [m/s], by the car's table; 0 without one."""
    steps, below = int(kind[STEPS]), 0.0
    for step in range(steps):
        above = kind[SPEEDS + step]
        if speed < above:
            return float((step + max(0.0, speed - below) / (above - below)) / steps)
        below = above
    return 1.0 if steps else 0.0


@law
def braking(speed: float, decel: float, reaction: float) -> float:
    """Return how far a car still rolls that is told to stop [m]."""
    return speed * reaction + speed * speed / (2.0 * decel)
