"""The driver's law, compiled, for any number of cars: where it is, what is ahead, how fast to go.

Of all that limits the speed, the slowest wins: the lane and its curves, the end of the route, the
next stop line, the car ahead (time gap in flow, a fixed gap at rest), the order to stop; and where
the map asks for it, the speed that comes to a red line when it turns green.
"""

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.ahead import (
    REACH,
    REAR_AT,
    SPEED_OF,
    STANDSTILL_GAP,
    Scratch,
    cars_ahead,
)
from scm.vehicles.drivers.exits import has_room
from scm.vehicles.drivers.giving_way import gives_way
from scm.vehicles.drivers.green_light import advice
from scm.vehicles.drivers.lane_tracking import choose_again, locate, survey, turned
from scm.vehicles.drivers.memory import (
    ARRIVED,
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
    SIGN,
    SWING,
    TOLD,
    TURN,
    VEHICLE,
    WAITING,
    WAS_FREE,
    Memory,
    S,
)
from scm.vehicles.drivers.pace import STANDSTILL, braking, free_speed, stopping_speed, throttle
from scm.vehicles.drivers.rules import LIT
from scm.vehicles.drivers.signal_table import Told
from scm.vehicles.drivers.stations import Heard
from scm.vehicles.drivers.steering import LEAST_HALF, steer
from scm.vehicles.drivers.stop_lines import (
    LOOK_AHEAD,
    NEAREST,
    REACTION,
    SHORT_OF_LINE,
    next_line,
    signal_says,
)
from scm.vehicles.drivers.streets import LIMIT, Ways
from scm.vehicles.drivers.warned import Warned, cautious
from scm.vehicles.jit import array_kernel, law

TIME_GAP = 0.8
ARRIVED_WITHIN = 0.02
INDICATE_AHEAD = 1.2
PATIENCE_NS = 1_500_000_000
INDICATE_FROM = 0.5


@array_kernel
def decide(
    ways: Ways,
    memory: Memory,
    heard: Heard,
    told: Told,
    room: Scratch,
    cars: Ints,
    poses: Floats,
    commands: Floats,
    now_ns: int,
    stop: bool,
    seed: int,
    horizon: float,
    warned: Warned,
) -> None:
    """Let the drivers of some cars, given by number, decide.

    `heard` must have its cells up to date. `poses` (capacity, 4) are x, y, yaw of the rear axle and
    the speed along the body; `commands` (2, capacity) takes throttle and steering, -1 to 1. `stop`
    brings all to rest in their lanes; `seed` decides which radio frames get lost. From `horizon`
    before a line on [m] speed is chosen for its next green; 0: it is not. `warned` are dangers.
    """
    ids, begins = room.ids, room.begins
    for number in range(len(cars)):
        car = cars[number]
        ints, floats, sight = memory.ints[car], memory.floats[car], memory.sight[car]
        kind = memory.kinds[ints[KIND]]
        x, y, yaw, speed = poses[car, 0], poses[car, 1], poses[car, 2], poses[car, 3]
        locate(ways, memory, car, x, y)
        rolling = max(0.0, speed)
        back = max(LEAST_HALF, 0.5 * rolling * kind[SWING])
        front = kind[FRONT]
        count, here, ends = survey(
            ways.segment_first, ways.segments, sight, floats[S], back, front + REACH, ids, begins
        )
        found = cars_ahead(ways.segments, heard, room, kind, car, count, REACH, now_ns, seed)
        wished, reason = wish(
            ways.segments, ids, begins, room.ahead, kind, floats, count, here, found, ends, stop
        )
        limit = ways.segments[ids[here], LIMIT]
        wished = min(wished, limit * cautious(warned, car, x, y, yaw, now_ns, seed))
        passed = 1e-9 * (now_ns - ints[LAST_NS]) if ints[LAST_NS] >= 0 else -1.0
        ints[LAST_NS] = now_ns
        commands[1, car] = steer(
            ways.segments, ids, begins, kind, floats, count, here, yaw, rolling, passed
        )
        beyond = turned(ways.segments, ids, begins, count, here, front + INDICATE_AHEAD)
        ints[TURN] = 0 if abs(beyond) < INDICATE_FROM else (1 if beyond > 0.0 else -1)
        wished, reason = until_line(
            ways, memory, heard, told, room, kind, car, found, speed, wished, reason, passed,
            horizon, now_ns, seed,
        )  # fmt: skip
        commands[0, car] = throttle(kind, floats, wished, speed, passed)
        standing = speed < STANDSTILL and commands[0, car] == 0.0
        ints[WAITING] = reason if standing else FREE
        ints[ARRIVED] = has_arrived(ways.length, ints, sight, floats[S])


