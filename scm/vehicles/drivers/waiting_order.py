"""The order in which cars waiting at a junction's lines go; every car derives the same from CAMs.

At an all-way stop the first to stop goes first. At every junction a car that has waited long gets
a turn: for a while all cars on crossing paths stay behind their lines, whatever their right of way,
so that the junction empties. The turn ends even if the car does not go, since there may be no room
for it, and repeats after a pause that differs from line to line.

    age = now - first CAM that reported standstill
    its turn when  LONG_WAIT <= age  and  (age - LONG_WAIT) mod (TURN_EVERY + k TURN_SHIFT) < TURN
    k: the line's place in its junction; of several cars, the longest waiting, then the smaller k
"""

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.driver_state import NEVER_NS
from scm.vehicles.drivers.received_cams import CAM_SPEED, CAM_X, CAM_Y, ReceivedCams
from scm.vehicles.jit import array_kernel, kernel_function

STANDSTILL_SPEED = 0.03  # a slower car stands [m/s]
SAME_PLACE = 0.1  # a car that moves less still stands [m]
LONG_WAIT_NS = 20_000_000_000
TURN_NS = 7_000_000_000
TURN_EVERY_NS = 20_000_000_000
TURN_SHIFT_NS = 2_500_000_000


@array_kernel
def note_standing(stood: Ints, stood_at: Floats, stations: Ints, now_ns: int, cams: Floats) -> None:
    """Update since when and where stations stand, from CAMs (k, 5) sent now.

    A car that starts and stops again within a few centimetres counts as standing.
    """
    for row in range(len(stations)):
        station = stations[row]
        x, y = cams[row, CAM_X], cams[row, CAM_Y]
        moved = abs(x - stood_at[station, 0]) + abs(y - stood_at[station, 1])
        if stood[station] != NEVER_NS and moved < SAME_PLACE:
            continue
        stood[station] = NEVER_NS
        if cams[row, CAM_SPEED] < STANDSTILL_SPEED:
            stood[station] = now_ns
            stood_at[station, 0], stood_at[station, 1] = x, y


@kernel_function
def announced_since(
    stood: Ints, received: ReceivedCams, car: int, rest_ns: int, now_ns: int
) -> int:
    """Return since when the others know that a car stands at its line; NEVER_NS: it moves.

    A car that does not receive its own CAMs uses its `rest_ns`.
    """
    if rest_ns < 0:
        return NEVER_NS
    if received.number[received.newest[car], car] < 0:
        return rest_ns
    return int(stood[car]) if stood[car] != NEVER_NS else now_ns


@kernel_function
def has_turn(since_ns: int, order: int, now_ns: int) -> bool:
    """Return whether it is the turn of a car that has been standing at its line since then."""
    if since_ns == NEVER_NS or now_ns - since_ns < LONG_WAIT_NS:
        return False
    return bool(
        (now_ns - since_ns - LONG_WAIT_NS) % (TURN_EVERY_NS + order * TURN_SHIFT_NS) < TURN_NS
    )


@kernel_function
def is_earlier(theirs_ns: int, their_order: int, mine_ns: int, my_order: int) -> bool:
    """Return whether another car stopped at its line before the own car did."""
    if theirs_ns == NEVER_NS:
        return False
    if mine_ns == NEVER_NS or theirs_ns < mine_ns:
        return True
    return theirs_ns == mine_ns and their_order < my_order
