"""Whether a car would hit a wall on the path from its pose to its lane.

The driver's own steering drives a car without slip, in short steps, from its pose until it follows
its lane. A car driven manually may be left with its front at a wall: from there the controller,
which knows only lanes, would push it into the wall.
Holds: walking pace, fixed walls and boxes. Other cars are left to the controller.
Source: kinematic bicycle model; separating axes.
"""

import math

import numpy as np

from scm.arrays import Floats
from scm.vehicles.drivers.cars_ahead import Scratch
from scm.vehicles.drivers.driver_state import (
    ANGLE,
    BESIDE,
    DECEL,
    FRONT,
    KIND,
    LATERAL_ACCEL,
    REAR,
    REQUESTED_SPEED,
    SWING,
    WHEELBASE,
    WIDTH,
    DriverState,
    S,
)
from scm.vehicles.drivers.lane_graph import CURVATURE, YAW, LaneArrays
from scm.vehicles.drivers.lane_tracking import list_segments, update_position
from scm.vehicles.drivers.speed_control import START_SPEED, free_speed
from scm.vehicles.drivers.steering import MIN_PREVIEW, steer
from scm.vehicles.jit import array_kernel, kernel_function

MAX_RETURN_M = 4.0  # in which the flattest approach brings a car 1 m nearer to its lane
STEP_M = 0.02
ON_LANE_M, ON_LANE_RAD = 0.02, 0.1
MARGIN_M = 0.005  # slip and the servo's lag cost a Nigel some millimetres
REACH_M = 1.0  # preview for speed and steering
NO_WALL = -1.0


@kernel_function
def depth_of(
    wall: Floats, x: float, y: float, cos: float, sin: float, ahead: float, half_length: float,
    half_width: float,
) -> float:  # fmt: skip
    """Return how deep a wall segment reaches into a car's outline [m]; below 0: no contact.

    The pose is the rear axle's; the outline's centre lies `ahead` of it.
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


@kernel_function
def deepest(walls: Floats, kind: Floats, x: float, y: float, yaw: float) -> float:
    """Return how deep any wall reaches into a car's outline [m]; below 0: no contact."""
    cos, sin, found = math.cos(yaw), math.sin(yaw), -math.inf
    ahead = 0.5 * (kind[FRONT] - kind[REAR])
    half_length, half_width = 0.5 * (kind[FRONT] + kind[REAR]), 0.5 * kind[WIDTH]
    for k in range(walls.shape[0]):
        depth = depth_of(walls[k], x, y, cos, sin, ahead, half_length, half_width)
        found = max(found, depth)
    return found


@array_kernel
def distance_to_wall(
    lanes: LaneArrays,
    state: DriverState,
    scratch: Scratch,
    walls: Floats,
    x: float,
    y: float,
    yaw: float,
) -> float:
    """Return how far the only car of a state gets before it hits a wall [m], or NO_WALL.

    Args:
        lanes: The lanes.
        state: Of one car, which was sent; the simulation changes it.
        scratch: Working arrays.
        walls: (k, 4) x0, y0, x1, y1 of the walls nearby [m].
        x: Of the rear axle, map frame; likewise `y` and `yaw`.
        y: See `x`.
        yaw: See `x`.
    """
    floats, lane_window, kind = (
        state.floats[0],
        state.lane_window[0],
        state.kinds[state.ints[0, KIND]],
    )
    segments, first = lanes.segments, lanes.segment_first
    ids, begins = scratch.ids, scratch.begins
    allowed = max(-MARGIN_M, deepest(walls, kind, x, y, yaw)) + 1e-4
    speed, gone = START_SPEED, 0.0
    while gone < MAX_RETURN_M:
        update_position(lanes, state, 0, x, y)
        back = max(MIN_PREVIEW, 0.5 * speed * kind[SWING])
        count, here, ends = list_segments(
            first, segments, lane_window, floats[S], back, kind[FRONT] + REACH_M, ids, begins
        )
        if ends and begins[count] <= 0.0:
            return NO_WALL
        segment = ids[here]
        way_yaw = segments[segment, YAW] - segments[segment, CURVATURE] * begins[here]
        if abs(floats[BESIDE]) < ON_LANE_M and abs(math.sin(yaw - way_yaw)) < ON_LANE_RAD:
            return NO_WALL
        target = free_speed(segments, ids, begins, count, here, kind[LATERAL_ACCEL], kind[DECEL])
        speed = max(START_SPEED, min(target, floats[REQUESTED_SPEED]))
        steer(segments, ids, begins, kind, floats, count, here, yaw, speed, STEP_M / speed)
        curvature = math.tan(floats[ANGLE]) / kind[WHEELBASE]
        middle = yaw + 0.5 * STEP_M * curvature
        x, y = x + STEP_M * math.cos(middle), y + STEP_M * math.sin(middle)
        yaw += STEP_M * curvature
        gone += STEP_M
        if deepest(walls, kind, x, y, yaw) > allowed:
            return gone - STEP_M
    return NO_WALL


def walls_near(walls: Floats, x: float, y: float, reach: float) -> Floats:
    """Return those of some segments (m, 4) whose bounding box is within `reach` of a point [m]."""
    low, high = np.minimum(walls[:, :2], walls[:, 2:]), np.maximum(walls[:, :2], walls[:, 2:])
    off = np.maximum(low - (x, y), 0.0) + np.maximum((x, y) - high, 0.0)
    near: Floats = walls[np.hypot(off[:, 0], off[:, 1]) < reach]
    return near
