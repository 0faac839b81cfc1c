"""The state of a batch of drivers: one row per car, named columns.

Compiled code uses rows and columns; other code uses the properties of `DriverBatch`.
"""

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.driver import CarLimits

# Of a kind of car: see `CarLimits`. SWING: time that its wheels need for the largest jump of the
# steering angle on this map [s].
(
    WHEELBASE, STEER_LIMIT, STEER_RATE, FRONT, REAR, WIDTH, ACCEL, DECEL, LATERAL_ACCEL, BRAKE,
    SWING, STEPS,
) = range(12)  # fmt: skip
SPEEDS = 12
MAX_SPEEDS = 20

# Of a car: place on its lane, lateral offset, distance driven since it was sent, requested speed,
# estimated and commanded angle of its wheels [rad], speed setpoint, integral of the throttle.
S, BESIDE, DONE, REQUESTED_SPEED, ANGLE, STEER, SPEED_SETPOINT, INTEGRAL = range(8)

# Of a car, integers: its kind; index of its lane on its route; start of its route in the route
# table, number of lanes, and what follows them; goal; its seed; the line that it decided to cross
# and that line's lane on the route; time of the last decision; what it waits for; direction of the
# next turn; whether it has arrived. Of the line without signals ahead: its number and lane on the
# route; since when the car rests there; when moving cars last blocked it; when one was last in the
# junction; whether the way was free at the last decision. Moving or at rest: what it waits for at
# the signals ahead.
(
    KIND, INDEX, ROUTE, COUNT, AFTER, GOAL, SEED, GOING_LINE, GOING_INDEX, LAST_NS, WAITING, TURN,
    ARRIVED, RULE_LINE, RULE_INDEX, REST_NS, LAST_BLOCKED_NS, LAST_BUSY_NS, WAS_FREE, AT_SIGNALS,
) = range(20)  # fmt: skip
INTS = 20
NEVER_NS = -(2**62)
NO_GOAL = 2**62

# After the last lane of a route: stop at its end, start again, or take any lane that follows.
STOP, LOOP, CIRCULATE = range(3)
AFTERS = ("stop", "loop", "circulate")

# Lane window of a car: the lane behind, the current one, those ahead; -1: none.
BEHIND, HERE, WINDOW_SIZE = 0, 1, 8

WAITING_FOR = (None, "signal", "vehicle", "stop", "sign")
FREE, SIGNAL, VEHICLE, ORDER, SIGN = range(5)


class DriverState(ArrayStruct):
    """The arrays.

    Attributes:
        kinds: (k, 32) limits of each kind of car.
        floats: (capacity, 8); `ints` (capacity, 20).
        lane_window: (capacity, 8) lane numbers around each car on its route.
        routes: All routes, concatenated.
        stood: (capacity,) since when each station's CAMs report standstill; NEVER_NS: it moves.
        stood_at: (capacity, 2) where [m].
    """

    kinds: Floats
    floats: Floats
    ints: Ints
    lane_window: Ints
    routes: Ints
    stood: Ints
    stood_at: Floats


def kind_row(limits: CarLimits, sharpest: float) -> Floats:
    """Return a kind of car's row; `sharpest` is the map's largest jump of steering angle [rad]."""
    speeds = limits.speeds
    if len(speeds) > MAX_SPEEDS:
        at = np.linspace(0.0, 1.0, MAX_SPEEDS + 1)[1:]
        known = np.linspace(0.0, 1.0, len(speeds) + 1)
        speeds = tuple(np.interp(at, known, (0.0, *speeds)).tolist())
    row = np.zeros(SPEEDS + MAX_SPEEDS)
    row[:SPEEDS] = (
        limits.wheelbase, limits.steer_limit, limits.steer_rate, limits.front, limits.rear,
        limits.width, limits.accel, limits.decel, limits.lateral_accel, limits.brake_throttle,
        sharpest / limits.steer_rate, len(speeds),
    )  # fmt: skip
    row[SPEEDS : SPEEDS + len(speeds)] = speeds
    return row


def empty_state(capacity: int) -> DriverState:
    """Return the state of a batch without cars."""
    ints = np.zeros((capacity, INTS), np.int64)
    ints[:, LAST_NS] = NEVER_NS
    return DriverState(
        kinds=np.zeros((0, SPEEDS + MAX_SPEEDS)),
        floats=np.zeros((capacity, 8)),
        ints=ints,
        lane_window=np.full((capacity, WINDOW_SIZE), -1, np.int64),
        routes=np.zeros(0, np.int64),
        stood=np.full(capacity, NEVER_NS, np.int64),
        stood_at=np.zeros((capacity, 2)),
    )
