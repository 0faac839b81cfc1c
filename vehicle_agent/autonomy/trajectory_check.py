"""Whether a trajectory can be driven: within the car's limits, its exact outline free throughout.

Between two states the car is on an arc at constant acceleration. Sampled so that no corner moves
more than `SAMPLE_M`. Moving obstacles are discs.
"""

import math

import numpy as np

from scm.arrays import Floats
from scm.geometry import TAU
from scm.vehicles.jit import array_kernel, kernel_function
from vehicle_agent.autonomy.grid_map import GridMap
from vehicle_agent.autonomy.outline import Scene, room_at, scene_of
from vehicle_agent.autonomy.plan import CarLimits, Trajectory

SAMPLE_M, STEP_M, TURN_LEAST_RAD = 0.005, 0.01, 1e-6
TOLERANCE = 0.02  # of each limit,
SPEED_TOLERANCE_MPS, STEERING_TOLERANCE_RAD = 0.002, 0.002  # and at least so much
PLACE_TOLERANCE_M, TURN_TOLERANCE_RAD = 0.002, 0.01  # of one interval's motion


def is_free(grid: GridMap, limits: CarLimits, trajectory: Trajectory, moving: Floats) -> bool:
    """Return whether a car can drive a trajectory without touching anything.

    Args:
        grid: What does not move; where a circle's middle leaves it, nothing is free.
        limits: Of the car; speeds, rates and steering may pass them by `TOLERANCE`.
        trajectory: What to check; a speed over the limit at its first time is no fault.
        moving: (k, 5) x, y [m], vx, vy [m/s] and radius [m] of obstacles at the trajectory's
            beginning, map frame; they keep their velocities.
    """
    if not is_within_limits(limits, trajectory):
        return False
    outline = np.array((limits.rear_m, limits.front_m, limits.right_m, limits.left_m))
    states = np.column_stack((trajectory.poses, trajectory.speeds_mps, trajectory.times_s))
    return bool(_is_free(states, outline, scene_of(grid, limits), moving))


def is_within_limits(limits: CarLimits, trajectory: Trajectory) -> bool:
    """Return whether speeds, steering, their rates and the poses belong to this car's motion."""
    dt, v, steering = np.diff(trajectory.times_s), trajectory.speeds_mps, trajectory.steering_rad
    values = (trajectory.times_s, trajectory.poses, v, steering)
    if not all(np.isfinite(one).all() for one in values) or (dt < 0.0).any():
        return False
    more, room = 1.0 + TOLERANCE, (SPEED_TOLERANCE_MPS, STEERING_TOLERANCE_RAD)
    within = (
        v[1:] <= limits.speed_mps * more + room[0],
        v[1:] >= -limits.reverse_mps * more - room[0],
        np.abs(steering) <= limits.steering_rad * more + room[1],
        np.abs(np.diff(v)) <= limits.accel_mps2 * more * dt + room[0],
        np.abs(np.diff(steering)) <= limits.steering_rate_radps * more * dt + room[1],
        *_follows(limits, trajectory),
    )
    return all(bool(one.all()) for one in within)


