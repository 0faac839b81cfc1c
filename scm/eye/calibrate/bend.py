"""What a lens that bends a tag's sides does to its corners as they are found.

A tag's corners are where straight lines through its sides meet. Seen through a wide lens a side is
a bow, and its line lies inside of its ends. With a lens that is nearly right that can be foretold:
straight lines are laid through the sides as the lens shows them, and what they meet off the true
corners is taken off the corners found.
"""

import numpy as np

from scm.arrays import Floats
from scm.eye.calibrate.board import View

_PLACES = (np.arange(16) + 1.0) / 17.0
"""Along a side, where the library looks at it."""


def along_sides(points: Floats) -> Floats:
    """Return places along the sides of tags, (n, 4, 16, 3), of their corners (n, 4, 3) [m]."""
    ends = np.roll(points, -1, axis=1)
    found: Floats = points[:, :, None] + _PLACES[:, None] * (ends - points)[:, :, None]
    return found


def met(sides: Floats) -> Floats:
    """Return where straight lines through pixels along sides (n, 4, m, 2) meet, (n, 4, 2) [px]."""
    middle = sides.mean(axis=2)
    spread = sides - middle[:, :, None]
    normal = np.linalg.eigh(spread.swapaxes(2, 3) @ spread)[1][..., 0]
    reach = (normal * middle).sum(axis=-1)
    both = np.stack((np.roll(normal, 1, axis=1), normal), axis=2)
    found = np.linalg.solve(both, np.stack((np.roll(reach, 1, axis=1), reach), axis=2)[..., None])
    return np.asarray(found[..., 0], dtype=np.float64)


def unbent(view: View, corners: Floats, sides: Floats) -> View:
    """Return a view of tags with its corners where the lens truly shows them.

    Args:
        view: As found.
        corners: Where a lens that is nearly right shows its points, (4 n, 2) [px].
        sides: Where it shows the places along its tags' sides, (n, 4, 16, 2) [px].
    """
    off = met(sides).reshape(-1, 2) - corners
    return View(view.name, view.points, view.pixels - off, view.tags)
