"""Speed advice for green lights (GLOSA): reach a red line no sooner than its green can begin.

    v (t + 1/k) + v^2 / (2 a) = d       v: the speed that needs t until it would have to brake for
                                        a stop after d, with deceleration a, its end at rate k

A red that SPATEM guarantees until t cannot end sooner, so a car that slows down for it loses almost
nothing. Advice is never above the speed without it. Each car ahead adds the time that it needs to
leave. A car that would have to go slower than the lowest advised speed drives at that speed and
stops. A guaranteed time holds at any age: the earliest end never moves back. The car still obeys
its signal: advice only reduces speed, and gently, and never before the car's rear has left the last
junction.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.cars_ahead import REAR_AT
from scm.vehicles.drivers.driver_state import BEHIND, DECEL, FRONT, HERE, REAR, SPEED_SETPOINT, S
from scm.vehicles.drivers.lane_graph import GROUP, JUNCTION, LaneArrays
from scm.vehicles.drivers.signal_table import RED, ReceivedSignals, frame_for
from scm.vehicles.drivers.speed_control import END_RATE
from scm.vehicles.drivers.stop_lines import SHORT_OF_LINE
from scm.vehicles.jit import kernel_function

HORIZON = 4.0  # distance to a line from which speed is advised [m]
MIN_SPEED_SHARE = 0.3  # lowest advised speed, of the limit
TIME_PER_CAR = 1.5  # that each car ahead needs to leave [s]
MAX_SLOWDOWN = 0.25  # [m/s^2]
MAX_GUARANTEE_NS = 60_000_000_000  # age after which a frame is ignored


@kernel_function
def arriving_speed(distance: float, wait: float, decel: float) -> float:
    """Return the speed at which braking for a stop begins only after a time [m/s].

    Args:
        distance: To where the front would stop [m].
        wait: The time [s].
        decel: Of the stop, see `pace` [m/s^2].
    """
    drawn = wait + 1.0 / END_RATE
    return decel * (math.sqrt(drawn * drawn + 2.0 * max(0.0, distance) / decel) - drawn)


@kernel_function
def advised_speed(
    distance: float, wait: float, decel: float, allowed: float, min_speed: float
) -> float:
    """Return the speed for the approach to a line [m/s]; `allowed` where slowing down is useless.

    Args:
        distance: To where the front would stop [m].
        wait: Until it may pass [s]; 0 or less: now, or unknown.
        decel: Comfortable [m/s^2].
        allowed: The speed without advice [m/s].
        min_speed: The lowest advised speed [m/s].
    """
    if wait <= 0.0:
        return allowed
    speed = arriving_speed(distance, wait, decel)
    return min(allowed, max(min_speed, speed))


@kernel_function
def red_for(signals: ReceivedSignals, group: int, junction: int, place: int, now_ns: int) -> float:
    """Return the minimum time that a group stays red by a frame [s]; 0 or less: unknown."""
    if place < 0 or signals.fault[junction] or signals.flashing[place, junction]:
        return 0.0
    age_ns = now_ns - signals.arrived_ns[place, junction]
    left = signals.min_end[place, group] - 1e-9 * age_ns
    if signals.colour[place, group] != RED or age_ns > MAX_GUARANTEE_NS or math.isnan(left):
        return 0.0
    return float(left)


@kernel_function
def is_clear(
    lanes: LaneArrays, lane_window: Ints, s: float, rear: float, at: int, line: int
) -> bool:
    """Return whether no junction is between a car's rear and a line on lane `at` of the window."""
    begin, first = -s, HERE
    if s < rear and lane_window[BEHIND] >= 0:
        begin, first = -s - lanes.length[lane_window[BEHIND]], BEHIND
    for there in range(first, at + 1):
        lane = lane_window[there]
        end = lanes.line_at[line] if there == at else math.inf
        for stretch in range(lanes.stretch_first[lane], lanes.stretch_first[lane + 1]):
            if lanes.stretches[stretch, 0] < end and begin + lanes.stretches[stretch, 1] > -rear:
                return False
        begin += lanes.length[lane]
    return True


@kernel_function
def advised_approach(
    lanes: LaneArrays,
    signals: ReceivedSignals,
    kind: Floats,
    floats: Floats,
    lane_window: Ints,
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
    """Return the speed for the approach to a line `distance` ahead of the rear axle [m/s].

    `ahead` holds `found` cars ahead; `passed` is the time since the last decision [s].
    """
    if not is_clear(lanes, lane_window, floats[S], kind[REAR], at, line):
        return allowed
    junction = lanes.line_links[line, JUNCTION]
    place = frame_for(signals, junction, car, now_ns, seed)
    wait = red_for(signals, lanes.line_links[line, GROUP], junction, place, now_ns)
    if wait <= 0.0:
        return allowed
    for other in range(found):
        wait += TIME_PER_CAR if ahead[other, REAR_AT] < distance else 0.0
    distance_left = distance - kind[FRONT] - SHORT_OF_LINE
    min_speed = MIN_SPEED_SHARE * lanes.rules.limit[line]
    target = advised_speed(distance_left, wait, kind[DECEL], allowed, min_speed)
    slowed = floats[SPEED_SETPOINT] - MAX_SLOWDOWN * max(0.0, passed)
    return float(min(allowed, max(target, slowed)))