def motion_errors(limits: CarLimits, trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Return how far each interval's end is from where the bicycle would be, (n - 1,) [m], [rad].

    From the state at its beginning, on an arc at the mean of both steering angles.
    """
    dt = np.diff(trajectory.times_s)
    way = 0.5 * (trajectory.speeds_mps[1:] + trajectory.speeds_mps[:-1]) * dt
    steering = 0.5 * (trajectory.steering_rad[1:] + trajectory.steering_rad[:-1])
    turn = way * np.tan(steering) / limits.wheelbase_m
    chord, yaw = way * np.sinc(turn / (2.0 * np.pi)), trajectory.poses[:-1, 2]
    dx, dy, turned = np.diff(trajectory.poses, axis=0).T
    x, y = chord * np.cos(yaw + 0.5 * turn), chord * np.sin(yaw + 0.5 * turn)
    return np.hypot(dx - x, dy - y), np.abs(turned - turn)


def _follows(limits: CarLimits, trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    place, turn = motion_errors(limits, trajectory)
    return place <= PLACE_TOLERANCE_M, turn <= TURN_TOLERANCE_RAD


def sampled(limits: CarLimits, poses: Floats, times_s: Floats) -> tuple[Floats, Floats]:
    """Return poses (m, 3) and times (m,) with more between them: no corner moves `STEP_M` at once.

    Args:
        limits: Of the car.
        poses: (n, 3), between which the car is on arcs.
        times_s: (n,) of each; evenly spread between them.
    """
    if len(poses) < 2:
        return poses, times_s
    reach = math.hypot(max(limits.front_m, -limits.rear_m), max(limits.left_m, -limits.right_m))
    steps = np.diff(poses, axis=0)
    steps[:, 2] = np.remainder(steps[:, 2] + math.pi, TAU) - math.pi
    furthest = np.hypot(*steps[:, :2].T) + reach * np.abs(steps[:, 2])
    counts = np.maximum(np.ceil(furthest / STEP_M), 1.0).astype(np.int64)
    begin = np.repeat(np.arange(len(steps)), counts)
    number = np.arange(len(begin)) - np.repeat(np.cumsum(counts) - counts, counts)
    part = number / counts[begin]
    dx, dy, turn = steps[begin].T
    half = np.where(np.abs(turn) > TURN_LEAST_RAD, 0.5 * turn, TURN_LEAST_RAD)
    share, angle = np.sin(part * half) / np.sin(half), 0.5 * (part - 1.0) * turn
    c, s = share * np.cos(angle), share * np.sin(angle)
    moved = np.column_stack((c * dx - s * dy, s * dx + c * dy, part * turn))
    times = times_s[begin] + part * np.diff(times_s)[begin]
    return np.vstack((poses[begin] + moved, poses[-1:])), np.append(times, times_s[-1])


@kernel_function
def _is_clear_of(moving: Floats, t: float, x: float, y: float, yaw: float, outline: Floats) -> bool:
    """Return whether the outline at a pose touches no moving disc at a time."""
    c, s = math.cos(yaw), math.sin(yaw)
    for k in range(len(moving)):
        dx, dy = moving[k, 0] + t * moving[k, 2] - x, moving[k, 1] + t * moving[k, 3] - y
        along, across = c * dx + s * dy, c * dy - s * dx
        beyond = max(outline[0] - along, 0.0, along - outline[1])
        beside = max(outline[2] - across, 0.0, across - outline[3])
        if math.hypot(beyond, beside) <= moving[k, 4]:
            return False
    return True


@array_kernel
def _is_free(states: Floats, outline: Floats, scene: Scene, moving: Floats) -> bool:
    """Return whether all poses, and those between them, are free.

    Args:
        states: (n, 5) x, y, yaw, speed, time.
        outline: (4,) rear, front, right, left.
        scene: Car and grid.
        moving: (k, 5).
    """
    reach = math.hypot(max(outline[1], -outline[0]), max(outline[3], -outline[2]))
    for i in range(max(len(states) - 1, 1)):
        a, b = states[i], states[min(i + 1, len(states) - 1)]
        dx, dy, turn, dt = b[0] - a[0], b[1] - a[1], b[2] - a[2], b[4] - a[4]
        furthest = math.hypot(dx, dy) + reach * abs(turn)
        for k in range(len(moving)):
            furthest = max(furthest, math.hypot(moving[k, 2], moving[k, 3]) * dt)
        count = math.ceil(furthest / SAMPLE_M) + 1
        for j in range(count + 1):
            past, part = j / count, j / count
            if abs(a[3] + b[3]) > 1e-6 and a[3] * b[3] >= 0.0:
                part = past * (2.0 * a[3] + past * (b[3] - a[3])) / (a[3] + b[3])
            share = part
            if abs(turn) > 1e-6:
                share = math.sin(0.5 * part * turn) / math.sin(0.5 * turn)
            c, s = math.cos(0.5 * (part - 1.0) * turn), math.sin(0.5 * (part - 1.0) * turn)
            x, y = a[0] + share * (c * dx - s * dy), a[1] + share * (s * dx + c * dy)
            yaw = a[2] + part * turn
            if not _is_clear_of(moving, a[4] + past * dt, x, y, yaw, outline):
                return False
            if room_at(scene, x, y, yaw, 0.0) == -math.inf:
                return False
    return True
