"""Speed advice for green lights (GLOSA): come to a red line no sooner than its green can begin.

    v (t + 1/k) + v^2 / (2 a) = d       v: the speed that needs t until it would have to brake for
                                        a stop after d, with deceleration a, its end at rate k

A red that SPATEM promises until t cannot end sooner, so who slows down for it loses next to
nothing, and no advice is above what the car would drive without. Each car that stands or comes
before the own one adds the time that it needs to leave. Who would have to go slower than the floor
goes at the floor, and stops. A promise holds whatever its age: the earliest end never moves back.
The car still obeys its signal: advice only takes speed away, and gently. Nobody is slowed down
before its tail is out of the last junction.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.ahead import REAR_AT
from scm.vehicles.drivers.memory import BEHIND, DECEL, FRONT, HERE, PACE, REAR, S
from scm.vehicles.drivers.pace import END_RATE
from scm.vehicles.drivers.signal_table import RED, Told, frame_for
from scm.vehicles.drivers.stop_lines import SHORT_OF_LINE
from scm.vehicles.drivers.streets import GROUP, JUNCTION, Ways
from scm.vehicles.jit import law

HORIZON = 4.0
FLOOR = 0.3
HEADWAY = 1.5
EASE = 0.25
LONGEST_PROMISE_NS = 60_000_000_000


@law
def arriving_speed(distance: float, wait: float, decel: float) -> float:
    """Return how fast to go so as to begin to brake for a stop only after a time [m/s].

    Args:
        distance: To where the front would stop [m].
        wait: The time [s].
        decel: Of the stop, see `pace` [m/s^2].
    """
    drawn = wait + 1.0 / END_RATE
    return decel * (math.sqrt(drawn * drawn + 2.0 * max(0.0, distance) / decel) - drawn)


@law
def advised_speed(
    distance: float, wait: float, decel: float, allowed: float, floor: float
) -> float:
    """Return the speed to come to a line with [m/s]: `allowed` where slowing down is of no use.

    Args:
        distance: To where the front would stop [m].
        wait: Until it may pass [s]; 0 or less: it may now, or nobody knows.
        decel: Comfortable [m/s^2].
        allowed: What it would drive without advice [m/s].
        floor: The least speed worth advising [m/s].
    """
    if wait <= 0.0:
        return allowed
    speed = arriving_speed(distance, wait, decel)
    return min(allowed, max(floor, speed))


@law
def red_for(told: Told, group: int, junction: int, place: int, now_ns: int) -> float:
    """Return for how long a group stays red at least by a frame [s]; 0 or less: not known."""
    if place < 0 or told.fault[junction] or told.flashing[place, junction]:
        return 0.0
    age_ns = now_ns - told.arrived_ns[place, junction]
    left = told.min_end[place, group] - 1e-9 * age_ns
    if told.colour[place, group] != RED or age_ns > LONGEST_PROMISE_NS or math.isnan(left):
        return 0.0
    return float(left)


@law
def is_clear(ways: Ways, sight: Ints, s: float, rear: float, at: int, line: int) -> bool:
    """Return whether no junction lies between a car's tail and a line on lane `at` in sight."""
    begin, first = -s, HERE
    if s < rear and sight[BEHIND] >= 0:
        begin, first = -s - ways.length[sight[BEHIND]], BEHIND
    for there in range(first, at + 1):
        lane = sight[there]
        end = ways.line_at[line] if there == at else math.inf
        for stretch in range(ways.stretch_first[lane], ways.stretch_first[lane + 1]):
            if ways.stretches[stretch, 0] < end and begin + ways.stretches[stretch, 1] > -rear:
                return False
        begin += ways.length[lane]
    return True


@law
def advice(
    ways: Ways,
    told: Told,
    kind: Floats,
    floats: Floats,
    sight: Ints,
    ahead: Floats,
    found: int,
    car: int,
    line: int,
    at: int,
    distance: float,
    allowed: float,
    passed: float,
    now_ns: int,
    seed: int,
) -> float:
    """Return the speed to approach a line with, `distance` ahead of the rear axle [m/s].

    `ahead` are the cars ahead, `found` of them, `passed` is the time since the last decision [s].
    """
    if not is_clear(ways, sight, floats[S], kind[REAR], at, line):
        return allowed
    junction = ways.line_links[line, JUNCTION]
    place = frame_for(told, junction, car, now_ns, seed)
    wait = red_for(told, ways.line_links[line, GROUP], junction, place, now_ns)
    if wait <= 0.0:
        return allowed
    for other in range(found):
        wait += HEADWAY if ahead[other, REAR_AT] < distance else 0.0
    room = distance - kind[FRONT] - SHORT_OF_LINE
    floor = FLOOR * ways.rules.limit[line]
    wished = advised_speed(room, wait, kind[DECEL], allowed, floor)
    eased = floats[PACE] - EASE * max(0.0, passed)
    return float(min(allowed, max(wished, eased)))
