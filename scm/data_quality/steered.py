"""The curve that was driven against the curve that was steered, where tyres hardly slip."""

import math
from dataclasses import dataclass

import numpy as np

from scm.data_quality.track import Series, Track, clean, grid, held, long_gaps
from scm.recording.read import Recording
from scm.vehicles.car import Car

WIDTH_S = 0.3
STEP_S = 0.05
QUIET_MPS2 = 1.5
LATE_S = 0.15
SHORTEST_S = 5.0
STRAIGHT_RAD_S = 0.02
LEAST_SWING = 0.2


@dataclass(frozen=True, slots=True)
class Steered:
    """How turning follows steering.

    Attributes:
        alike: Correlation, negative where the car turns the other way.
        gain: Curvature driven over that of an angle of one unit of the command, times the
            wheelbase [rad a unit]; a small-angle figure.
        swing: From right to left of the command where this was seen, its outermost twentieths left
            out.
    """

    alike: float
    gain: float
    swing: float


def steered(recording: Recording, car: Car, movement: Series, poses: Track) -> Steered | None:
    """Return how turning follows steering; None where the drive does not show it."""
    if "command.steering" not in recording.channels or not car.has("body.wheelbase_m"):
        return None
    steering = clean(recording.channels["command.steering"])
    if len(steering.t) < 20:
        return None
    on = grid(poses.t[0], poses.t[-1], STEP_S, WIDTH_S, long_gaps(poses.t))
    if len(on.t) < SHORTEST_S / STEP_S:
        return None
    speed, rate = on.smooth(movement), on.smooth(Series(poses.t, poses.yaw), 1)
    wheels = on.smooth_even(held(steering, on.t - LATE_S))
    asked = speed * wheels / car.value("body.wheelbase_m")
    fast = np.percentile(np.abs(speed), 90)
    rows = (np.abs(speed) > 0.3 * fast) & (np.abs(speed * rate) < QUIET_MPS2)
    if rows.sum() < SHORTEST_S / STEP_S or rate[rows].std() < STRAIGHT_RAD_S:
        return None
    a, b = asked[rows] - asked[rows].mean(), rate[rows] - rate[rows].mean()
    both, own = float((a * b).sum()), float((a * a).sum())
    swing = float(np.ptp(np.percentile(steering.values, (5, 95))))
    if own <= 0.0 or swing < LEAST_SWING * float(np.abs(steering.values).max()):
        return None
    seen = float(np.ptp(np.percentile(wheels[rows], (5, 95))))
    return Steered(both / math.sqrt(own * float((b * b).sum())), both / own, seen)
