"""Steering along a way: feed-forward with preview, and feedback on the two errors.

    kappa = kappa_path - (w^2 e + 2 z w psi)           delta = atan(wheelbase * kappa)

e is the lateral error of the rear axle, psi the yaw error; for a car that rolls without slip the
error then follows e'' + 2 z w e' + w^2 e = 0 over the distance driven, at every speed.
The path's curvature jumps where a straight meets an arc, but a servo needs time. So kappa_path and
the reference of psi are means over the distance that the car covers during the servo's largest
swing on this map, centred on the axle: a path that the car can follow, a few mm beside the true
one. And e and psi are predicted for the time when the servo has swung back: without that, a slow
servo turns a large error into an oscillation.

Holds: small slip angles, |e| below a car's width.   Source: Frenet kinematics of a bicycle; ours.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.driver_state import (
    ANGLE,
    BESIDE,
    STEER,
    STEER_LIMIT,
    STEER_RATE,
    SWING,
    WHEELBASE,
)
from scm.vehicles.drivers.lane_graph import CURVATURE, YAW
from scm.vehicles.drivers.lane_tracking import heading_change
from scm.vehicles.jit import kernel_function

STIFFNESS = 8.0  # w [1/m]
DAMPING = 0.8  # z
LATERAL_LIMIT = 0.05  # larger lateral errors count as this [m]
MIN_PREVIEW = 0.02  # half the distance of the means [m]


@kernel_function
def steer(
    segments: Floats,
    ids: Ints,
    begins: Floats,
    kind: Floats,
    floats: Floats,
    count: int,
    here: int,
    yaw: float,
    speed: float,
    passed: float,
) -> float:
    """Return the steering command, -1 to 1, + = left.

    Args:
        segments: Of all lanes.
        ids: The listed segments; `begins` is where each begins, from the rear axle [m].
        begins: See `ids`.
        kind: The row of the kind of car.
        floats: Its state.
        count: Number of listed segments.
        here: Which of them the rear axle is on.
        yaw: Of the car [rad].
        speed: Forward [m/s].
        passed: Since the last command [s].
    """
    step = kind[STEER_RATE] * max(0.0, passed)
    floats[ANGLE] += max(-step, min(step, floats[STEER] - floats[ANGLE]))
    half = max(MIN_PREVIEW, 0.5 * speed * kind[SWING])
    before = heading_change(segments, ids, begins, count, here, -half)
    after = heading_change(segments, ids, begins, count, here, half)
    quarters = heading_change(segments, ids, begins, count, here, -0.5 * half)
    quarters += heading_change(segments, ids, begins, count, here, 0.5 * half)
    segment = ids[here]
    way_yaw = segments[segment, YAW] - segments[segment, CURVATURE] * begins[here]
    mean_yaw = way_yaw + (before + 4.0 * quarters + after) / 12.0
    path_curvature = (after - before) / (2.0 * half)
    error = math.sin(yaw - mean_yaw)
    curvature = path_curvature + feedback(kind, floats, error, path_curvature, speed)
    floats[STEER] = wheel_angle(kind, curvature)
    return float(floats[STEER] / kind[STEER_LIMIT])


@kernel_function
def wheel_angle(kind: Floats, curvature: float) -> float:
    """Return the angle of the front wheels [rad] for a curvature [1/m], as far as they turn."""
    limit = kind[STEER_LIMIT]
    return float(max(-limit, min(limit, math.atan(kind[WHEELBASE] * curvature))))


@kernel_function
def feedback(
    kind: Floats, floats: Floats, yaw: float, path_curvature: float, speed: float
) -> float:
    """Return the curvature [1/m] against the errors predicted for the servo's swing back."""
    off = floats[ANGLE] - math.atan(kind[WHEELBASE] * path_curvature)
    way = speed * abs(off) / kind[STEER_RATE]
    off_curvature = off / kind[WHEELBASE]
    beside = floats[BESIDE] + way * yaw + off_curvature * way * way / 3.0
    yaw += off_curvature * way / 2.0
    bounded = max(-LATERAL_LIMIT, min(LATERAL_LIMIT, beside))
    return float(-STIFFNESS * STIFFNESS * bounded - 2.0 * DAMPING * STIFFNESS * yaw)
