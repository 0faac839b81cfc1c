"""Cars of many worlds that are driven by rules: along their lanes, behind the car ahead.

    speed      the least of the limit, what bends allow, the car's own, what keeps the gap to the
               car ahead, and what stops before a junction that another car passes first
    steering   as the city's own driver

Where signals stand, a car stops before a line that is not green, unless it cannot any more. Else
agents go first at a junction where they are near, and the nearer car does. All are kernels of the
city's driver but for these rules.
"""

import math

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.gym.task import Traffic
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.car import Car
from scm.vehicles.drivers.cars_ahead import LENGTH_OF, REACH, REAR_AT, SPEED_OF, first_overlap
from scm.vehicles.drivers.controller import open_road_speed
from scm.vehicles.drivers.course import MOST_SEGMENTS, Course
from scm.vehicles.drivers.driver_state import (
    BEHIND,
    DECEL,
    FRONT,
    HERE,
    REAR,
    REQUESTED_SPEED,
    SWING,
    WIDTH,
    WINDOW_SIZE,
    DriverState,
    S,
    kind_row,
)
from scm.vehicles.drivers.lane_graph import GROUP, LaneArrays
from scm.vehicles.drivers.lane_tracking import list_segments
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.drivers.speed_control import braking, stopping_speed, throttle
from scm.vehicles.drivers.steering import MIN_PREVIEW, steer
from scm.vehicles.drivers.stop_lines import SHORT_OF_LINE
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import array_kernel
from scm.vehicles.lane_math import sin_cos
from scm.vehicles.noise import Keys, uniforms

SPEEDS = np.uint64(0x57EED5)  # keeps these draws apart from others
AGENTS_FIRST_M = 1.0  # by which an agent counts as nearer to a junction than it is
SAME_WAY = 0.5  # cosine of the angle to a lane, from which on a car drives along it
LEADER_GAP_M, LEADER_MPS, FOLLOWER_GAP_M, FOLLOWER_MPS = range(4)
"""Of an agent's car: gaps, bumper to bumper, to the cars ahead of it and behind it on their lanes,
and their speeds along them. None within 2 m: 2 m, and the own speed."""
# Columns of where a car is: centre of its outline, direction, speed along it.
_X, _Y, _COS, _SIN, _SPEED = range(5)
# Columns of the junction that a car is in or comes to: way of its front there, number, lane.
_WAY, _JUNCTION, _LANE = range(3)


class Around(ArrayStruct):
    """Working arrays: of each car of one world, (cars, ...).

    Attributes:
        ids, begins: Segments of its lanes ahead, and where each begins from its rear axle.
        counts: How many those are, and which it is on.
        at: Where it is, the columns above.
        junction: The columns above.
        leader: (1, 3) as the driver's kernels have it, of one car.
    """

    ids: Ints
    begins: Floats
    counts: Ints
    at: Floats
    junction: Floats
    leader: Floats


class RuleDrivenCars:
    """Drives those cars of all worlds that are no agents'.

    Args:
        course: Of all cars.
        cars: Rows of each world's, (worlds, cars), agents' first; rows of the others follow all
            agents'.
        agents: How many of each world's are agents'.
        car: What all are.
        traffic: How they drive.

    Attributes:
        green: Which groups of the map's signals are, (worlds, groups); none: they do not count.
        commands: Throttle and steering of each of them, (worlds * others, 2).
        known: Of each agent's car, the columns above, (worlds * agents, 4).
    """

    def __init__(self, course: Course, cars: Ints, agents: int, car: Car, traffic: Traffic) -> None:
        limits, (worlds, count) = limits_of(car), cars.shape
        self._course, self._cars, self._agents = course, cars, agents
        self._speeds = traffic.speed_mps
        self._kind = kind_row(limits, course.graph.sharpest_change(limits.wheelbase))
        self._around = Around(
            np.zeros((count, MOST_SEGMENTS), np.int64), np.zeros((count, MOST_SEGMENTS + 1)),
            np.zeros((count, 2), np.int64), np.zeros((count, 5)), np.zeros((count, 3)),
            np.zeros((1, 3)),
        )  # fmt: skip
        self.green: Bools = np.zeros((worlds, 0), np.bool_)
        self.commands: Floats = np.zeros((worlds * (count - agents), 2))
        self.known: Floats = np.zeros((worlds * agents, 4))

    def begin(self, worlds: Ints, keys: Keys) -> None:
        """Let episodes of worlds (n,) begin, by keys (rows,) of their cars."""
        rows, (low, high) = self._cars[worlds, self._agents :].ravel(), self._speeds
        share = uniforms(keys[rows] ^ SPEEDS, 1)[:, 0]
        _, state = self._course.arrays
        state.floats[rows, REQUESTED_SPEED] = low + (high - low) * share

    def decide(self, worlds: Ints, fleet: Fleet, passed_s: Floats) -> None:
        """Look round, and choose commands, in some worlds.

        Args:
            worlds: Which, (n,).
            fleet: All cars, each along its course.
            passed_s: Since the last time, (n,); negative: an episode begins.
        """
        motion = np.column_stack((fleet.x, fleet.y, fleet.yaw, fleet.speed))
        _decide(
            *self._course.arrays, self._around, self._cars, self._agents, self._kind, worlds,
            passed_s, motion, fleet.alive, self.green, self.commands, self.known,
        )  # fmt: skip


