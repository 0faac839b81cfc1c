"""Stop or go at a line without signals: by signs, right before left, or at an all-way stop.

A car goes when its path over the junction is free: no car is or will be on it before the car is
through, and every car with right of way arrives later than it leaves, with a margin. At an all-way
stop the first to stop goes first. If all others stand and wait, a car goes after a while, in the
order of the junction's lines. A car that has waited long gets its turn while the others stay behind
their lines (`waiting_order.py`), so nobody waits for ever.
A car is assumed to cross if it is too fast to stop at its line.

    t(d) = (sqrt(v^2 + 2 a d) - v) / a, then at the highest speed      time for a distance d
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.cars_ahead import is_outside
from scm.vehicles.drivers.driver_state import (
    ACCEL,
    DECEL,
    FREE,
    FRONT,
    GOING_INDEX,
    GOING_LINE,
    HERE,
    INDEX,
    LAST_BLOCKED_NS,
    LAST_BUSY_NS,
    NEVER_NS,
    REAR,
    REQUESTED_SPEED,
    REST_NS,
    RULE_INDEX,
    RULE_LINE,
    SIGN,
    SPEEDS,
    STEPS,
    VEHICLE,
    WAS_FREE,
    WINDOW_SIZE,
    DriverState,
)
from scm.vehicles.drivers.lane_graph import COS, LENGTH, SIN, LaneArrays
from scm.vehicles.drivers.lane_tracking import project
from scm.vehicles.drivers.received_cams import (
    CELLS_X,
    CELLS_Y,
    LOW_X,
    LOW_Y,
    ReceivedCams,
    cell_number,
    estimate_for,
)
from scm.vehicles.drivers.reception import reception_is_good
from scm.vehicles.drivers.rules import STOP_SIGN, Rules
from scm.vehicles.drivers.speed_control import STANDSTILL, braking, stopping_speed
from scm.vehicles.drivers.stop_lines import REACTION, SHORT_OF_LINE
from scm.vehicles.drivers.waiting_order import (
    STANDSTILL_SPEED,
    announced_since,
    has_turn,
    is_earlier,
)
from scm.vehicles.jit import kernel_function

AT_LINE = 0.12  # a front bumper closer to its line than this waits at it [m]
MAX_OFFSET = 0.11  # from a path's centre line for a car to be on it [m]
MIN_ALIGNMENT = 0.8  # cosine of the angle between a car and a path for it to be on it
SPEED_TOLERANCE = 0.03  # above the speed of a car that stops at its line [m/s]
ACCEL_SHARE = 0.6  # of the comfortable acceleration that the own car is sure to reach
TIME_MARGIN_S = 0.7  # between leaving a conflict zone and the next car's arrival
TIME_BEHIND_S = 0.4  # between another car's leaving and the own arrival
MIN_STOP_NS = 700_000_000  # at a stop sign
PATIENCE_NS = 1_500_000_000  # before a car goes while all others wait
SHORT_PATIENCE_NS = 500_000_000  # the same after a long wait
STAGGER_NS = 250_000_000  # between the lines of a junction, so that two do not start together
LONG_WAIT_NS = 12_000_000_000
NOTICE_S = 1.0  # how long before they must brake cars with right of way see that the car goes
NOBODY, SOMEBODY, INSIDE, WAITS, EARLIER, THEIR_TURN = 0, 1, 2, 4, 8, 16
NOWHERE = -1e9
LEFT, LOW, RIGHT, HIGH = range(4)


@kernel_function
def gives_way(
    lanes: LaneArrays,
    state: DriverState,
    received: ReceivedCams,
    kind: Floats,
    car: int,
    line: int,
    at: int,
    distance: float,
    speed: float,
    can_stop: bool,
    is_flashing: bool,
    now_ns: int,
    seed: int,
) -> int:
    """Return what a car waits for at a line: SIGN, FREE, or VEHICLE unless there is room behind it.

    The line is on lane `at` of the window, `distance` ahead of the rear axle [m]. Flashing signals
    turn all of a junction's lines into stop signs.
    """
    ints, rules = state.ints[car], lanes.rules
    index = ints[INDEX] + at - HERE
    if ints[GOING_LINE] == line and ints[GOING_INDEX] == index:
        return FREE
    if ints[RULE_LINE] != line or ints[RULE_INDEX] != index:
        ints[RULE_LINE], ints[RULE_INDEX] = line, index
        ints[REST_NS] = ints[LAST_BLOCKED_NS] = ints[LAST_BUSY_NS] = NEVER_NS
        ints[WAS_FREE] = 0
    elif ints[WAS_FREE] and not can_stop:
        ints[GOING_LINE], ints[GOING_INDEX] = line, index
        return FREE
    before = distance - kind[FRONT]
    all_stop = is_flashing or rules.all_stop[line]
    if ints[REST_NS] < 0 and speed < STANDSTILL and before < AT_LINE:
        ints[REST_NS] = now_ns
    since = announced_since(state.stood, received, car, ints[REST_NS], now_ns)
    is_turn = has_turn(since, rules.order[line], now_ns)
    way = way_over_junction(rules, state.lane_window[car], line, at)
    v_most = fastest(rules, kind, state.floats[car, REQUESTED_SPEED], line)
    is_long = ints[REST_NS] >= 0 and now_ns - ints[REST_NS] >= LONG_WAIT_NS
    notice = 0.0 if all_stop else (NOTICE_S if is_long else math.inf)
    around = classify_all(
        rules, lanes.segments, received, state.stood, kind, car, line, way, before, max(0.0, speed),
        v_most, notice, since, now_ns, seed,
    )  # fmt: skip
    must_rest = all_stop or rules.kind[line] == STOP_SIGN
    held = waits(ints, rules.order[line], around, is_turn, all_stop, must_rest, now_ns)
    if not held and gives_way_to_any(rules, way, all_stop):
        held = not reception_is_good(received, rules.window[line], car, now_ns, seed)
    ints[WAS_FREE] = 0 if held else 1
    return SIGN if held else VEHICLE


@kernel_function
def gives_way_to_any(rules: Rules, way: int, all_stop: bool) -> bool:
    """Return whether a path has to give way to any other."""
    if all_stop:
        return True
    for pair in range(rules.pair_first[way], rules.pair_first[way + 1] if way >= 0 else 0):
        if rules.pair_yields[pair]:
            return True
    return False


@kernel_function
def waits(
    ints: Ints,
    order: int,
    around: int,
    is_turn: bool,
    all_stop: bool,
    must_rest: bool,
    now_ns: int,
) -> bool:
    """Return whether a car waits at its line, by the cars around.

    Args:
        ints: Its integer state.
        order: The line's place in its junction.
        around: Flags. SOMEBODY: a moving car is in the way. INSIDE: one is in the junction, but
            not in the way. WAITS: one with right of way (all-way stop: with a crossing path) waits
            at its line. EARLIER: one of these stopped earlier. THEIR_TURN: it is its turn.
        is_turn: Whether it is the own turn.
        all_stop: Whether all must stop.
        must_rest: Whether the own car must stop.
        now_ns: The present time [ns].
    """
    if around & (SOMEBODY | INSIDE):
        ints[LAST_BUSY_NS] = now_ns
    if around & SOMEBODY:
        ints[LAST_BLOCKED_NS] = now_ns
    if around & (SOMEBODY | THEIR_TURN):
        return True
    rest_ns = ints[REST_NS]
    if rest_ns < 0:
        return must_rest or around & WAITS != 0
    if must_rest and now_ns - rest_ns < MIN_STOP_NS:
        return True
    if is_turn or around & WAITS == 0:
        return False
    later_ns = order * STAGGER_NS
    if all_stop and around & EARLIER == 0:
        return bool(now_ns - max(rest_ns + MIN_STOP_NS, ints[LAST_BLOCKED_NS]) < later_ns)
    is_long = now_ns - rest_ns >= LONG_WAIT_NS
    since_ns = ints[LAST_BLOCKED_NS] if is_long else max(rest_ns, ints[LAST_BUSY_NS])
    patience_ns = SHORT_PATIENCE_NS if is_long else PATIENCE_NS
    return bool(now_ns - since_ns < patience_ns + later_ns)


@kernel_function
def way_over_junction(rules: Rules, lane_window: Ints, line: int, at: int) -> int:
    """Return the path over the junction that a car follows from a line, or -1."""
    for way in range(rules.way_first[line], rules.way_first[line + 1]):
        there = at + rules.way_depth[way]
        if there < WINDOW_SIZE and lane_window[there] == rules.way_lane[way]:
            return way
    return -1


@kernel_function
def fastest(rules: Rules, kind: Floats, signals: float, line: int) -> float:
    """Return the speed that a car is sure to reach across a junction [m/s]."""
    cruise = min(rules.limit[line], signals)
    steps = int(kind[STEPS])
    if steps:
        cruise = min(cruise, kind[SPEEDS + steps - 1])
    return float(0.9 * cruise)


@kernel_function
def time_for(distance: float, speed: float, v_most: float, accel: float) -> float:
    """Return the time for a distance at full acceleration up to a speed [s]."""
    if distance <= 0.0:
        return 0.0
    v_most = max(v_most, 0.01)
    if speed >= v_most:
        return distance / v_most
    run_up = (v_most * v_most - speed * speed) / (2.0 * accel)
    if distance <= run_up:
        return (math.sqrt(speed * speed + 2.0 * accel * distance) - speed) / accel
    return (v_most - speed) / accel + (distance - run_up) / v_most


@kernel_function
def classify_all(
    rules: Rules,
    segments: Floats,
    received: ReceivedCams,
    stood: Ints,
    kind: Floats,
    car: int,
    line: int,
    way: int,
    before: float,
    speed: float,
    v_most: float,
    notice: float,
    since: int,
    now_ns: int,
    seed: int,
) -> int:
    """Return the flags of all other cars together, see `waits`.

    `notice` is how long before they must brake the cars with right of way see that this car goes
    [s]; infinite: they never have to brake; 0: all must stop anyway. `since` is when the car
    stopped at its line, `stood` when each other one stopped.
    """
    if way < 0:
        return NOBODY
    floor, window, around = received.floor, rules.window[line], NOBODY
    across = int(floor[CELLS_X])
    left = cell_number(floor, window[LEFT], LOW_X, CELLS_X)
    right = cell_number(floor, window[RIGHT], LOW_X, CELLS_X)
    low = cell_number(floor, window[LOW], LOW_Y, CELLS_Y)
    high = cell_number(floor, window[HIGH], LOW_Y, CELLS_Y)
    for row in range(low, high + 1):
        first = received.cell_first[row * across + left]
        last = received.cell_first[row * across + right + 1]
        for at in range(first, last):
            other = received.in_cell[at]
            if other == car or is_outside(window, received.at[other]):
                continue
            known, x, y, cos, sin, v = estimate_for(received, other, car, now_ns, seed)
            if not known:
                continue
            found = classify_car(
                rules, segments, kind, line, way, before, speed, v_most, notice, since,
                stood[other], now_ns, x, y, cos, sin, max(0.0, v), 0.5 * received.size[other, 0],
            )  # fmt: skip
            if found == SOMEBODY:
                return SOMEBODY
            around |= found
    return around


@kernel_function
def classify_car(
    rules: Rules,
    segments: Floats,
    kind: Floats,
    line: int,
    way: int,
    before: float,
    speed: float,
    v_most: float,
    notice: float,
    since: int,
    stood: int,
    now_ns: int,
    x: float,
    y: float,
    cos: float,
    sin: float,
    v: float,
    half: float,
) -> int:
    """Return the flags of one other car, see `waits`.

    `since` is when the own car stopped at its line, `stood` when the other one stopped.
    """
    for at in range(rules.peer_first[line], rules.peer_first[line + 1]):
        peer = rules.peers[at]
        middle = along(
            segments, rules.feeds, rules.feed_begin, rules.feed_first[peer],
            rules.feed_first[peer + 1], x, y, cos, sin,
        )  # fmt: skip
        if middle != NOWHERE:
            return classify_approaching(
                rules, kind, line, way, peer, before, speed, v_most, notice, since, stood, now_ns,
                middle, v, half,
            )  # fmt: skip
    found = NOBODY
    for at in range(rules.peer_first[line], rules.peer_first[line + 1]):
        peer = rules.peers[at]
        for other in range(rules.way_first[peer], rules.way_first[peer + 1]):
            middle = along(
                segments, rules.paths, rules.path_begin, rules.path_first[other],
                rules.path_first[other + 1], x, y, cos, sin,
            )  # fmt: skip
            if middle == NOWHERE:
                continue
            if v >= STANDSTILL_SPEED:  # a car that stands behind the junction is part of a queue
                found = INSIDE
            if is_in_way(
                rules, kind, way, other, before, speed, v_most, middle, v, half, True,
                rules.limit[peer],
            ):  # fmt: skip
                return SOMEBODY
    return found


@kernel_function
def classify_approaching(
    rules: Rules,
    kind: Floats,
    line: int,
    way: int,
    peer: int,
    before: float,
    speed: float,
    v_most: float,
    notice: float,
    since: int,
    stood: int,
    now_ns: int,
    middle: float,
    v: float,
    half: float,
) -> int:
    """Return the flags of a car whose centre has not passed its own line."""
    away = -middle - half
    decel = kind[DECEL]
    is_going = away < 0.0 or v > stopping_speed(away - SHORT_OF_LINE, decel) + SPEED_TOLERANCE
    if not is_going and (v < STANDSTILL_SPEED or away <= AT_LINE):
        if away > AT_LINE:
            return NOBODY
        stood = stood if v < STANDSTILL_SPEED else NEVER_NS
        return classify_waiting(rules, line, way, peer, notice == 0.0, since, stood, now_ns)
    can_let_pass = away > v * notice + braking(v, decel, REACTION) + SHORT_OF_LINE
    if not is_going and (notice == 0.0 or can_let_pass):
        return NOBODY
    for other in range(rules.way_first[peer], rules.way_first[peer + 1]):
        if is_in_way(
            rules, kind, way, other, before, speed, v_most, middle, v, half, is_going,
            rules.limit[peer],
        ):  # fmt: skip
            return SOMEBODY
    return INSIDE if v >= STANDSTILL_SPEED else NOBODY


@kernel_function
def classify_waiting(
    rules: Rules,
    line: int,
    way: int,
    peer: int,
    all_stop: bool,
    since: int,
    stood: int,
    now_ns: int,
) -> int:
    """Return the flags of a car that waits at its own line."""
    order, theirs = rules.order[line], rules.order[peer]
    is_first = is_earlier(stood, theirs, since, order)
    found = NOBODY
    if has_conflict(rules, way, peer, all_stop):
        found = WAITS | EARLIER if is_first else WAITS
    if has_turn(stood, theirs, now_ns) and has_conflict(rules, way, peer, True):
        found |= THEIR_TURN if is_first or not has_turn(since, order, now_ns) else NOBODY
    return found


@kernel_function
def along(
    segments: Floats,
    ids: Ints,
    begins: Floats,
    first: int,
    last: int,
    x: float,
    y: float,
    cos: float,
    sin: float,
) -> float:
    """Return a car's distance along a list of segments, or NOWHERE if it does not follow them."""
    for at in range(first, last):
        row = segments[ids[at]]
        s, beside, turn_cos, turn_sin = project(row, x, y, 0.5 * row[LENGTH])
        if s < 0.0 or s > row[LENGTH] or abs(beside) > MAX_OFFSET:
            continue
        way_cos = row[COS] * turn_cos - row[SIN] * turn_sin
        way_sin = row[SIN] * turn_cos + row[COS] * turn_sin
        if way_cos * cos + way_sin * sin >= MIN_ALIGNMENT:
            return float(begins[at] + s)
    return NOWHERE


