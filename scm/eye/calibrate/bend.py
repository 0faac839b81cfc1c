"""The error of a tag's detected corners caused by lens distortion of its sides.

A tag's corners are detected where straight lines through its sides meet. Through a wide lens a side
is curved, and its line lies inside of its ends. With an approximate lens this error can be
predicted: straight lines are fitted to the sides as the lens projects them, and the difference of
their intersections from the true corners is subtracted from the detected corners.
"""

import numpy as np

from scm.arrays import Floats
from scm.eye.calibrate.board import View

_PLACES = (np.arange(16) + 1.0) / 17.0
"""Positions along a side where the library samples it."""


def along_sides(points: Floats) -> Floats:
    """Return places along the sides of tags, (n, 4, 16, 3), of their corners (n, 4, 3) [m]."""
    ends = np.roll(points, -1, axis=1)
    found: Floats = points[:, :, None] + _PLACES[:, None] * (ends - points)[:, :, None]
    return found


def met(sides: Floats) -> Floats:
    """Return intersections of lines fitted to pixels along sides (n, 4, m, 2), (n, 4, 2) [px]."""
    middle = sides.mean(axis=2)
    spread = sides - middle[:, :, None]
    normal = np.linalg.eigh(spread.swapaxes(2, 3) @ spread)[1][..., 0]
    reach = (normal * middle).sum(axis=-1)
    both = np.stack((np.roll(normal, 1, axis=1), normal), axis=2)
    found = np.linalg.solve(both, np.stack((np.roll(reach, 1, axis=1), reach), axis=2)[..., None])
    return np.asarray(found[..., 0], dtype=np.float64)


def unbent(view: View, corners: Floats, sides: Floats) -> View:
    """Return a view of tags with its corners corrected for curved sides.

    Args:
        view: As detected.
        corners: Projected by an approximate lens, (4 n, 2) [px].
        sides: Points along the tags' sides, likewise projected, (n, 4, 16, 2) [px].
    """
    off = met(sides).reshape(-1, 2) - corners
    return View(view.name, view.points, view.pixels - off, view.tags)
