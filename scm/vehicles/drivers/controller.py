"""The driver's controller, compiled, for any number of cars.

The lowest of all speed limits wins: the lane and its curves, the end of the route, the next stop
line, the car ahead (a time gap in flow, a fixed gap at rest), an order to stop, and on maps with
speed advice the speed that reaches a red line when it turns green.
"""

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.cars_ahead import (
    REACH,
    REAR_AT,
    SPEED_OF,
    STANDSTILL_GAP,
    Scratch,
    find_cars_ahead,
)
from scm.vehicles.drivers.driver_state import (
    ARRIVED,
    AT_SIGNALS,
    DECEL,
    FREE,
    FRONT,
    GOAL,
    HERE,
    INDEX,
    KIND,
    LAST_NS,
    LATERAL_ACCEL,
    ORDER,
    REQUESTED_SPEED,
    SIGN,
    SWING,
    TURN,
    VEHICLE,
    WAITING,
    WAS_FREE,
    DriverState,
    S,
)
from scm.vehicles.drivers.giving_way import gives_way
from scm.vehicles.drivers.green_light import advised_approach
from scm.vehicles.drivers.hazards import Hazards, speed_share
from scm.vehicles.drivers.junction_exits import has_room
from scm.vehicles.drivers.lane_graph import LIMIT, LaneArrays
from scm.vehicles.drivers.lane_tracking import (
    choose_other_branch,
    heading_change,
    list_segments,
    update_position,
)
from scm.vehicles.drivers.received_cams import ReceivedCams
from scm.vehicles.drivers.rules import LIT
from scm.vehicles.drivers.signal_table import ReceivedSignals
from scm.vehicles.drivers.speed_control import (
    STANDSTILL,
    braking,
    free_speed,
    stopping_speed,
    throttle,
)
from scm.vehicles.drivers.steering import MIN_PREVIEW, steer
from scm.vehicles.drivers.stop_lines import (
    LOOK_AHEAD,
    REACTION,
    SHORT_OF_LINE,
    STOP_MARGIN,
    next_line,
    obey_signal,
)
from scm.vehicles.jit import array_kernel, kernel_function

TIME_GAP = 0.8  # to the car ahead [s]
ARRIVED_WITHIN = 0.02  # of the end of the route [m]
INDICATE_AHEAD = 1.2  # distance before a turn at which the indicator is switched on [m]
INDICATE_FROM = 0.5  # smallest change of heading that is indicated [rad]
REROUTE_EVERY_NS = 1_500_000_000  # how often a blocked circulating car tries another branch


@array_kernel
def decide(
    lanes: LaneArrays,
    state: DriverState,
    received: ReceivedCams,
    signals: ReceivedSignals,
    scratch: Scratch,
    cars: Ints,
    poses: Floats,
    commands: Floats,
    now_ns: int,
    stop: bool,
    seed: int,
    horizon: float,
    hazards: Hazards,
) -> None:
    """Compute the commands of some cars, given by vehicle index.

    `received` must have its cells up to date. `poses` (capacity, 4) are x, y, yaw of the rear axle
    and the speed along the body; throttle and steering, -1 to 1, are written to `commands`
    (2, capacity). `stop` brings all cars to rest in their lanes. `seed` decides which radio frames
    are lost. Within `horizon` [m] of a line the speed is chosen for its next green; 0: never.
    """
    ids, begins = scratch.ids, scratch.begins
    for number in range(len(cars)):
        car = cars[number]
        ints, floats, lane_window = state.ints[car], state.floats[car], state.lane_window[car]
        kind = state.kinds[ints[KIND]]
        x, y, yaw, speed = poses[car, 0], poses[car, 1], poses[car, 2], poses[car, 3]
        update_position(lanes, state, car, x, y)
        rolling = max(0.0, speed)
        back = max(MIN_PREVIEW, 0.5 * rolling * kind[SWING])
        front = kind[FRONT]
        count, here, ends = list_segments(
            lanes.segment_first, lanes.segments, lane_window, floats[S], back, front + REACH,
            ids, begins,
        )  # fmt: skip
        found = find_cars_ahead(
            lanes.segments, received, scratch, kind, car, count, REACH, now_ns, seed
        )
        target, reason = open_road_speed(
            lanes.segments, ids, begins, scratch.ahead, kind, floats, count, here, found, ends, stop
        )
        limit = lanes.segments[ids[here], LIMIT]
        target = min(target, limit * speed_share(hazards, car, x, y, yaw, now_ns, seed))
        passed = 1e-9 * (now_ns - ints[LAST_NS]) if ints[LAST_NS] >= 0 else -1.0
        ints[LAST_NS] = now_ns
        commands[1, car] = steer(
            lanes.segments, ids, begins, kind, floats, count, here, yaw, rolling, passed
        )
        beyond = heading_change(lanes.segments, ids, begins, count, here, front + INDICATE_AHEAD)
        ints[TURN] = 0 if abs(beyond) < INDICATE_FROM else (1 if beyond > 0.0 else -1)
        target, reason = limit_for_line(
            lanes, state, received, signals, scratch, kind, car, found, speed, target, reason,
            passed, horizon, now_ns, seed,
        )  # fmt: skip
        commands[0, car] = throttle(kind, floats, target, speed, passed)
        standing = speed < STANDSTILL and commands[0, car] == 0.0
        ints[WAITING] = reason if standing else FREE
        ints[ARRIVED] = has_arrived(lanes.length, ints, lane_window, floats[S])


