"""What a crowd of drivers remembers: one row a car, one column a thing.

Compiled code reaches a thing by row and column; people by the names of `Crowd`.
"""

from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.driver import CarLimits

# Of a kind of car: see `CarLimits`; SWING is how long its wheels take for the sharpest joint [s].
(
    WHEELBASE, STEER_LIMIT, STEER_RATE, FRONT, REAR, WIDTH, ACCEL, DECEL, LATERAL_ACCEL, BRAKE,
    SWING, STEPS,
) = range(12)  # fmt: skip
SPEEDS = 12
MOST_SPEEDS = 20

# Of a car: where on its lane and beside it, how far driven since sent, the speed it was told to
# keep, where its wheels are and should be [rad], the speed it is being brought to, and the
# throttle that the feedback has gathered.
S, BESIDE, DONE, TOLD, ANGLE, STEER, PACE, SUM = range(8)

# Of a car, whole numbers: its kind; which lane of its way it is on; where its route begins among
# all routes, how many lanes it has, and what comes after them; its own seed; the line it decided
# to cross and on which lane of its way; when it last decided; what holds it; which way it turns;
# whether it has arrived. Of the line without lights before it: which it is and on which lane of
# its way, since when it rests there, when cars in motion last kept it, when one was last in the
# junction, whether it was free the last time.
(
    KIND, INDEX, ROUTE, COUNT, AFTER, GOAL, SEED, GOING_LINE, GOING_INDEX, LAST_NS, WAITING, TURN,
    ARRIVED, RULE_LINE, RULE_INDEX, REST_NS, KEPT_NS, BUSY_NS, WAS_FREE,
) = range(19)  # fmt: skip
INTS = 19
NEVER_NS = -(2**62)
NO_GOAL = 2**62

# After the last lane of a route: stand at its end, begin again, or take any lane that follows.
STOP, LOOP, CIRCULATE = range(3)
AFTERS = ("stop", "loop", "circulate")

# Lanes of a way in sight: one behind, the one it is on, those ahead; -1 where there is none.
BEHIND, HERE, IN_SIGHT = 0, 1, 8

WAITING_FOR = (None, "signal", "vehicle", "stop", "sign")
FREE, SIGNAL, VEHICLE, ORDER, SIGN = range(5)


class Memory(NamedTuple):
    """All that drivers remember.

    Attributes:
        kinds: (k, 32) of the kinds of cars.
        floats: (capacity, 8); `ints` (capacity, 19).
        sight: (capacity, 8) lanes of each car's way, by number.
        routes: All routes, one behind the other.
        stood: (capacity,) since when each station has told that it stands; NEVER_NS: it does not.
        stood_at: (capacity, 2) where [m].
    """

    kinds: Floats
    floats: Floats
    ints: Ints
    sight: Ints
    routes: Ints
    stood: Ints
    stood_at: Floats


def kind_row(limits: CarLimits, sharpest: float) -> Floats:
    """Return the row of a kind of car on a map whose sharpest joint turns the wheels by so much."""
    speeds = limits.speeds
    if len(speeds) > MOST_SPEEDS:
        at = np.linspace(0.0, 1.0, MOST_SPEEDS + 1)[1:]
        known = np.linspace(0.0, 1.0, len(speeds) + 1)
        speeds = tuple(np.interp(at, known, (0.0, *speeds)).tolist())
    row = np.zeros(SPEEDS + MOST_SPEEDS)
    row[:SPEEDS] = (
        limits.wheelbase, limits.steer_limit, limits.steer_rate, limits.front, limits.rear,
        limits.width, limits.accel, limits.decel, limits.lateral_accel, limits.brake_throttle,
        sharpest / limits.steer_rate, len(speeds),
    )  # fmt: skip
    row[SPEEDS : SPEEDS + len(speeds)] = speeds
    return row


def empty_memory(capacity: int) -> Memory:
    """Return the memory of a crowd that nobody has entered yet."""
    ints = np.zeros((capacity, INTS), np.int64)
    ints[:, LAST_NS] = NEVER_NS
    return Memory(
        kinds=np.zeros((0, SPEEDS + MOST_SPEEDS)),
        floats=np.zeros((capacity, 8)),
        ints=ints,
        sight=np.full((capacity, IN_SIGHT), -1, np.int64),
        routes=np.zeros(0, np.int64),
        stood=np.full(capacity, NEVER_NS, np.int64),
        stood_at=np.zeros((capacity, 2)),
    )
