"""How long each light must last at least, from how cars move. Plain physics, nothing copied.

    yellow     Y = t_pr + v / (2 a)                who cannot stop before the line reaches it
    clearance  R = (W + L) / v_slow                who passed it last is out before others start
    green      G = n t_pr + v / (2 a_start) + (n - 1) (L + gap) / v_slow     n cars leave a queue
    headway    h = t_pr + (L + gap) / v_slow          each of them is so much behind the one before

v is the fastest approach, v_slow the slowest car, W the way from the stop line to the end of the
conflict, L a car's length. The two formulas for yellow and clearance are those of traffic
engineering (ITE; Gazis, Herman, Maradudin 1960), the queue's is kinematics: the n-th driver starts
n reactions after the light, gets up to speed, and drives as far as it stood from the line.

The values that regulations print (yellow of 3 to 6 s) are for full-size cars and not used: a 1:14
car at 0.25 m/s drives as if full size at 13 km/h, needs less yellow and much more clearance.
"""

import math
from dataclasses import dataclass

from scm.errors import PlanError

SPEED_OVER_LIMIT = 1.1  # times a lane's limit a car may come whose top speed is unknown
LANE_MPS = 0.25  # what our maps' lanes allow, for cars whose own speed is not known


@dataclass(frozen=True, slots=True)
class CarFacts:
    """The cars a junction must be safe for; the defaults are the nominal Nigel's.

    Attributes:
        speed_mps: Fastest approach; Nigel's throttle-speed table ends at 0.267. Infinite: it
            is only known to keep to the lane's limit, within a tenth.
        slow_mps: The slowest car that drives on through; Nigel at 0.8 of its throttle. Infinite:
            as fast as the lane allows.
        decel_mps2: Comfortable braking; ours, the drivers' own limit.
        accel_mps2: Getting away from a stop; ours, the drivers' own limit.
        reaction_s: From seeing a change to acting on it: one SPATEM at 2 Hz is sent at once on
            change, so radio, a 50 Hz driver and the servo remain.
        length_m: Bumper to bumper; footprint of AutoDRIVE's planner.
        gap_m: Between cars in a queue; ours, half a car.
    """

    speed_mps: float = 0.267
    slow_mps: float = 0.217
    decel_mps2: float = 0.5
    accel_mps2: float = 0.5
    reaction_s: float = 0.3
    length_m: float = 0.30
    gap_m: float = 0.15


NIGEL = CarFacts()


def yellow_s(car: CarFacts, limit_mps: float = math.inf) -> float:
    """Return the minimum yellow [s] on a level road.

    Args:
        car: Its top speed decides where that is finite, whatever the lane allows: yellow is for
            the fastest approach that is possible.
        limit_mps: The lane's speed limit; used, with `SPEED_OVER_LIMIT`, only for a car whose top
            speed is infinite, which means unknown.

    Raises:
        PlanError: when neither the car's top speed nor the limit is finite.
    """
    speed_mps = car.speed_mps if math.isfinite(car.speed_mps) else SPEED_OVER_LIMIT * limit_mps
    if not math.isfinite(speed_mps):
        raise PlanError("yellow: got neither a car's top speed nor a limit, expected one of them")
    return car.reaction_s + speed_mps / (2.0 * car.decel_mps2)


def clearance_s(car: CarFacts, way_m: float, limit_mps: float) -> float:
    """Return the least all-red [s] for a way from stop line to end of conflict [m]."""
    return (way_m + car.length_m) / min(car.slow_mps, limit_mps)


def headway_s(car: CarFacts, limit_mps: float = LANE_MPS) -> float:
    """Return by how much later each next car of a queue passes the line [s]."""
    return car.reaction_s + (car.length_m + car.gap_m) / min(car.slow_mps, limit_mps)


def min_green_s(car: CarFacts, limit_mps: float, queue: int = 2) -> float:
    """Return the least green [s] in which the `queue`-th waiting car passes the line."""
    slow_mps = min(car.slow_mps, limit_mps)
    to_line_m = (queue - 1) * (car.length_m + car.gap_m)
    return queue * car.reaction_s + slow_mps / (2.0 * car.accel_mps2) + to_line_m / slow_mps