@law
def until_line(
    ways: Ways,
    memory: Memory,
    heard: Heard,
    told: Told,
    room: Scratch,
    kind: Floats,
    car: int,
    found: int,
    speed: float,
    wished: float,
    reason: int,
    passed: float,
    horizon: float,
    now_ns: int,
    seed: int,
) -> tuple[float, int]:
    """Return what the next line leaves of a wished speed [m/s], and what would hold the car."""
    floats, sight, front = memory.floats[car], memory.sight[car], kind[FRONT]
    near = front + LOOK_AHEAD + 2.0 * braking(max(0.0, speed), kind[DECEL], REACTION)
    line, at, distance = next_line(
        ways.length, ways.line_first, ways.line_at, sight, floats[S], front,
        max(near, front + horizon),
    )  # fmt: skip
    if distance < 0.0:
        return wished, reason
    if horizon > 0.0 and ways.rules.kind[line] == LIT:
        wished = advice(
            ways, told, kind, floats, sight, room.ahead, found, car, line, at, distance, wished,
            passed, now_ns, seed,
        )  # fmt: skip
    if distance > near:
        return wished, reason
    held = hold(
        ways, memory, heard, told, room, kind, car, found, line, at, distance, speed, passed,
        now_ns, seed,
    )  # fmt: skip
    before_line = stopping_speed(distance - SHORT_OF_LINE - front, kind[DECEL])
    if held != FREE and before_line < wished:
        return before_line, held
    return wished, reason


@law
def hold(
    ways: Ways,
    memory: Memory,
    heard: Heard,
    told: Told,
    room: Scratch,
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
    """Return what holds a car at a line, FREE if nothing does; a car without room looks elsewhere.

    The line lies on lane `at` in sight, `distance` ahead of the rear axle [m].
    """
    ints, sight, s = memory.ints[car], memory.sight[car], memory.floats[car, S]
    brake = braking(max(0.0, speed), kind[DECEL], REACTION)
    can_stop = distance - kind[FRONT] >= brake + NEAREST
    index = ints[INDEX] + at - HERE
    held = SIGN
    is_lit = ways.rules.kind[line] == LIT
    if is_lit:
        held = signal_says(told, ways.line_links, ints, line, index, can_stop, car, now_ns, seed)
    if held == SIGN:
        held = gives_way(
            ways, memory, heard, kind, car, line, at, distance, speed, can_stop, is_lit, now_ns,
            seed,
        )  # fmt: skip
    if held != VEHICLE:
        return held
    if has_room(
        ways, heard, room, kind, sight, found, car, line, at, distance, s, speed, now_ns, seed
    ):
        return FREE
    ints[WAS_FREE] = 0
    if at == HERE and speed < STANDSTILL and is_turn(now_ns, passed):
        choose_again(ways, memory, car)
    return VEHICLE


@law
def wish(
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
    """Return the speed that all but stop lines allow [m/s], and what would hold the car there."""
    decel, front = kind[DECEL], kind[FRONT]
    wished = free_speed(segments, ids, begins, count, here, kind[LATERAL_ACCEL], decel)
    wished, reason = min(wished, floats[TOLD]), FREE
    if ends:
        wished = min(wished, stopping_speed(begins[count], decel))
    if found > 0:
        gap = max(0.0, ahead[0, REAR_AT] - front - STANDSTILL_GAP)
        speed = ahead[0, SPEED_OF]
        behind = min(stopping_speed(gap + speed * speed / (2.0 * decel), decel), gap / TIME_GAP)
        if behind < wished:
            wished, reason = behind, VEHICLE
    if stop:
        wished, reason = 0.0, ORDER
    return wished, reason


@law
def is_turn(now_ns: int, passed: float) -> bool:
    """Return whether a car that finds no room may try another way: once in a while."""
    before_ns = now_ns - int(1e9 * max(0.0, passed))
    return now_ns // PATIENCE_NS != before_ns // PATIENCE_NS


@law
def has_arrived(length: Floats, ints: Ints, sight: Ints, s: float) -> int:
    """Return 1 when a car's route is done, else 0."""
    if ints[INDEX] != ints[GOAL]:
        return 1 if ints[INDEX] > ints[GOAL] else 0
    return 1 if s >= length[sight[HERE]] - ARRIVED_WITHIN else 0
