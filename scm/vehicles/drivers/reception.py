"""Whether a driver's reception is good enough to conclude that unheard cars are absent.

    of the last 16 CAMs of each known station around, at least 5 on average have arrived,
    and the newest of each is at most 2.5 s old

Every station sends at least once a second. A driver with such reception has missed all CAMs of an
unknown station with a probability below (11/16)^16 = 0.25 %. If it knows no station around, any
station that it receives so well is enough. If it receives nobody at all, its radio may be dead, and
it waits. An ideal channel loses nothing: there, no CAM means no car.
"""

from scm.arrays import Floats
from scm.clock import NS_PER_S
from scm.vehicles.drivers.channel import IDEAL, POOR_RECEPTION, has_arrived
from scm.vehicles.drivers.received_cams import (
    CAM_X,
    CAM_Y,
    CELLS_X,
    CELLS_Y,
    LOW_X,
    LOW_Y,
    ReceivedCams,
    cell_number,
)
from scm.vehicles.jit import kernel_function

MIN_MEAN_CAMS = 5  # of the last 16 of each station
MAX_NEWEST_AGE_NS = 5 * NS_PER_S // 2
LEFT, LOW, RIGHT, HIGH = range(4)


@kernel_function
def arrived_of(
    received: ReceivedCams, station: int, receiver: int, now_ns: int, seed: int
) -> tuple[int, bool]:
    """Return how many of a station's last CAMs reached a receiver, and whether one is recent."""
    history, count, is_fresh = len(received.number), 0, False
    for older in range(history):
        place = (received.newest[station] - older) % history
        number = received.number[place, station]
        if number < 0:
            break
        age_ns = now_ns - received.t_ns[place, station]
        cam = received.cams[place, station]
        x, y = cam[CAM_X], cam[CAM_Y]
        if has_arrived(received.channel, seed, station, receiver, number, x, y, age_ns):
            count += 1
            is_fresh = is_fresh or age_ns <= MAX_NEWEST_AGE_NS
    return count, is_fresh


@kernel_function
def reception_is_good(
    received: ReceivedCams, window: Floats, car: int, now_ns: int, seed: int
) -> bool:
    """Return whether a car's reception within an area of the floor is good."""
    if received.channel.numbers[IDEAL] > 0.0:
        return bool(received.channel.numbers[POOR_RECEPTION] == 0.0)
    floor, known, arrived = received.floor, 0, 0
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
            if other == car:
                continue
            count, is_fresh = arrived_of(received, other, car, now_ns, seed)
            if count == 0:
                continue
            if not is_fresh:
                return False
            known, arrived = known + 1, arrived + count
    if known == 0:
        return receives_any_station_well(received, car, now_ns, seed)
    return arrived >= MIN_MEAN_CAMS * known


@kernel_function
def receives_any_station_well(received: ReceivedCams, car: int, now_ns: int, seed: int) -> bool:
    """Return whether a car receives at least one station well."""
    for station in range(len(received.newest)):
        if station == car or received.cell_of[station] < 0:
            continue
        count, is_fresh = arrived_of(received, station, car, now_ns, seed)
        if is_fresh and count >= MIN_MEAN_CAMS:
            return True
    return False
