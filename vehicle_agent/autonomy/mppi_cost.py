"""What a simulated drive costs, by the car's poses over time: in seconds, more or less.

    way left / top speed              at the horizon's end; and 1 a second until the way left is
                                      but some `ARRIVED_M`: so both the end and the next metre hurry
    h(e / E) + h(psi / P)             beside the path by e and psi, a second and at the horizon's
                                      end; E and P shrink towards the end of the piece
    (too much / what costs 1)^2       a second, by `Weights`: speed over that from which the car can
                                      brake before the end, way past it, room lacking of what is
                                      wanted and the path has, acceleration, change of commands
    `TOUCHED`, more the sooner it is  where the outline has no margin to what stands or moves

h(u) = log(1 + u^2) grows ever more slowly: so it pays to drive round what stands in the way, and to
get on where the car is off the path anyway.
"""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats
from scm.vehicles.jit import array_kernel, inlined, kernel_function
from vehicle_agent.autonomy.outline import Scene, clearance_at, room_at

DISC_M = 0.03  # radius of the discs along the outline
TOUCHED = 1000.0
ARRIVED_M = 0.015
NEAR_M = 0.025  # room by discs below which the exact outline is looked at
CLEAR_M, BEYOND_M = 0.03, 0.05  # needed round moving discs, and wanted beyond that
STANDS_MPS = 0.01  # slower than that no braking is missing


class Weights(NamedTuple):
    """Deviations that cost about 1 a second, and the weights of two costs.

    Attributes:
        end_m, end_rad: Beside the path at the end of a piece; `far_m`, `far_rad`: long before it.
        near_m: From the end, where that begins to change.
        speed_mps, past_m, room_m, accel_mps2, command: Too much of these; command a second.
        beside: Weight of being beside the path; `horizon`: of that at the horizon's end [s].
    """

    end_m: float = 0.01
    end_rad: float = 0.03
    far_m: float = 0.2
    far_rad: float = 0.5
    near_m: float = 0.4
    speed_mps: float = 0.05
    past_m: float = 0.02
    room_m: float = 0.015
    accel_mps2: float = 0.2
    command: float = 2.0
    beside: float = 0.25
    horizon: float = 1.0


WEIGHTS = Weights()


class Task(NamedTuple):
    """What simulated drives are for.

    Attributes:
        scene: Car and grid.
        discs_m: (c, 2) middles of discs along the outline.
        outline: (4,) rear, front, right, left.
        moving: (k, 5) as `ElasticBand.plan` has them.
        begin_s: When the drives begin, by the moving discs' clock.
        poses: (n, 3) of the piece of the path to follow; `along_m`: (n,) way to each.
        wanted_m: (n,) room wanted beside each of them.
        gear: +1 forward, -1 backward.
        speed_mps, accel_mps2: Limits.
        margin_m: That the exact outline must keep.
        step_s: From one pose of a drive to the next.
        weights: Of the costs.
    """

    scene: Scene
    discs_m: Floats
    outline: Floats
    moving: Floats
    begin_s: float
    poses: Floats
    along_m: Floats
    wanted_m: Floats
    gear: float
    speed_mps: float
    accel_mps2: float
    margin_m: float
    step_s: float
    weights: Weights


@kernel_function
def room_of(scene: Scene, discs: Floats, x: float, y: float, yaw: float) -> float:
    """Return the least room of the discs along the outline [m], NaN outside the grid."""
    c, s = math.cos(yaw), math.sin(yaw)
    least = math.inf
    for i in range(len(discs)):
        ahead, beside = discs[i, 0], discs[i, 1]
        clearance = clearance_at(scene, x + c * ahead - s * beside, y + s * ahead + c * beside)
        if math.isnan(clearance):
            return math.nan
        least = min(least, clearance)
    return least - DISC_M


@kernel_function
def _apart(moving: Floats, outline: Floats, t: float, x: float, y: float, yaw: float) -> float:
    """Return the least distance between the outline and a moving disc at a time [m]."""
    c, s = math.cos(yaw), math.sin(yaw)
    least = math.inf
    for k in range(len(moving)):
        dx, dy = moving[k, 0] + t * moving[k, 2] - x, moving[k, 1] + t * moving[k, 3] - y
        along, across = c * dx + s * dy, c * dy - s * dx
        beyond = max(outline[0] - along, 0.0, along - outline[1])
        beside = max(outline[2] - across, 0.0, across - outline[3])
        least = min(least, math.hypot(beyond, beside) - moving[k, 4])
    return least


