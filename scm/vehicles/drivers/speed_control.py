"""Allowed speed, stopping speed, and the throttle for a target speed.

v(d) = sqrt((a/k)^2 + 2 a d) - a/k        stops at d = 0 with deceleration below a; its end is
exponential with rate k, without a jerk
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.driver_state import (
    ACCEL,
    BRAKE,
    INTEGRAL,
    SPEED_SETPOINT,
    SPEEDS,
    STEPS,
)
from scm.vehicles.drivers.lane_graph import CURVATURE, LIMIT
from scm.vehicles.jit import kernel_function

END_RATE = 5.0  # of the exponential end of a stop [1/s]
STANDSTILL = 0.02  # a slower car stands [m/s]
START_SPEED = 0.04  # the lowest setpoint of a moving car [m/s]
MAX_LEAD = 0.15  # of the setpoint over the speed [m/s]
MAX_STEP_S = 0.1  # a longer pause between decisions counts as this
MAX_INTEGRAL = 0.3  # throttle that the integral part may add


@kernel_function
def stopping_speed(distance: float, decel: float) -> float:
    """Return the highest speed from which the car stops comfortably within a distance [m/s]."""
    soft = decel / END_RATE
    return math.sqrt(soft * soft + 2.0 * decel * max(0.0, distance)) - soft


@kernel_function
def free_speed(
    segments: Floats,
    ids: Ints,
    begins: Floats,
    count: int,
    here: int,
    lateral_accel: float,
    decel: float,
) -> float:
    """Return the speed that lanes and curves allow, here and in time for what is ahead [m/s]."""
    slowest = math.inf
    for at in range(here, count):
        limit = segments[ids[at], LIMIT]
        curve = lateral_accel / max(abs(segments[ids[at], CURVATURE]), 1e-3)
        allowed = min(limit * limit, curve)
        slowest = min(slowest, allowed + 2.0 * decel * max(0.0, begins[at]))
        if slowest <= 2.0 * decel * max(0.0, begins[at + 1]):
            break
    return math.sqrt(slowest)


@kernel_function
def throttle(kind: Floats, floats: Floats, target: float, speed: float, passed: float) -> float:
    """Return the throttle that brings a car smoothly to a target speed, -1 to 1.

    Feed-forward from the car's throttle table, and PI feedback.

    Args:
        kind: The row of its kind.
        floats: Its state.
        target: Speed setpoint [m/s].
        speed: Present speed [m/s].
        passed: Time since the last decision [s]; negative: this is the first.
    """
    if passed < 0.0:
        floats[SPEED_SETPOINT] = speed
        passed = 0.0
    passed = min(MAX_STEP_S, passed)
    if target < (START_SPEED if speed < STANDSTILL else STANDSTILL):
        floats[SPEED_SETPOINT] = floats[INTEGRAL] = 0.0
        return 0.0
    risen = min(floats[SPEED_SETPOINT], speed + MAX_LEAD) + kind[ACCEL] * passed
    floats[SPEED_SETPOINT] = min(target, max(risen, START_SPEED))
    error = floats[SPEED_SETPOINT] - speed
    known = kind[STEPS] > 0.0
    kp, ki = (4.0, 2.0) if known else (1.0, 1.0)
    value = steady(kind, floats[SPEED_SETPOINT]) + kp * error + floats[INTEGRAL]
    bounded = max(kind[BRAKE], min(1.0, value))
    if bounded == value:
        floats[INTEGRAL] = max(
            -MAX_INTEGRAL, min(MAX_INTEGRAL, floats[INTEGRAL] + ki * error * passed)
        )
    return float(bounded)


@kernel_function
def steady(kind: Floats, speed: float) -> float:
    """Return the throttle that holds a speed [m/s], by the car's table; 0 without one."""
    steps, below = int(kind[STEPS]), 0.0
    for step in range(steps):
        above = kind[SPEEDS + step]
        if speed < above:
            return float((step + max(0.0, speed - below) / (above - below)) / steps)
        below = above
    return 1.0 if steps else 0.0


@kernel_function
def braking(speed: float, decel: float, reaction: float) -> float:
    """Return the stopping distance of a car, reaction time included [m]."""
    return speed * reaction + speed * speed / (2.0 * decel)
