"""Stop or go at the next line, by its signal.

Yellow, or green after its guaranteed time, stops a car that can stop comfortably before the line;
the others clear the junction, and a car that decided to go keeps going. Red and missing frames stop
all cars. Flashing red is a stop sign for all; if the monitor reports a fault and the signals do not
flash, all cars stand.
"""

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.driver_state import (
    FREE,
    GOING_INDEX,
    GOING_LINE,
    HERE,
    SIGN,
    SIGNAL,
    VEHICLE,
    WINDOW_SIZE,
)
from scm.vehicles.drivers.lane_graph import GROUP, JUNCTION
from scm.vehicles.drivers.signal_table import (
    FLASHING,
    GREEN,
    YELLOW,
    ReceivedSignals,
    frame_for,
    usable_colour,
)
from scm.vehicles.jit import kernel_function

SHORT_OF_LINE = 0.04  # where the front bumper stops before the line [m]
STOP_MARGIN = 0.02  # of distance for a stop that counts as comfortable [m]
REACTION = 0.1  # [s]
LOOK_AHEAD = 0.5  # beyond the stopping distance [m]


@kernel_function
def next_line(
    length: Floats,
    line_first: Ints,
    line_at: Floats,
    lane_window: Ints,
    s: float,
    front: float,
    reach: float,
) -> tuple[int, int, float]:
    """Return the next stop line at or after the front bumper.

    Returns:
        Its number, its lane in the window, and its distance from the rear axle [m], which is -1 if
        there is none within reach.
    """
    begin = -s
    for at in range(HERE, WINDOW_SIZE):
        lane = lane_window[at]
        if lane < 0 or begin > reach:
            break
        for line in range(line_first[lane], line_first[lane + 1]):
            distance = begin + line_at[line]
            if distance >= front:
                return line, at, distance if distance <= reach else -1.0
        begin += length[lane]
    return -1, HERE, -1.0


@kernel_function
def obey_signal(
    signals: ReceivedSignals,
    links: Ints,
    ints: Ints,
    line: int,
    index: int,
    can_stop: bool,
    car: int,
    now_ns: int,
    seed: int,
) -> int:
    """Return what a car waits for at a line: SIGNAL, or FREE.

    VEHICLE: the cars behind the line, unless there is room. SIGN: the junction has no signals now.

    Args:
        signals: The received signal states.
        links: Group and junction of stop lines.
        ints: The car's integer state.
        line: The stop line.
        index: The line's lane on the car's route.
        can_stop: Whether the car can stop comfortably before it.
        car: The vehicle index.
        now_ns: The present time [ns].
        seed: Decides which frames are lost.
    """
    is_going = ints[GOING_LINE] == line and ints[GOING_INDEX] == index
    place = frame_for(signals, links[line, JUNCTION], car, now_ns, seed)
    colour = usable_colour(signals, links[line, GROUP], links[line, JUNCTION], place, now_ns)
    if colour == GREEN and can_stop and not is_going:
        return VEHICLE
    if colour == GREEN or (colour == YELLOW and (is_going or not can_stop)):
        ints[GOING_LINE], ints[GOING_INDEX] = line, index
        return FREE
    is_flashing = signals.flashing[place, links[line, JUNCTION]]
    shows_flash = is_flashing or signals.colour[place, links[line, GROUP]] == FLASHING
    return SIGN if colour == FLASHING and shows_flash else SIGNAL
