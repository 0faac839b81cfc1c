"""How likely a deviation is of an honest car: 1 within the tolerance, the normal tail beyond it.

one number   p = erfc(d / sqrt 2)    d = max(0, |r| - tolerance) / sigma
a place      p = exp(-d^2 / 2)       the chi-squared tail of two dimensions
two cars     p of the depth by which their outlines overlap
"""

import math

LEAST = 1e-9  # plausibility; sure enough, and its logarithm is finite
_ROOT2 = math.sqrt(2.0)


def of_number(deviation: float, tolerance: float, sigma: float) -> float:
    """Return the plausibility of a deviation from what should be, either way."""
    beyond = abs(deviation) - tolerance
    if beyond <= 0.0:
        return 1.0
    return max(LEAST, math.erfc(beyond / (sigma * _ROOT2)))


def at_most(value: float, most: float, sigma: float) -> float:
    """Return the plausibility of a value that should not be above `most`."""
    beyond = value - most
    if beyond <= 0.0:
        return 1.0
    return max(LEAST, math.erfc(beyond / (sigma * _ROOT2)))


def of_place(away_m: float, tolerance_m: float, sigma_m: float) -> float:
    """Return the plausibility of a distance from the expected position."""
    beyond = away_m - tolerance_m
    if beyond <= 0.0:
        return 1.0
    return max(LEAST, math.exp(-0.5 * min(40.0, (beyond / sigma_m) ** 2)))


Box = tuple[float, float, float, float, float]
"""Middle x, y [m], yaw [rad], length, width [m]."""


def overlap_m(one: Box, other: Box) -> float:
    """Return how deep two rectangles overlap, the shortest way to separate them; 0: apart."""
    ax, ay, ayaw, alength, awidth = one
    bx, by, byaw, blength, bwidth = other
    dx, dy = bx - ax, by - ay
    reach = 0.5 * (math.hypot(alength, awidth) + math.hypot(blength, bwidth))
    if dx * dx + dy * dy >= reach * reach:
        return 0.0
    ca, sa, cb, sb = math.cos(ayaw), math.sin(ayaw), math.cos(byaw), math.sin(byaw)
    c, s = abs(ca * cb + sa * sb), abs(ca * sb - sa * cb)
    depth = min(
        alength + blength * c + bwidth * s - 2.0 * abs(dx * ca + dy * sa),
        awidth + blength * s + bwidth * c - 2.0 * abs(dy * ca - dx * sa),
        blength + alength * c + awidth * s - 2.0 * abs(dx * cb + dy * sb),
        bwidth + alength * s + awidth * c - 2.0 * abs(dy * cb - dx * sb),
    )
    return max(0.0, 0.5 * depth)