@kernel_function
def limit_for_line(
    lanes: LaneArrays,
    state: DriverState,
    received: ReceivedCams,
    signals: ReceivedSignals,
    scratch: Scratch,
    kind: Floats,
    car: int,
    found: int,
    speed: float,
    target: float,
    reason: int,
    passed: float,
    horizon: float,
    now_ns: int,
    seed: int,
) -> tuple[float, int]:
    """Return the target speed limited by the next line [m/s], and what the car waits for there."""
    floats, lane_window, front = state.floats[car], state.lane_window[car], kind[FRONT]
    state.ints[car, AT_SIGNALS] = FREE
    near = front + LOOK_AHEAD + 2.0 * braking(max(0.0, speed), kind[DECEL], REACTION)
    line, at, distance = next_line(
        lanes.length, lanes.line_first, lanes.line_at, lane_window, floats[S], front,
        max(near, front + horizon),
    )  # fmt: skip
    if distance < 0.0:
        return target, reason
    if horizon > 0.0 and lanes.rules.kind[line] == LIT:
        target = advised_approach(
            lanes, signals, kind, floats, lane_window, scratch.ahead, found, car, line, at,
            distance, target, passed, now_ns, seed,
        )  # fmt: skip
    if distance > near:
        return target, reason
    held = what_holds(
        lanes, state, received, signals, scratch, kind, car, found, line, at, distance, speed,
        passed, now_ns, seed,
    )  # fmt: skip
    if lanes.rules.kind[line] == LIT:
        state.ints[car, AT_SIGNALS] = held
    before_line = stopping_speed(distance - SHORT_OF_LINE - front, kind[DECEL])
    if held != FREE and before_line < target:
        return before_line, held
    return target, reason


@kernel_function
def what_holds(
    lanes: LaneArrays,
    state: DriverState,
    received: ReceivedCams,
    signals: ReceivedSignals,
    scratch: Scratch,
    kind: Floats,
    car: int,
    found: int,
    line: int,
    at: int,
    distance: float,
    speed: float,
    passed: float,
    now_ns: int,
    seed: int,
) -> int:
    """Return what a car waits for at a line, FREE if nothing; without room it may reroute.

    The line is on lane `at` of the lane window, `distance` ahead of the rear axle [m].
    """
    ints, lane_window, s = state.ints[car], state.lane_window[car], state.floats[car, S]
    brake = braking(max(0.0, speed), kind[DECEL], REACTION)
    can_stop = distance - kind[FRONT] >= brake + STOP_MARGIN
    index = ints[INDEX] + at - HERE
    held = SIGN
    is_lit = lanes.rules.kind[line] == LIT
    if is_lit:
        held = obey_signal(
            signals, lanes.line_links, ints, line, index, can_stop, car, now_ns, seed
        )
    if held == SIGN:
        held = gives_way(
            lanes, state, received, kind, car, line, at, distance, speed, can_stop, is_lit, now_ns,
            seed,
        )  # fmt: skip
    if held != VEHICLE:
        return held
    if has_room(
        lanes,
        received,
        scratch,
        kind,
        lane_window,
        found,
        car,
        line,
        at,
        distance,
        s,
        speed,
        now_ns,
        seed,
    ):
        return FREE
    ints[WAS_FREE] = 0
    if at == HERE and speed < STANDSTILL and may_reroute(now_ns, passed):
        choose_other_branch(lanes, state, car)
    return VEHICLE


@kernel_function
def open_road_speed(
    segments: Floats,
    ids: Ints,
    begins: Floats,
    ahead: Floats,
    kind: Floats,
    floats: Floats,
    count: int,
    here: int,
    found: int,
    ends: bool,
    stop: bool,
) -> tuple[float, int]:
    """Return the speed allowed by all but stop lines [m/s], and what the car waits for at rest."""
    decel, front = kind[DECEL], kind[FRONT]
    target = free_speed(segments, ids, begins, count, here, kind[LATERAL_ACCEL], decel)
    target, reason = min(target, floats[REQUESTED_SPEED]), FREE
    if ends:
        target = min(target, stopping_speed(begins[count], decel))
    if found > 0:
        gap = max(0.0, ahead[0, REAR_AT] - front - STANDSTILL_GAP)
        speed = ahead[0, SPEED_OF]
        behind = min(stopping_speed(gap + speed * speed / (2.0 * decel), decel), gap / TIME_GAP)
        if behind < target:
            target, reason = behind, VEHICLE
    if stop:
        target, reason = 0.0, ORDER
    return target, reason


@kernel_function
def may_reroute(now_ns: int, passed: float) -> bool:
    """Return whether a blocked car may try another branch now: every REROUTE_EVERY_NS."""
    before_ns = now_ns - int(1e9 * max(0.0, passed))
    return now_ns // REROUTE_EVERY_NS != before_ns // REROUTE_EVERY_NS


@kernel_function
def has_arrived(length: Floats, ints: Ints, lane_window: Ints, s: float) -> int:
    """Return 1 if a car's route is done, else 0."""
    if ints[INDEX] != ints[GOAL]:
        return 1 if ints[INDEX] > ints[GOAL] else 0
    return 1 if s >= length[lane_window[HERE]] - ARRIVED_WITHIN else 0
