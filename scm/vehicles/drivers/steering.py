"""Steering along a path: curvature feed-forward with preview, and feedback on the two errors.

    kappa = kappa_path + -(w^2 e + 2 z w psi)          delta = atan(wheelbase * kappa)

e is the lateral error of the rear axle, psi the yaw error; for a car that rolls without slip the
error then follows e'' + 2 z w e' + w^2 e = 0 over the distance driven, at every speed.
The path's curvature jumps where a straight meets an arc, a servo takes its time: kappa_path is the
mean over the stretch that the car covers while the servo swings, centred on the axle.

Holds: small slip angles, |e| below a car's width.   Source: Frenet kinematics of a bicycle; ours.
"""

import math

from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.track import Track

STIFFNESS = 7.0
DAMPING = 0.9
LATERAL_LIMIT = 0.10
SHORTEST_MEAN = 0.02


def steer(
    limits: CarLimits, track: Track, s: float, errors: tuple[float, float], v: float
) -> float:
    """Return the steering command, -1 to 1, + = left.

    Args:
        limits: Of the car.
        track: The way.
        s: Where the rear axle is along it [m].
        errors: Lateral [m], + = car left of the path, and yaw [rad] against it.
        v: Speed [m/s].
    """
    lateral, yaw = errors
    half = 0.5 * max(SHORTEST_MEAN, v * _swing_time(limits, track, s, v))
    wanted = track.mean_curvature(s - half, s + half)
    bounded = max(-LATERAL_LIMIT, min(LATERAL_LIMIT, lateral))
    wanted -= STIFFNESS**2 * bounded + 2.0 * DAMPING * STIFFNESS * math.sin(yaw)
    angle = math.atan(limits.wheelbase * wanted)
    return max(-1.0, min(1.0, angle / limits.steer_limit))


def _swing_time(limits: CarLimits, track: Track, s: float, v: float) -> float:
    """Return how long the servo needs for the change of curvature around s [s]."""
    reach = max(SHORTEST_MEAN, 0.5 * v * limits.steer_limit / limits.steer_rate)
    before = track.mean_curvature(s - reach - SHORTEST_MEAN, s - reach)
    after = track.mean_curvature(s + reach, s + reach + SHORTEST_MEAN)
    return abs(math.atan(limits.wheelbase * (after - before))) / limits.steer_rate
