"""Whether there is room behind a junction: a car does not enter without room to leave it.

Two conditions must hold. The cars ahead behind the junction leave a place, where each is predicted
to roll on but not into the one before it. And there is still a place if all cars up to the next
stop line stop there, bumper to bumper. So no queue grows back into a junction, and a full street
does not block the streets that cross it.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.cars_ahead import (
    LENGTH_OF,
    REACH,
    REAR_AT,
    SPEED_OF,
    STANDSTILL_GAP,
    Scratch,
    find_cars_ahead,
)
from scm.vehicles.drivers.driver_state import FRONT, HERE, SPEEDS, STEPS, WINDOW_SIZE
from scm.vehicles.drivers.lane_graph import JUNCTION, LIMIT, LaneArrays
from scm.vehicles.drivers.lane_tracking import list_segments
from scm.vehicles.drivers.received_cams import ReceivedCams
from scm.vehicles.drivers.stop_lines import SHORT_OF_LINE, next_line
from scm.vehicles.jit import kernel_function

ROLLING_SHARE = 0.7  # of its present speed that a car ahead is assumed to hold
MAX_CLEAR_M = 9.0  # how far behind the junction cars are counted


@kernel_function
def has_room(
    lanes: LaneArrays,
    received: ReceivedCams,
    scratch: Scratch,
    kind: Floats,
    lane_window: Ints,
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
    """Return whether a car that passes a line will find a place behind the junction.

    Args:
        lanes: The lanes.
        received: The received CAMs.
        scratch: Holds the cars ahead; its other arrays are overwritten.
        kind: The row of the kind of car.
        lane_window: Of the car.
        found: Number of cars ahead.
        car: The vehicle index.
        line: The stop line.
        at: The line's lane in the window.
        distance: From the rear axle to the line [m].
        s: Place of the car on its lane [m].
        speed: Along the body [m/s].
        now_ns: The present time [ns].
        seed: Decides which frames are lost.
    """
    clear_of = distance_to_leave(lanes, lane_window, s, at, line)
    if clear_of < 0.0:
        return True
    steps = int(kind[STEPS])
    cruise = kind[SPEEDS + steps - 1] if steps else lanes.segments[scratch.ids[0], LIMIT]
    crossing = (clear_of - distance) / max(speed, 0.5 * cruise)
    if last_place(scratch.ahead, found, crossing) - kind[FRONT] < clear_of:
        return False
    line_first, line_at = lanes.line_first, lanes.line_at
    _, _, beyond = next_line(lanes.length, line_first, line_at, lane_window, s, clear_of, math.inf)
    beyond = beyond if beyond >= 0.0 else math.inf
    farthest = min(beyond - SHORT_OF_LINE, clear_of + MAX_CLEAR_M)
    ids, begins = scratch.ids, scratch.begins
    count, _, _ = list_segments(
        lanes.segment_first, lanes.segments, lane_window, s, 0.0, farthest, ids, begins
    )
    reach = max(REACH, farthest - kind[FRONT])
    queued = find_cars_ahead(
        lanes.segments, received, scratch, kind, car, count, reach, now_ns, seed
    )
    place = farthest
    for other in range(queued):
        place -= scratch.ahead[other, LENGTH_OF] + STANDSTILL_GAP
    return bool(place - kind[FRONT] >= clear_of)


@kernel_function
def last_place(ahead: Floats, found: int, time: float) -> float:
    """Return where a front bumper could stop behind all cars ahead, after a time [s], in [m].

    Counts from the farthest car backwards: a moving car goes on at part of its speed, but not into
    the car before it.
    """
    free = math.inf
    for at in range(found - 1, -1, -1):
        moved = ahead[at, REAR_AT] + ROLLING_SHARE * ahead[at, SPEED_OF] * time
        free = min(moved, free - ahead[at, LENGTH_OF]) - STANDSTILL_GAP
    return free


@kernel_function
def distance_to_leave(lanes: LaneArrays, lane_window: Ints, s: float, at: int, line: int) -> float:
    """Return the distance from the rear axle to the end of the junction behind a line [m].

    -1: the car's route does not cross this junction behind the line.
    """
    begin = -s
    for before in range(HERE, at):
        begin += lanes.length[lane_window[before]]
    least = lanes.line_at[line] - SHORT_OF_LINE
    junction = lanes.line_links[line, JUNCTION]
    for beyond in range(at, WINDOW_SIZE):
        lane = lane_window[beyond]
        if lane < 0:
            break
        for stretch in range(lanes.stretch_first[lane], lanes.stretch_first[lane + 1]):
            if lanes.stretch_junction[stretch] == junction and lanes.stretches[stretch, 0] >= least:
                return float(begin + lanes.stretches[stretch, 1])
        begin += lanes.length[lane]
        least = 0.0
    return -1.0
