"""The driver's law, compiled, for any number of cars: where it is, what is ahead, how fast to go.

Of all that limits the speed, the slowest wins: the lane and its curves, the end of the route, the
next stop line, the car ahead (time gap in flow, a fixed gap at rest), the order to stop.
"""

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.ahead import REACH, REAR_AT, SPEED_OF, Scratch, cars_ahead
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
    SWING,
    TOLD,
    TURN,
    VEHICLE,
    WAITING,
    Memory,
    S,
)
from scm.vehicles.drivers.pace import STANDSTILL, free_speed, stopping_speed, throttle
from scm.vehicles.drivers.signal_table import Told
from scm.vehicles.drivers.stations import Heard
from scm.vehicles.drivers.steering import LEAST_HALF, steer
from scm.vehicles.drivers.stop_lines import STANDSTILL_GAP, hold
from scm.vehicles.drivers.streets import Ways
from scm.vehicles.drivers.way import locate, survey, turned
from scm.vehicles.jit import array_kernel, law

TIME_GAP = 0.8
ARRIVED_WITHIN = 0.02
INDICATE_AHEAD = 1.2
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
    loss: float,
    seed: int,
) -> None:
    """Let drivers decide.

    Args:
        ways: The lanes.
        memory: Of all drivers.
        heard: The cars around; their cells must be up to date.
        told: The signals.
        room: To work in.
        cars: Who decides, by number.
        poses: (capacity, 4) x, y, yaw of the rear axle and speed along the body.
        commands: (2, capacity) takes throttle and steering, -1 to 1.
        now_ns: The present time [ns].
        stop: Whether all must come to rest in their lanes, wherever they are.
        loss: Share of radio frames that get lost.
        seed: Of the luck.
    """
    for number in range(len(cars)):
        car = cars[number]
        ints, floats, sight = memory.ints[car], memory.floats[car], memory.sight[car]
        kind = memory.kinds[ints[KIND]]
        x, y, yaw, speed = poses[car, 0], poses[car, 1], poses[car, 2], poses[car, 3]
        locate(ways, memory, car, x, y)
        rolling = max(0.0, speed)
        back = max(LEAST_HALF, 0.5 * rolling * kind[SWING])
        reach = kind[FRONT] + REACH
        count, here, ends = survey(ways, sight, floats[S], back, reach, room.ids, room.begins)
        found = cars_ahead(ways, heard, room, kind, car, count, now_ns, loss, seed)
        wished, reason = wish(ways, room, kind, floats, count, here, found, ends, stop)
        held, far = hold(
            ways, told, kind, ints, sight, room.ahead, found, car, floats[S], speed, now_ns, loss,
            seed,
        )  # fmt: skip
        if held != FREE:
            before_line = stopping_speed(far, kind[DECEL])
            if before_line < wished:
                wished, reason = before_line, held
        passed = 1e-9 * (now_ns - ints[LAST_NS]) if ints[LAST_NS] >= 0 else -1.0
        ints[LAST_NS] = now_ns
        commands[0, car] = throttle(kind, floats, wished, speed, passed)
        commands[1, car] = steer(ways, room, kind, floats, count, here, yaw, rolling, passed)
        standing = speed < STANDSTILL and commands[0, car] == 0.0
        ints[WAITING] = reason if standing else FREE
        beyond = turned(ways, room.ids, room.begins, count, here, kind[FRONT] + INDICATE_AHEAD)
        ints[TURN] = 0 if abs(beyond) < INDICATE_FROM else (1 if beyond > 0.0 else -1)
        ints[ARRIVED] = has_arrived(ways, ints, sight, floats[S])


@law
def wish(
    ways: Ways,
    room: Scratch,
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
    wished = free_speed(ways, room.ids, room.begins, count, here, kind[LATERAL_ACCEL], decel)
    wished, reason = min(wished, floats[TOLD]), FREE
    if ends:
        wished = min(wished, stopping_speed(room.begins[count], decel))
    if found > 0:
        gap = max(0.0, room.ahead[0, REAR_AT] - front - STANDSTILL_GAP)
        speed = room.ahead[0, SPEED_OF]
        behind = min(stopping_speed(gap + speed * speed / (2.0 * decel), decel), gap / TIME_GAP)
        if behind < wished:
            wished, reason = behind, VEHICLE
    if stop:
        wished, reason = 0.0, ORDER
    return wished, reason


@law
def has_arrived(ways: Ways, ints: Ints, sight: Ints, s: float) -> int:
    """Return 1 when a car's route is done, else 0."""
    if ints[INDEX] != ints[GOAL]:
        return 1 if ints[INDEX] > ints[GOAL] else 0
    return 1 if s >= ways.length[sight[HERE]] - ARRIVED_WITHIN else 0
