"""Stop or go at the next line: what the signal says, and whether there is room behind it.

A yellow light, or a green one whose promised end has passed, stops a car that can stop with
comfortable deceleration before the line, and lets the others clear the junction. Whoever went on
for that reason goes on. Red, flashing red and silence stop everybody.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.ahead import LENGTH_OF, REAR_AT, SPEED_OF
from scm.vehicles.drivers.memory import (
    DECEL,
    FREE,
    FRONT,
    GOING_INDEX,
    GOING_LINE,
    HERE,
    IN_SIGHT,
    INDEX,
    SIGNAL,
    SPEEDS,
    STEPS,
    VEHICLE,
)
from scm.vehicles.drivers.pace import braking
from scm.vehicles.drivers.signal_table import GREEN, YELLOW, Told, believed, frame_for
from scm.vehicles.drivers.streets import GROUP, JUNCTION, LIMIT, Ways
from scm.vehicles.jit import law

SHORT_OF_LINE = 0.04
NEAREST = 0.02
REACTION = 0.1
LOOK_AHEAD = 0.5
STANDSTILL_GAP = 0.08
FLOW = 0.7


@law
def next_line(
    ways: Ways, sight: Ints, s: float, front: float, reach: float
) -> tuple[int, int, float]:
    """Return the next stop line at or after the front bumper.

    Returns:
        Its number, its lane in sight, how far it is from the rear axle [m]; this is -1 when there
        is none within the reach.
    """
    begin = -s
    for at in range(HERE, IN_SIGHT):
        lane = sight[at]
        if lane < 0 or begin > reach:
            break
        for line in range(ways.line_first[lane], ways.line_first[lane + 1]):
            distance = begin + ways.line_at[line]
            if distance >= front:
                return line, at, distance if distance <= reach else -1.0
        begin += ways.length[lane]
    return -1, HERE, -1.0


@law
def hold(
    ways: Ways,
    told: Told,
    kind: Floats,
    ints: Ints,
    sight: Ints,
    ahead: Floats,
    found: int,
    car: int,
    s: float,
    speed: float,
    now_ns: int,
    loss: float,
    seed: int,
) -> tuple[int, float]:
    """Return what holds a car at the next line, or FREE, and how far its front may still go [m]."""
    front = kind[FRONT]
    brake = braking(max(0.0, speed), kind[DECEL], REACTION)
    line, at, distance = next_line(ways, sight, s, front, front + LOOK_AHEAD + 2.0 * brake)
    if distance < 0.0:
        return FREE, math.inf
    index = ints[INDEX] + at - HERE
    is_going = ints[GOING_LINE] == line and ints[GOING_INDEX] == index
    can_stop = distance - front >= brake + NEAREST
    junction = ways.line_links[line, JUNCTION]
    place = frame_for(told, junction, car, loss, seed)
    colour = believed(told, ways.line_links[line, GROUP], junction, place, now_ns)
    reason = FREE
    if colour == YELLOW and (is_going or not can_stop):
        is_going = True
    elif colour != GREEN:
        reason = SIGNAL
    elif not is_going and can_stop:
        leave = leaving(ways, sight, s, at, line, junction)
        has_room = room(kind, ways, ahead, found, leave, distance, speed, sight[HERE])
        reason = FREE if has_room else VEHICLE
    else:
        is_going = True
    if is_going:
        ints[GOING_LINE], ints[GOING_INDEX] = line, index
    return reason, distance - SHORT_OF_LINE - front


@law
def leaving(ways: Ways, sight: Ints, s: float, at: int, line: int, junction: int) -> float:
    """Return how far the rear axle is from where the car has left the junction behind a line [m].

    -1: no stretch of this junction lies behind the line on the car's way.
    """
    begin = -s
    for before in range(HERE, at):
        begin += ways.length[sight[before]]
    least = ways.line_at[line] - SHORT_OF_LINE
    for beyond in range(at, IN_SIGHT):
        lane = sight[beyond]
        if lane < 0:
            break
        for stretch in range(ways.stretch_first[lane], ways.stretch_first[lane + 1]):
            if ways.stretch_junction[stretch] == junction and ways.stretches[stretch, 0] >= least:
                return float(begin + ways.stretches[stretch, 1])
        begin += ways.length[lane]
        least = 0.0
    return -1.0


@law
def room(
    kind: Floats,
    ways: Ways,
    ahead: Floats,
    found: int,
    leave: float,
    line: float,
    speed: float,
    lane: int,
) -> bool:
    """Return whether the car, once past the line, will find a place behind the junction.

    Counts from the farthest car backwards: one that rolls is taken to move on at part of its
    speed for as long as the crossing takes, but not into the car before it.
    """
    if leave < 0.0:
        return True
    steps = int(kind[STEPS])
    cruise = kind[SPEEDS + steps - 1] if steps else ways.segments[ways.segment_first[lane], LIMIT]
    crossing = (leave - line) / max(speed, 0.5 * cruise)
    free = math.inf
    for at in range(found - 1, -1, -1):
        moved = ahead[at, REAR_AT] + FLOW * ahead[at, SPEED_OF] * crossing
        free = min(moved, free - ahead[at, LENGTH_OF]) - STANDSTILL_GAP
    return bool(free - kind[FRONT] >= leave)
