"""When a car is parked: it stands, and its rear axle is within tolerances of its goal."""

import numpy as np

from scm.arrays import Bools, Floats

TOLERANCE_M, TOLERANCE_RAD = 0.03, 0.05  # the AutoDRIVE paper's are 0.05 m and 0.0873 rad
STANDS_MPS = 0.02  # a car that is no faster stands


def is_parked(
    away_m: Floats | float, turned_rad: Floats | float, speed_mps: Floats | float,
    within_m: float = TOLERANCE_M, within_rad: float = TOLERANCE_RAD,
) -> Bools:  # fmt: skip
    """Return which cars are parked, of any shape.

    Args:
        away_m: From the rear axle to its goal.
        turned_rad: From the goal's direction to the car's, -pi to pi.
        speed_mps: Along the body.
        within_m: Tolerance of the place.
        within_rad: Tolerance of the direction.
    """
    is_there = (np.abs(away_m) < within_m) & (np.abs(turned_rad) < within_rad)
    return np.asarray(is_there & (np.abs(speed_mps) <= STANDS_MPS))
