"""Stop or go at the next line: what the signal says.

A yellow light, or a green one whose promised end has passed, stops a car that can stop with
comfortable deceleration before the line, and lets the others clear the junction. Whoever went on
for that reason goes on. Red and silence stop everybody. Flashing red is a stop sign for all; where
the monitor tells of a fault and the lights do not flash, everybody stands.
"""

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.memory import (
    FREE,
    GOING_INDEX,
    GOING_LINE,
    HERE,
    IN_SIGHT,
    SIGN,
    SIGNAL,
    VEHICLE,
)
from scm.vehicles.drivers.signal_table import FLASHING, GREEN, YELLOW, Told, believed, frame_for
from scm.vehicles.drivers.streets import GROUP, JUNCTION
from scm.vehicles.jit import law

SHORT_OF_LINE = 0.04
NEAREST = 0.02
REACTION = 0.1
LOOK_AHEAD = 0.5


@law
def next_line(
    length: Floats,
    line_first: Ints,
    line_at: Floats,
    sight: Ints,
    s: float,
    front: float,
    reach: float,
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
        for line in range(line_first[lane], line_first[lane + 1]):
            distance = begin + line_at[line]
            if distance >= front:
                return line, at, distance if distance <= reach else -1.0
        begin += length[lane]
    return -1, HERE, -1.0


@law
def signal_says(
    told: Told,
    links: Ints,
    ints: Ints,
    line: int,
    index: int,
    can_stop: bool,
    car: int,
    now_ns: int,
    seed: int,
) -> int:
    """Return what holds a car at a line: SIGNAL, or nothing: FREE.

    VEHICLE: the others, unless there is room behind it. SIGN: the junction has no signals now.

    Args:
        told: The signals.
        links: Of stop lines: group and junction.
        ints: The car's memory.
        line: The stop line.
        index: Which lane of the car's way the line is on.
        can_stop: Whether the car would come to rest before it without haste.
        car: The car's number.
        now_ns: The present time [ns].
        seed: Of the luck.
    """
    is_going = ints[GOING_LINE] == line and ints[GOING_INDEX] == index
    place = frame_for(told, links[line, JUNCTION], car, now_ns, seed)
    colour = believed(told, links[line, GROUP], links[line, JUNCTION], place, now_ns)
    if colour == GREEN and can_stop and not is_going:
        return VEHICLE
    if colour == GREEN or (colour == YELLOW and (is_going or not can_stop)):
        ints[GOING_LINE], ints[GOING_INDEX] = line, index
        return FREE
    is_flashing = told.flashing[place, links[line, JUNCTION]]
    shows_flash = is_flashing or told.colour[place, links[line, GROUP]] == FLASHING
    return SIGN if colour == FLASHING and shows_flash else SIGNAL
