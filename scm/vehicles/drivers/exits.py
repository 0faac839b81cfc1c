"""Whether there is room behind a junction: who may not find a place there does not enter it.

Two things must hold. The cars in sight behind the junction leave a place, each taken to roll on
for a while and not into the one before it. And if all cars up to the next stop line behind it
came to a halt there, bumper to bumper, there would be a place too: so no queue grows back into a
junction, and a full street does not stop the streets that cross it.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.ahead import (
    LENGTH_OF,
    REACH,
    REAR_AT,
    SPEED_OF,
    STANDSTILL_GAP,
    Scratch,
    cars_ahead,
)
from scm.vehicles.drivers.lane_tracking import survey
from scm.vehicles.drivers.memory import FRONT, HERE, IN_SIGHT, SPEEDS, STEPS
from scm.vehicles.drivers.stations import Heard
from scm.vehicles.drivers.stop_lines import SHORT_OF_LINE, next_line
from scm.vehicles.drivers.streets import JUNCTION, LIMIT, Ways
from scm.vehicles.jit import law

FLOW = 0.7
FARTHEST = 9.0


@law
def has_room(
    ways: Ways,
    heard: Heard,
    room: Scratch,
    kind: Floats,
    sight: Ints,
    found: int,
    car: int,
    line: int,
    at: int,
    distance: float,
    s: float,
    speed: float,
    now_ns: int,
    seed: int,
) -> bool:
    """Return whether a car, once past a line, will find a place behind the junction.

    Args:
        ways: The lanes.
        heard: Everybody's CAMs.
        room: Holds the cars ahead; what else it holds is written over.
        kind: The row of the kind of car.
        sight: The car's lanes in sight.
        found: How many cars are ahead.
        car: The car's number.
        line: The stop line.
        at: Which of the lanes in sight it is on.
        distance: How far it is from the rear axle [m].
        s: Where the car is on its lane [m].
        speed: Along the body [m/s].
        now_ns: The present time [ns].
        seed: Of the luck.
    """
    leave = leaving(ways, sight, s, at, line)
    if leave < 0.0:
        return True
    steps = int(kind[STEPS])
    cruise = kind[SPEEDS + steps - 1] if steps else ways.segments[room.ids[0], LIMIT]
    crossing = (leave - distance) / max(speed, 0.5 * cruise)
    if last_place(room.ahead, found, crossing) - kind[FRONT] < leave:
        return False
    line_first, line_at = ways.line_first, ways.line_at
    _, _, beyond = next_line(ways.length, line_first, line_at, sight, s, leave, math.inf)
    beyond = beyond if beyond >= 0.0 else math.inf
    farthest = min(beyond - SHORT_OF_LINE, leave + FARTHEST)
    ids, begins = room.ids, room.begins
    count, _, _ = survey(ways.segment_first, ways.segments, sight, s, 0.0, farthest, ids, begins)
    reach = max(REACH, farthest - kind[FRONT])
    queued = cars_ahead(ways.segments, heard, room, kind, car, count, reach, now_ns, seed)
    place = farthest
    for other in range(queued):
        place -= room.ahead[other, LENGTH_OF] + STANDSTILL_GAP
    return bool(place - kind[FRONT] >= leave)


@law
def last_place(ahead: Floats, found: int, time: float) -> float:
    """Return where a front bumper could stand after a time [s], behind all cars that are ahead [m].

    Counts from the farthest car backwards: one that rolls is taken to move on at part of its
    speed, but not into the car before it.
    """
    free = math.inf
    for at in range(found - 1, -1, -1):
        moved = ahead[at, REAR_AT] + FLOW * ahead[at, SPEED_OF] * time
        free = min(moved, free - ahead[at, LENGTH_OF]) - STANDSTILL_GAP
    return free


@law
def leaving(ways: Ways, sight: Ints, s: float, at: int, line: int) -> float:
    """Return how far the rear axle is from where the car has left the junction behind a line [m].

    -1: no stretch of this junction lies behind the line on the car's way.
    """
    begin = -s
    for before in range(HERE, at):
        begin += ways.length[sight[before]]
    least = ways.line_at[line] - SHORT_OF_LINE
    junction = ways.line_links[line, JUNCTION]
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