@kernel_function
def has_conflict(rules: Rules, way: int, peer: int, all_stop: bool) -> bool:
    """Return whether a path gives way to a car at another line; all-way stop: crosses its path."""
    for pair in range(rules.pair_first[way], rules.pair_first[way + 1]):
        other = rules.pair_way[pair]
        is_of_peer = rules.way_first[peer] <= other < rules.way_first[peer + 1]
        if is_of_peer and (all_stop or rules.pair_yields[pair]):
            return True
    return False


@kernel_function
def is_in_way(
    rules: Rules,
    kind: Floats,
    way: int,
    other: int,
    before: float,
    speed: float,
    v_most: float,
    middle: float,
    v: float,
    half: float,
    is_going: bool,
    limit: float,
) -> bool:
    """Return whether a moving car is or will be in the conflict zone of both paths.

    Args:
        rules: See `Rules`.
        kind: The row of the own kind of car.
        way: The own path; `other` that of the other car.
        other: See `way`.
        before: From the own front to the line [m].
        speed: Own speed; `v_most` is the speed it will reach [m/s].
        v_most: See `speed`.
        middle: Place of the other car on its path [m]; `half` is half its length.
        v: Speed of the other car [m/s].
        half: See `middle`.
        is_going: Whether the other car crosses regardless of right of way.
        limit: Speed limit of the other car [m/s].
    """
    for pair in range(rules.pair_first[way], rules.pair_first[way + 1]):
        if rules.pair_way[pair] != other:
            continue
        if not is_going and not rules.pair_yields[pair]:
            return False
        zone = rules.zones[pair]
        tail, nose = middle - half, middle + half
        if tail > zone[3]:
            return False
        accel = ACCEL_SHARE * kind[ACCEL]
        if v > STANDSTILL_SPEED:
            left = (zone[3] - tail) / v + TIME_BEHIND_S
            if left < time_for(before + zone[0], speed, limit, 2.0 * kind[ACCEL]):
                return False
        through = time_for(before + zone[1] + kind[FRONT] + kind[REAR], speed, v_most, accel)
        if nose >= zone[2]:
            return True
        return bool((zone[2] - nose) / max(v, limit) < through + TIME_MARGIN_S)
    return False