@array_kernel
def _decide(
    lanes: LaneArrays, state: DriverState, around: Around, cars: Ints, agents: int, kind: Floats,
    worlds: Ints, passed: Floats, motion: Floats, alive: Bools, green: Bools, commands: Floats,
    known: Floats,
) -> None:  # fmt: skip
    front, first, count = kind[FRONT], len(known), cars.shape[1]
    for n in range(len(worlds)):
        rows = cars[worlds[n]]
        for k in range(count):
            _look_ahead(lanes, state, around, k, rows[k], kind, motion[rows[k]])
        for k in range(count):
            row = rows[k]
            if k < agents:
                known[row, LEADER_GAP_M] = known[row, FOLLOWER_GAP_M] = REACH
                known[row, LEADER_MPS] = known[row, FOLLOWER_MPS] = around.at[k, _SPEED]
        for k in range(count):
            row, leader = rows[k], around.leader[0]
            if not alive[row]:
                continue
            found = _find_leader(lanes, around, rows, agents, alive, k, kind, known)
            if k < agents:
                if found:
                    known[row, LEADER_GAP_M] = max(0.0, leader[REAR_AT] - front)
                    known[row, LEADER_MPS] = leader[SPEED_OF]
                continue
            ids, begins, floats = around.ids[k], around.begins[k], state.floats[row]
            segments, here = around.counts[k]
            target, _ = open_road_speed(
                lanes.segments, ids, begins, around.leader, kind, floats, segments, here,
                int(found), False, False,
            )  # fmt: skip
            speed = around.at[k, _SPEED]
            if green.shape[1]:
                held = _speed_to_line(lanes, state, row, green[worlds[n]], speed, kind)
            else:
                held = _speed_to_junction(around, rows, agents, alive, k, kind)
            target = min(target, held)
            commands[row - first, 1] = steer(
                lanes.segments, ids, begins, kind, floats, segments, here, motion[row, 2],
                max(0.0, speed), passed[n],
            )  # fmt: skip
            commands[row - first, 0] = throttle(kind, floats, target, speed, passed[n])


@array_kernel
def _look_ahead(
    lanes: LaneArrays, state: DriverState, around: Around, k: int, row: int, kind: Floats,
    motion: Floats,
) -> None:  # fmt: skip
    """Note where a car is, its lanes ahead, and the junction that it is in or comes to."""
    s, c = sin_cos(motion[2])
    middle, speed = 0.5 * (kind[FRONT] - kind[REAR]), motion[3]
    at = around.at[k]
    at[_X], at[_Y], at[_COS], at[_SIN] = motion[0] + c * middle, motion[1] + s * middle, c, s
    at[_SPEED] = speed
    window, along = state.lane_window[row], state.floats[row, S]
    back = max(MIN_PREVIEW, 0.5 * max(0.0, speed) * kind[SWING])
    segments, here, _ = list_segments(
        lanes.segment_first, lanes.segments, window, along, back, kind[FRONT] + REACH,
        around.ids[k], around.begins[k],
    )  # fmt: skip
    around.counts[k, 0], around.counts[k, 1] = segments, here
    junction = around.junction[k]
    junction[_WAY], junction[_JUNCTION] = math.inf, -1.0
    begun = -along - (lanes.length[window[BEHIND]] if window[BEHIND] >= 0 else 0.0)
    for place in range(BEHIND, WINDOW_SIZE):
        lane = window[place]
        if lane < 0 and place > BEHIND:
            break
        if lane < 0:
            continue
        for stretch in range(lanes.stretch_first[lane], lanes.stretch_first[lane + 1]):
            if begun + lanes.stretches[stretch, 1] > 0.0:
                junction[_WAY] = begun + lanes.stretches[stretch, 0] - kind[FRONT]
                junction[_JUNCTION] = lanes.stretch_junction[stretch]
                junction[_LANE] = lane
                return
        begun += lanes.length[lane]
        if begun > kind[FRONT] + REACH:
            break


