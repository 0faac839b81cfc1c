"""In which order cars that stand at the lines of a junction go: told alike by all from their CAMs.

Who stood there first goes first where all must stop. Everywhere, who has stood at its line for
long has its turn: for a while all whose ways may meet its ways stay behind their lines, whatever
their right of way, so that the junction empties before it. The turn ends even if the car does not
go, since there may be no room for it, and comes again after a pause that differs from line to line.

    age = now - first CAM that told that the car stands
    it is its turn when  LONG <= age  and  (age - LONG) mod (EVERY + k SHIFT) < TURN
    k: the line's place in its junction; of several, who has stood longest, then the smaller k
"""

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.memory import NEVER_NS
from scm.vehicles.drivers.stations import CAM_SPEED, CAM_X, CAM_Y, Heard
from scm.vehicles.jit import array_kernel, law

STANDS = 0.03
SAME_PLACE = 0.1
LONG_NS = 20_000_000_000
TURN_NS = 7_000_000_000
EVERY_NS = 20_000_000_000
SHIFT_NS = 2_500_000_000


@array_kernel
def note_standing(stood: Ints, stood_at: Floats, stations: Ints, now_ns: int, cams: Floats) -> None:
    """Note since when and where stations stand, from CAMs (k, 5) that they tell now.

    Who starts and stops again within a few centimetres stands all the time.
    """
    for row in range(len(stations)):
        station = stations[row]
        x, y = cams[row, CAM_X], cams[row, CAM_Y]
        moved = abs(x - stood_at[station, 0]) + abs(y - stood_at[station, 1])
        if stood[station] != NEVER_NS and moved < SAME_PLACE:
            continue
        stood[station] = NEVER_NS
        if cams[row, CAM_SPEED] < STANDS:
            stood[station] = now_ns
            stood_at[station, 0], stood_at[station, 1] = x, y


@law
def since_told(stood: Ints, heard: Heard, car: int, rest_ns: int, now_ns: int) -> int:
    """Return since when the others know that a car rests at its line; NEVER_NS: it does not.

    A car that does not hear itself takes its own `rest_ns`.
    """
    if rest_ns < 0:
        return NEVER_NS
    if heard.number[heard.newest[car], car] < 0:
        return rest_ns
    return int(stood[car]) if stood[car] != NEVER_NS else now_ns


@law
def has_turn(since_ns: int, order: int, now_ns: int) -> bool:
    """Return whether it is the turn of a car that stands at a line since then."""
    if since_ns == NEVER_NS or now_ns - since_ns < LONG_NS:
        return False
    return bool((now_ns - since_ns - LONG_NS) % (EVERY_NS + order * SHIFT_NS) < TURN_NS)


@law
def is_earlier(theirs_ns: int, their_order: int, mine_ns: int, my_order: int) -> bool:
    """Return whether another car came to stand before a car did, both at their lines."""
    if theirs_ns == NEVER_NS:
        return False
    if mine_ns == NEVER_NS or theirs_ns < mine_ns:
        return True
    return theirs_ns == mine_ns and their_order < my_order
