"""Placing many cars of a fleet at once: directions by which all rows get the same bits."""

import numpy as np

from scm.arrays import Floats
from scm.vehicles.jit import array_kernel
from scm.vehicles.lane_math import sin_cos


def directions(angles: Floats) -> Floats:
    """Return sines and cosines of angles (n,), (2, n); the same for an angle wherever it stands."""
    out: Floats = np.empty((2, len(angles)))
    _directions(np.ascontiguousarray(angles, dtype=np.float64), out)
    return out


@array_kernel
def _directions(angles: Floats, out: Floats) -> None:
    for i in range(len(angles)):
        out[0, i], out[1, i] = sin_cos(angles[i])