@array_kernel
def _find_leader(
    lanes: LaneArrays, around: Around, rows: Ints, agents: int, alive: Bools, own: int,
    kind: Floats, known: Floats,
) -> bool:  # fmt: skip
    """Find the car ahead of one, and whether that one is the nearest behind an agent's."""
    half_length, half_width = 0.5 * (kind[FRONT] + kind[REAR]), 0.5 * kind[WIDTH]
    reach, leader, at = kind[FRONT] + REACH, around.leader[0], around.at
    leader[REAR_AT] = math.inf
    for k in range(len(rows)):
        dx, dy = at[k, _X] - at[own, _X], at[k, _Y] - at[own, _Y]
        far = reach + 2.0 * half_length
        if k == own or not alive[rows[k]] or dx * dx + dy * dy > far * far:
            continue
        hit, rear, same = first_overlap(
            lanes.segments, around.ids[own], around.begins[own], kind, around.counts[own, 0],
            REACH, at[k, _X], at[k, _Y], at[k, _COS], at[k, _SIN], half_length, half_width,
        )  # fmt: skip
        if not hit:
            continue
        if rear < leader[REAR_AT]:
            leader[REAR_AT], leader[LENGTH_OF] = rear, 2.0 * half_length
            leader[SPEED_OF] = max(0.0, at[k, _SPEED] * same)
        gap = max(0.0, rear - kind[FRONT])
        if k < agents and same > SAME_WAY and gap < known[rows[k], FOLLOWER_GAP_M]:
            known[rows[k], FOLLOWER_GAP_M] = gap
            known[rows[k], FOLLOWER_MPS] = at[own, _SPEED]
    return bool(leader[REAR_AT] < math.inf)


@array_kernel
def _speed_to_junction(
    around: Around, rows: Ints, agents: int, alive: Bools, own: int, kind: Floats
) -> float:
    """Return the speed that stops a car before a junction that another passes first [m/s]."""
    junction, at = around.junction, around.at
    way = junction[own, _WAY]
    if way == math.inf or way < braking(at[own, _SPEED], kind[DECEL], 0.0):
        return math.inf
    for k in range(len(rows)):
        is_other = junction[k, _JUNCTION] == junction[own, _JUNCTION]
        is_other = is_other and junction[k, _LANE] != junction[own, _LANE]
        if k == own or not is_other or not alive[rows[k]]:
            continue
        theirs = junction[k, _WAY] - (AGENTS_FIRST_M if k < agents else 0.0)
        goes = junction[k, _WAY] < braking(at[k, _SPEED], kind[DECEL], 0.0)
        if goes or theirs < way or (theirs == way and k < own):
            return stopping_speed(way - SHORT_OF_LINE, kind[DECEL])
    return math.inf


@array_kernel
def _speed_to_line(
    lanes: LaneArrays, state: DriverState, row: int, green: Bools, speed: float, kind: Floats
) -> float:
    """Return the speed that stops a car before the next line unless that is green [m/s]."""
    begun = -state.floats[row, S] - kind[FRONT]
    for place in range(HERE, WINDOW_SIZE):
        lane = state.lane_window[row, place]
        if lane < 0 or begun > REACH:
            break
        for k in range(lanes.line_first[lane], lanes.line_first[lane + 1]):
            way, group = begun + lanes.line_at[k], lanes.line_links[k, GROUP]
            if group >= 0 and way >= 0.0:
                if green[group] or way < braking(speed, kind[DECEL], 0.0):
                    return math.inf
                return stopping_speed(way - SHORT_OF_LINE, kind[DECEL])
        begun += lanes.length[lane]
    return math.inf