@inlined
def _beside(e: float, turned: float, left: float, weights: Weights) -> float:
    """Return what it costs to be beside the path, so far before the piece's end."""
    far = min(max(left, 0.0) / weights.near_m, 1.0)
    e /= weights.end_m + far * (weights.far_m - weights.end_m)
    turned /= weights.end_rad + far * (weights.far_rad - weights.end_rad)
    return math.log(1.0 + e * e) + math.log(1.0 + turned * turned)


@kernel_function
def _cost_of(task: Task, states: Floats, commands: Floats, k: int) -> float:
    """Return the cost of drive k; arguments as those of `costs_of`."""
    weights = task.weights
    steps, points, dt = states.shape[0], len(task.poses), task.step_s
    cost, at, before, left, beside = 0.0, 0, states[0, 3, k], 0.0, 0.0
    for t in range(steps):
        x, y, yaw, speed = states[t, 0, k], states[t, 1, k], states[t, 2, k], states[t, 3, k]
        room = room_of(task.scene, task.discs_m, x, y, yaw)
        apart = _apart(task.moving, task.outline, task.begin_s + (t + 1) * dt, x, y, yaw)
        is_near = not room >= max(NEAR_M, task.margin_m)
        if apart < CLEAR_M or (
            is_near and room_at(task.scene, x, y, yaw, task.margin_m) == -math.inf
        ):
            return float(cost + TOUCHED * (2.0 - (t + 1.0) / steps))
        away = math.hypot(task.poses[at, 0] - x, task.poses[at, 1] - y)
        while at + 1 < points:
            further = math.hypot(task.poses[at + 1, 0] - x, task.poses[at + 1, 1] - y)
            if further > away:
                break
            at, away = at + 1, further
        c, s = math.cos(task.poses[at, 2]), math.sin(task.poses[at, 2])
        dx, dy = x - task.poses[at, 0], y - task.poses[at, 1]
        turned = yaw - task.poses[at, 2]
        turned -= math.tau * math.floor(turned / math.tau + 0.5)
        left = task.along_m[-1] - task.along_m[at] - task.gear * (c * dx + s * dy)
        beside = _beside(c * dy - s * dx, turned, left, weights)
        most = min(task.speed_mps, math.sqrt(2.0 * task.accel_mps2 * max(left, 0.0)))
        fast = max(abs(speed) - max(most, STANDS_MPS), 0.0) / weights.speed_mps
        gained = max(abs(speed - before) / dt - task.accel_mps2, 0.0) / weights.accel_mps2
        lack = max(task.wanted_m[at] - room, 0.0) / weights.room_m
        late = max(CLEAR_M + BEYOND_M - apart, 0.0) / BEYOND_M
        past = max(-left, 0.0) / weights.past_m
        stage = weights.beside * beside + fast * fast + gained * gained + lack * lack
        stage += late * late + past * past + max(left, 0.0) / (max(left, 0.0) + ARRIVED_M)
        if t > 0:
            for c_ in range(2):
                change = (commands[t, k, c_] - commands[t - 1, k, c_]) / dt / weights.command
                stage += change * change
        cost += dt * stage
        before = speed
    return float(cost + max(left, 0.0) / task.speed_mps + weights.horizon * beside)


@array_kernel
def costs_of(task: Task, states: Floats, commands: Floats) -> Floats:
    """Return the cost of each drive, (n,).

    Args:
        task: What they are for.
        states: (T, 4, n) x, y, yaw and speed after each step.
        commands: (T, n, 2) throttle and steering.
    """
    costs = np.empty(states.shape[2])
    for k in range(len(costs)):
        costs[k] = _cost_of(task, states, commands, k)
    return costs


@array_kernel
def rooms_of(scene: Scene, discs: Floats, poses: Floats) -> Floats:
    """Return `room_of` of poses (n, 3), (n,)."""
    rooms = np.empty(len(poses))
    for i in range(len(poses)):
        rooms[i] = room_of(scene, discs, poses[i, 0], poses[i, 1], poses[i, 2])
    return rooms
