"""Steering along a way: feed-forward with preview, and feedback on the two errors.

    kappa = kappa_path - (w^2 e + 2 z w psi)           delta = atan(wheelbase * kappa)

e is the lateral error of the rear axle, psi the yaw error; for a car that rolls without slip the
error then follows e'' + 2 z w e' + w^2 e = 0 over the distance driven, at every speed.
The path's curvature jumps where a straight meets an arc, but a servo takes its time. So kappa_path
and the yaw psi refers to are means over the stretch that the car covers while the servo makes the
map's largest swing, centred on the axle: a way that the car can really follow, a few mm beside the
true one. And e and psi are those the car will have when the servo has swung back from where it is
now: without that look ahead a slow servo turns a large error into a weave.

Holds: small slip angles, |e| below a car's width.   Source: Frenet kinematics of a bicycle; ours.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.lane_tracking import turned
from scm.vehicles.drivers.memory import (
    ANGLE,
    BESIDE,
    STEER,
    STEER_LIMIT,
    STEER_RATE,
    SWING,
    WHEELBASE,
)
from scm.vehicles.drivers.streets import CURVATURE, YAW
from scm.vehicles.jit import law

STIFFNESS = 8.0
DAMPING = 0.8
LATERAL_LIMIT = 0.05
LEAST_HALF = 0.02


@law
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
        ids: The surveyed segments; `begins` where each begins, from the rear axle on [m].
        begins: See `ids`.
        kind: The row of the kind of car.
        floats: Its memory.
        count: Of surveyed segments.
        here: Which of them the rear axle is on.
        yaw: Of the car [rad].
        speed: Forward [m/s].
        passed: Since the last command [s].
    """
    step = kind[STEER_RATE] * max(0.0, passed)
    floats[ANGLE] += max(-step, min(step, floats[STEER] - floats[ANGLE]))
    half = max(LEAST_HALF, 0.5 * speed * kind[SWING])
    before = turned(segments, ids, begins, count, here, -half)
    after = turned(segments, ids, begins, count, here, half)
    quarters = turned(segments, ids, begins, count, here, -0.5 * half)
    quarters += turned(segments, ids, begins, count, here, 0.5 * half)
    segment = ids[here]
    way_yaw = segments[segment, YAW] - segments[segment, CURVATURE] * begins[here]
    mean_yaw = way_yaw + (before + 4.0 * quarters + after) / 12.0
    path_curvature = (after - before) / (2.0 * half)
    error = math.sin(yaw - mean_yaw)
    curvature = path_curvature + feedback(kind, floats, error, path_curvature, speed)
    limit = kind[STEER_LIMIT]
    floats[STEER] = max(-limit, min(limit, math.atan(kind[WHEELBASE] * curvature)))
    return float(floats[STEER] / limit)


@law
def feedback(
    kind: Floats, floats: Floats, yaw: float, path_curvature: float, speed: float
) -> float:
    """Return the curvature [1/m] against the errors the car has once the servo swung back."""
    off = floats[ANGLE] - math.atan(kind[WHEELBASE] * path_curvature)
    way = speed * abs(off) / kind[STEER_RATE]
    off_curvature = off / kind[WHEELBASE]
    beside = floats[BESIDE] + way * yaw + off_curvature * way * way / 3.0
    yaw += off_curvature * way / 2.0
    bounded = max(-LATERAL_LIMIT, min(LATERAL_LIMIT, beside))
    return float(-STIFFNESS * STIFFNESS * bounded - 2.0 * DAMPING * STIFFNESS * yaw)
