"""Stop or go at a line without lights: stop signs, give-way signs, right before left, first come.

A car goes when its way over the junction is free: nobody in the junction is in it or will come
into it before it is through, and whoever has the right of way arrives later than it leaves, with a
margin. Where all must stop, those go first who stood there first. Who sees only others that stand
and wait goes after a while, the lines of a junction in their order; who has stood long has its
turn, and the others stay behind their lines (see `order.py`): so nobody waits for ever.
Who crosses is told from who stops by speed: faster than a car that will stop at its line.

    t(d) = (sqrt(v^2 + 2 a d) - v) / a, then at the highest speed      time for a distance d
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.ahead import is_outside
from scm.vehicles.drivers.lane_tracking import foot
from scm.vehicles.drivers.memory import (
    ACCEL,
    BUSY_NS,
    DECEL,
    FREE,
    FRONT,
    GOING_INDEX,
    GOING_LINE,
    HERE,
    IN_SIGHT,
    INDEX,
    KEPT_NS,
    NEVER_NS,
    REAR,
    REST_NS,
    RULE_INDEX,
    RULE_LINE,
    SIGN,
    SPEEDS,
    STEPS,
    TOLD,
    VEHICLE,
    WAS_FREE,
    Memory,
)
from scm.vehicles.drivers.order import STANDS, has_turn, is_earlier, since_told
from scm.vehicles.drivers.pace import STANDSTILL, braking, stopping_speed
from scm.vehicles.drivers.rules import STOP_SIGN, Rules
from scm.vehicles.drivers.silence import hears_well
from scm.vehicles.drivers.stations import (
    CELLS_X,
    CELLS_Y,
    LOW_X,
    LOW_Y,
    Heard,
    cell_number,
    known_to,
)
from scm.vehicles.drivers.stop_lines import REACTION, SHORT_OF_LINE
from scm.vehicles.drivers.streets import COS, LENGTH, SIN, Ways
from scm.vehicles.jit import law

AT_LINE = 0.12
BESIDE = 0.11
SAME_WAY = 0.8
HASTE = 0.03
HURRY = 0.6
GAP = 0.7
BEHIND = 0.4
REST_FOR_NS = 700_000_000
PATIENCE_NS = 1_500_000_000
LONG_PATIENCE_NS = 500_000_000
STAGGER_NS = 250_000_000
LONG_NS = 12_000_000_000
NOTICE_S = 1.0
NOBODY, SOMEBODY, INSIDE, WAITS, EARLIER, THEIR_TURN = 0, 1, 2, 4, 8, 16
NOWHERE = -1e9
LEFT, LOW, RIGHT, HIGH = range(4)


@law
def gives_way(
    ways: Ways,
    memory: Memory,
    heard: Heard,
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
    """Return what holds a car at a line: SIGN; FREE; or VEHICLE, unless there is room behind it.

    The line lies on lane `at` in sight, `distance` ahead of the rear axle [m]. Flashing signals
    make all of a junction's lines stop signs.
    """
    ints, rules = memory.ints[car], ways.rules
    index = ints[INDEX] + at - HERE
    if ints[GOING_LINE] == line and ints[GOING_INDEX] == index:
        return FREE
    if ints[RULE_LINE] != line or ints[RULE_INDEX] != index:
        ints[RULE_LINE], ints[RULE_INDEX] = line, index
        ints[REST_NS] = ints[KEPT_NS] = ints[BUSY_NS] = NEVER_NS
        ints[WAS_FREE] = 0
    elif ints[WAS_FREE] and not can_stop:
        ints[GOING_LINE], ints[GOING_INDEX] = line, index
        return FREE
    before = distance - kind[FRONT]
    all_stop = is_flashing or rules.all_stop[line]
    if ints[REST_NS] < 0 and speed < STANDSTILL and before < AT_LINE:
        ints[REST_NS] = now_ns
    since = since_told(memory.stood, heard, car, ints[REST_NS], now_ns)
    is_turn = has_turn(since, rules.order[line], now_ns)
    way = way_taken(rules, memory.sight[car], line, at)
    v_most = fastest(rules, kind, memory.floats[car, TOLD], line)
    is_long = ints[REST_NS] >= 0 and now_ns - ints[REST_NS] >= LONG_NS
    notice = 0.0 if all_stop else (NOTICE_S if is_long else math.inf)
    around = look_around(
        rules, ways.segments, heard, memory.stood, kind, car, line, way, before, max(0.0, speed),
        v_most, notice, since, now_ns, seed,
    )  # fmt: skip
    must_rest = all_stop or rules.kind[line] == STOP_SIGN
    held = waits(ints, rules.order[line], around, is_turn, all_stop, must_rest, now_ns)
    if not held and gives_way_to_any(rules, way, all_stop):
        held = not hears_well(heard, rules.window[line], car, now_ns, seed)
    ints[WAS_FREE] = 0 if held else 1
    return SIGN if held else VEHICLE


@law
def gives_way_to_any(rules: Rules, way: int, all_stop: bool) -> bool:
    """Return whether there is anybody to whom a car on a way could have to give way."""
    if all_stop:
        return True
    for pair in range(rules.pair_first[way], rules.pair_first[way + 1] if way >= 0 else 0):
        if rules.pair_yields[pair]:
            return True
    return False


@law
def waits(
    ints: Ints,
    order: int,
    around: int,
    is_turn: bool,
    all_stop: bool,
    must_rest: bool,
    now_ns: int,
) -> bool:
    """Return whether a car waits at its line, by who is around.

    Args:
        ints: Its memory.
        order: The line's place in its junction.
        around: Whether SOMEBODY in motion is in the way, or only INSIDE; whether one WAITS at its
            line that has the right of way, where all must stop: whose way crosses; whether one of
            these stood there EARLIER; whether it is THEIR_TURN.
        is_turn: Whether it is its own turn.
        all_stop: Whether all must stop.
        must_rest: Whether it must.
        now_ns: The present time [ns].
    """
    if around & (SOMEBODY | INSIDE):
        ints[BUSY_NS] = now_ns
    if around & SOMEBODY:
        ints[KEPT_NS] = now_ns
    if around & (SOMEBODY | THEIR_TURN):
        return True
    rest_ns = ints[REST_NS]
    if rest_ns < 0:
        return must_rest or around & WAITS != 0
    if must_rest and now_ns - rest_ns < REST_FOR_NS:
        return True
    if is_turn or around & WAITS == 0:
        return False
    later_ns = order * STAGGER_NS
    if all_stop and around & EARLIER == 0:
        return bool(now_ns - max(rest_ns + REST_FOR_NS, ints[KEPT_NS]) < later_ns)
    is_long = now_ns - rest_ns >= LONG_NS
    since_ns = ints[KEPT_NS] if is_long else max(rest_ns, ints[BUSY_NS])
    patience_ns = LONG_PATIENCE_NS if is_long else PATIENCE_NS
    return bool(now_ns - since_ns < patience_ns + later_ns)


@law
def way_taken(rules: Rules, sight: Ints, line: int, at: int) -> int:
    """Return the way over the junction that a car takes from a line; -1: none of them."""
    for way in range(rules.way_first[line], rules.way_first[line + 1]):
        there = at + rules.way_depth[way]
        if there < IN_SIGHT and sight[there] == rules.way_lane[way]:
            return way
    return -1


@law
def fastest(rules: Rules, kind: Floats, told: float, line: int) -> float:
    """Return how fast a car will surely cross a junction [m/s]."""
    cruise = min(rules.limit[line], told)
    steps = int(kind[STEPS])
    if steps:
        cruise = min(cruise, kind[SPEEDS + steps - 1])
    return float(0.9 * cruise)


@law
def time_for(distance: float, speed: float, v_most: float, accel: float) -> float:
    """Return how long a car takes that goes as fast as it may [s]."""
    if distance <= 0.0:
        return 0.0
    v_most = max(v_most, 0.01)
    if speed >= v_most:
        return distance / v_most
    run_up = (v_most * v_most - speed * speed) / (2.0 * accel)
    if distance <= run_up:
        return (math.sqrt(speed * speed + 2.0 * accel * distance) - speed) / accel
    return (v_most - speed) / accel + (distance - run_up) / v_most


@law
def look_around(
    rules: Rules,
    segments: Floats,
    heard: Heard,
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
    """Return who is in the way of a car, all together, see `waits`.

    `notice` is how long before they must brake those with the right of way are shown that the car
    goes [s]; infinite: they are not made to brake; 0: all must stop anyway. `since` is since when
    the car rests at its line, `stood` since when each other one has stood.
    """
    if way < 0:
        return NOBODY
    floor, window, around = heard.floor, rules.window[line], NOBODY
    across = int(floor[CELLS_X])
    left = cell_number(floor, window[LEFT], LOW_X, CELLS_X)
    right = cell_number(floor, window[RIGHT], LOW_X, CELLS_X)
    low = cell_number(floor, window[LOW], LOW_Y, CELLS_Y)
    high = cell_number(floor, window[HIGH], LOW_Y, CELLS_Y)
    for row in range(low, high + 1):
        first = heard.cell_first[row * across + left]
        last = heard.cell_first[row * across + right + 1]
        for at in range(first, last):
            other = heard.in_cell[at]
            if other == car or is_outside(window, heard.at[other]):
                continue
            known, x, y, cos, sin, v = known_to(heard, other, car, now_ns, seed)
            if not known:
                continue
            found = judge(
                rules, segments, kind, line, way, before, speed, v_most, notice, since,
                stood[other], now_ns, x, y, cos, sin, max(0.0, v), 0.5 * heard.size[other, 0],
            )  # fmt: skip
            if found == SOMEBODY:
                return SOMEBODY
            around |= found
    return around


@law
def judge(
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
    """Return what one other car is to a car at a line, see `waits`; INSIDE: not in the way.

    `since` is since when the car rests at its line, `stood` since when the other one stands.
    """
    for at in range(rules.peer_first[line], rules.peer_first[line + 1]):
        peer = rules.peers[at]
        middle = along(
            segments, rules.feeds, rules.feed_begin, rules.feed_first[peer],
            rules.feed_first[peer + 1], x, y, cos, sin,
        )  # fmt: skip
        if middle != NOWHERE:
            return judge_before(
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
            if v >= STANDS:  # one that stands behind the junction is part of a queue
                found = INSIDE
            if is_in_way(
                rules, kind, way, other, before, speed, v_most, middle, v, half, True,
                rules.limit[peer],
            ):  # fmt: skip
                return SOMEBODY
    return found


@law
def judge_before(
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
    """Return what a car is whose middle has not passed its own line, see `judge`."""
    away = -middle - half
    decel = kind[DECEL]
    is_going = away < 0.0 or v > stopping_speed(away - SHORT_OF_LINE, decel) + HASTE
    if not is_going and (v < STANDS or away <= AT_LINE):
        if away > AT_LINE:
            return NOBODY
        stood = stood if v < STANDS else NEVER_NS
        return judge_waiting(rules, line, way, peer, notice == 0.0, since, stood, now_ns)
    can_let_pass = away > v * notice + braking(v, decel, REACTION) + SHORT_OF_LINE
    if not is_going and (notice == 0.0 or can_let_pass):
        return NOBODY
    for other in range(rules.way_first[peer], rules.way_first[peer + 1]):
        if is_in_way(
            rules, kind, way, other, before, speed, v_most, middle, v, half, is_going,
            rules.limit[peer],
        ):  # fmt: skip
            return SOMEBODY
    return INSIDE if v >= STANDS else NOBODY


@law
def judge_waiting(
    rules: Rules,
    line: int,
    way: int,
    peer: int,
    all_stop: bool,
    since: int,
    stood: int,
    now_ns: int,
) -> int:
    """Return what a car is that waits at its own line, see `judge`."""
    order, theirs = rules.order[line], rules.order[peer]
    is_first = is_earlier(stood, theirs, since, order)
    found = NOBODY
    if meets(rules, way, peer, all_stop):
        found = WAITS | EARLIER if is_first else WAITS
    if has_turn(stood, theirs, now_ns) and meets(rules, way, peer, True):
        found |= THEIR_TURN if is_first or not has_turn(since, order, now_ns) else NOBODY
    return found


@law
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
    """Return where along listed segments a car is that drives along them; NOWHERE: beside them."""
    for at in range(first, last):
        row = segments[ids[at]]
        s, beside, turn_cos, turn_sin = foot(row, x, y, 0.5 * row[LENGTH])
        if s < 0.0 or s > row[LENGTH] or abs(beside) > BESIDE:
            continue
        way_cos = row[COS] * turn_cos - row[SIN] * turn_sin
        way_sin = row[SIN] * turn_cos + row[COS] * turn_sin
        if way_cos * cos + way_sin * sin >= SAME_WAY:
            return float(begins[at] + s)
    return NOWHERE


@law
def meets(rules: Rules, way: int, peer: int, all_stop: bool) -> bool:
    """Return whether a way gives way to a car at another line; where all stop: crosses its way."""
    for pair in range(rules.pair_first[way], rules.pair_first[way + 1]):
        other = rules.pair_way[pair]
        is_of_peer = rules.way_first[peer] <= other < rules.way_first[peer + 1]
        if is_of_peer and (all_stop or rules.pair_yields[pair]):
            return True
    return False


@law
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
    """Return whether a car in motion is, or comes, where the ways of both meet.

    Args:
        rules: See `Rules`.
        kind: The row of the kind of car that asks.
        way: Its way, `other` that of the other one.
        other: See `way`.
        before: How far its front is from its line [m].
        speed: Of it; `v_most` what it will reach [m/s].
        v_most: See `speed`.
        middle: Where the other one is on its way [m]; `half` is half its length.
        v: How fast it is [m/s].
        half: See `middle`.
        is_going: Whether it crosses whatever the right of way.
        limit: How fast it may go [m/s].
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
        accel = HURRY * kind[ACCEL]
        if v > STANDS:
            left = (zone[3] - tail) / v + BEHIND
            if left < time_for(before + zone[0], speed, limit, 2.0 * kind[ACCEL]):
                return False
        through = time_for(before + zone[1] + kind[FRONT] + kind[REAR], speed, v_most, accel)
        if nose >= zone[2]:
            return True
        return bool((zone[2] - nose) / max(v, limit) < through + GAP)
    return False
