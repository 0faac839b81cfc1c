"""Whether a driver hears well enough to take silence for absence.

    of the last 16 CAMs of each station around that it knows of, at least 5 on average have arrived,
    and the newest of each is at most 2.5 s old

Whoever speaks at all speaks once a second. So who hears so much of those it knows has missed all
of an unknown one with a chance below (11/16)^16 = 0.25 %. Where it knows of nobody around, any
station anywhere that it hears so well will do; who hears nobody at all may sit beside a dead radio,
and stays. An ideal air loses nothing: there silence is absence.
"""

from scm.arrays import Floats
from scm.clock import NS_PER_S
from scm.vehicles.drivers.channel import DEAF, IDEAL, has_arrived
from scm.vehicles.drivers.stations import (
    CAM_X,
    CAM_Y,
    CELLS_X,
    CELLS_Y,
    LOW_X,
    LOW_Y,
    Heard,
    cell_number,
)
from scm.vehicles.jit import law

ENOUGH = 5
FRESH_NS = 5 * NS_PER_S // 2
LEFT, LOW, RIGHT, HIGH = range(4)


@law
def arrived_of(
    heard: Heard, station: int, receiver: int, now_ns: int, seed: int
) -> tuple[int, bool]:
    """Return how many of a station's last CAMs reached a receiver, and whether one did lately."""
    kept, count, is_fresh = len(heard.number), 0, False
    for older in range(kept):
        place = (heard.newest[station] - older) % kept
        number = heard.number[place, station]
        if number < 0:
            break
        age_ns = now_ns - heard.t_ns[place, station]
        cam = heard.cams[place, station]
        x, y = cam[CAM_X], cam[CAM_Y]
        if has_arrived(heard.channel, seed, station, receiver, number, x, y, age_ns):
            count += 1
            is_fresh = is_fresh or age_ns <= FRESH_NS
    return count, is_fresh


@law
def hears_well(heard: Heard, window: Floats, car: int, now_ns: int, seed: int) -> bool:
    """Return whether a car may trust what it does not hear within a window over the floor."""
    if heard.channel.numbers[IDEAL] > 0.0:
        return bool(heard.channel.numbers[DEAF] == 0.0)
    floor, known, arrived = heard.floor, 0, 0
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
            if other == car:
                continue
            count, is_fresh = arrived_of(heard, other, car, now_ns, seed)
            if count == 0:
                continue
            if not is_fresh:
                return False
            known, arrived = known + 1, arrived + count
    if known == 0:
        return hears_anybody(heard, car, now_ns, seed)
    return arrived >= ENOUGH * known


@law
def hears_anybody(heard: Heard, car: int, now_ns: int, seed: int) -> bool:
    """Return whether a car hears any station at all, and that well."""
    for station in range(len(heard.newest)):
        if station == car or heard.cell_of[station] < 0:
            continue
        count, is_fresh = arrived_of(heard, station, car, now_ns, seed)
        if is_fresh and count >= ENOUGH:
            return True
    return False
