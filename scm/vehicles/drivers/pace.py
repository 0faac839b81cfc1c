"""How fast: the speed the way allows, the speed that still stops in time, and the throttle for it.

v(d) = sqrt((a/k)^2 + 2 a d) - a/k        stops at d = 0, deceleration below a, the end of it
exponential with k: no jerk at the stop
"""

import math

import numpy as np

from scm.clock import seconds
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.track import Track

END_RATE = 5.0
STANDSTILL = 0.02
START_SPEED = 0.04
LEAD = 0.15


def stopping_speed(distance: float, decel: float) -> float:
    """Return from which speed the car still stops comfortably within a distance [m/s]."""
    soft = decel / END_RATE
    return math.sqrt(soft**2 + 2.0 * decel * max(0.0, distance)) - soft


def free_speeds(track: Track, limits: CarLimits) -> list[float]:
    """Return the speed that lanes and curves allow at each sample of the way [m/s]."""
    curvature = np.abs(np.gradient(track.yaw, track.s))
    posted = np.array([track.path.speed_limit_mps(float(s)) for s in track.s])
    in_curves = np.sqrt(limits.lateral_accel / np.maximum(curvature, 1e-3))
    speeds: list[float] = np.minimum(posted, in_curves).tolist()
    reach = 2.0 * limits.decel * float(track.s[1])
    for _ in range(2 if track.closed else 1):
        if track.closed:
            speeds[-1] = min(speeds[-1], speeds[0])
        for i in range(len(speeds) - 2, -1, -1):
            speeds[i] = min(speeds[i], math.sqrt(speeds[i + 1] ** 2 + reach))
    return speeds


class Pace:
    """Throttle from a wished speed: the car's own steady table, and feedback for the rest."""

    def __init__(self, limits: CarLimits) -> None:
        self._limits = limits
        self._table = (0.0, *limits.speeds)
        steps = len(limits.speeds)
        self._throttles = tuple(i / steps for i in range(steps + 1)) if steps else (0.0,)
        self._proportional, self._integral = (4.0, 2.0) if steps else (1.0, 1.0)
        self._wished = 0.0
        self._sum = 0.0
        self._last_ns: int | None = None

    def throttle(self, wished: float, speed: float, now_ns: int) -> float:
        """Return the throttle that brings the car to a speed [m/s] without haste, -1 to 1."""
        if self._last_ns is None:
            self._last_ns, self._wished = now_ns, speed
        passed = min(0.1, seconds(now_ns - self._last_ns))
        self._last_ns = now_ns
        if wished < (START_SPEED if speed < STANDSTILL else STANDSTILL):
            self._wished = self._sum = 0.0
            return 0.0
        risen = min(self._wished, speed + LEAD) + self._limits.accel * passed
        self._wished = min(wished, max(risen, START_SPEED))
        error = self._wished - speed
        value = self._steady(self._wished) + self._proportional * error + self._sum
        bounded = max(self._limits.brake_throttle, min(1.0, value))
        if bounded == value:
            self._sum = max(-0.3, min(0.3, self._sum + self._integral * error * passed))
        return bounded

    def _steady(self, speed: float) -> float:
        return float(np.interp(speed, self._table, self._throttles))
