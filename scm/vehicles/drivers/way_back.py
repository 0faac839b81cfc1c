"""The way from where a car stands to its lane: does it meet a wall before the car is on the lane?

The driver's own steering law leads a car that rolls without slip, one short step after the other,
from its pose until it follows its lane. Who has driven a car by hand may leave it with its nose at
a wall: from there the law, which knows only lanes, would push it into the wall.
Holds: walking pace, walls and boxes that stay. Other cars are the law's own business.
Source: kinematic bicycle model; separating axes.
"""

import math

import numpy as np

from scm.arrays import Floats
from scm.vehicles.drivers.ahead import Scratch
from scm.vehicles.drivers.lane_tracking import locate, survey
from scm.vehicles.drivers.memory import (
    ANGLE,
    BESIDE,
    DECEL,
    FRONT,
    KIND,
    LATERAL_ACCEL,
    REAR,
    SWING,
    TOLD,
    WHEELBASE,
    WIDTH,
    Memory,
    S,
)
from scm.vehicles.drivers.pace import START_SPEED, free_speed
from scm.vehicles.drivers.steering import LEAST_HALF, steer
from scm.vehicles.drivers.streets import CURVATURE, YAW, Ways
from scm.vehicles.jit import array_kernel, law

FARTHEST_M = 4.0  # at the law's flattest approach a car comes 1 m nearer to its lane in that
STEP_M = 0.02
ON_LANE_M, ON_LANE_RAD = 0.02, 0.1
MARGIN_M = 0.005  # slip and the servo's lag cost a Nigel some millimetres
REACH_M = 1.0  # how far ahead the law looks for its speed and its preview
FREE = -1.0


@law
def depth_of(
    wall: Floats, x: float, y: float, cos: float, sin: float, ahead: float, half_length: float,
    half_width: float,
) -> float:  # fmt: skip
    """Return how deep a segment reaches into a car's outline [m]; below 0: it keeps clear.

    The pose is the rear axle's; the outline's middle lies `ahead` of it.
    """
    dx, dy = wall[0] - x, wall[1] - y
    u0, v0 = cos * dx + sin * dy - ahead, cos * dy - sin * dx
    dx, dy = wall[2] - x, wall[3] - y
    u1, v1 = cos * dx + sin * dy - ahead, cos * dy - sin * dx
    along = half_length - max(min(u0, u1), -max(u0, u1))
    across = half_width - max(min(v0, v1), -max(v0, v1))
    length = math.hypot(u1 - u0, v1 - v0)
    if length == 0.0:
        return float(min(along, across))
    c, s = (u1 - u0) / length, (v1 - v0) / length
    through = abs(s) * half_length + abs(c) * half_width - abs(c * v0 - s * u0)
    return float(min(along, across, through))


@law
def deepest(walls: Floats, kind: Floats, x: float, y: float, yaw: float) -> float:
    """Return how deep any wall reaches into a car's outline [m]; below 0: all keep clear."""
    cos, sin, found = math.cos(yaw), math.sin(yaw), -math.inf
    ahead = 0.5 * (kind[FRONT] - kind[REAR])
    half_length, half_width = 0.5 * (kind[FRONT] + kind[REAR]), 0.5 * kind[WIDTH]
    for k in range(walls.shape[0]):
        depth = depth_of(walls[k], x, y, cos, sin, ahead, half_length, half_width)
        found = max(found, depth)
    return found


@array_kernel
def free_way(
    ways: Ways, memory: Memory, room: Scratch, walls: Floats, x: float, y: float, yaw: float
) -> float:
    """Return how far the memory's only car gets before it meets a wall [m]; FREE: none is met.

    Args:
        ways: The lanes.
        memory: Of one car, which was sent; it is driven in it.
        room: To work in.
        walls: (k, 4) x0, y0, x1, y1 of all that is near [m].
        x: Of the rear axle, map frame; likewise `y` and `yaw`.
        y: See `x`.
        yaw: See `x`.
    """
    floats, sight, kind = memory.floats[0], memory.sight[0], memory.kinds[memory.ints[0, KIND]]
    segments, first = ways.segments, ways.segment_first
    ids, begins = room.ids, room.begins
    allowed = max(-MARGIN_M, deepest(walls, kind, x, y, yaw)) + 1e-4
    speed, gone = START_SPEED, 0.0
    while gone < FARTHEST_M:
        locate(ways, memory, 0, x, y)
        back = max(LEAST_HALF, 0.5 * speed * kind[SWING])
        count, here, ends = survey(
            first, segments, sight, floats[S], back, kind[FRONT] + REACH_M, ids, begins
        )
        if ends and begins[count] <= 0.0:
            return FREE
        segment = ids[here]
        way_yaw = segments[segment, YAW] - segments[segment, CURVATURE] * begins[here]
        if abs(floats[BESIDE]) < ON_LANE_M and abs(math.sin(yaw - way_yaw)) < ON_LANE_RAD:
            return FREE
        wished = free_speed(segments, ids, begins, count, here, kind[LATERAL_ACCEL], kind[DECEL])
        speed = max(START_SPEED, min(wished, floats[TOLD]))
        steer(segments, ids, begins, kind, floats, count, here, yaw, speed, STEP_M / speed)
        curvature = math.tan(floats[ANGLE]) / kind[WHEELBASE]
        middle = yaw + 0.5 * STEP_M * curvature
        x, y = x + STEP_M * math.cos(middle), y + STEP_M * math.sin(middle)
        yaw += STEP_M * curvature
        gone += STEP_M
        if deepest(walls, kind, x, y, yaw) > allowed:
            return gone - STEP_M
    return FREE


def walls_near(walls: Floats, x: float, y: float, reach: float) -> Floats:
    """Return those of some segments (m, 4) whose rectangle comes within a reach of a point [m]."""
    low, high = np.minimum(walls[:, :2], walls[:, 2:]), np.maximum(walls[:, :2], walls[:, 2:])
    off = np.maximum(low - (x, y), 0.0) + np.maximum((x, y) - high, 0.0)
    near: Floats = walls[np.hypot(off[:, 0], off[:, 1]) < reach]
    return near
