"""Measures tags at their predicted places, without a search of the frame."""

import numpy as np

from scm.arrays import Bools, Floats, Image
from scm.eye.find.edges import MAX_PROFILE, WORK_ROWS, lay_coarse, lay_fine, shift_whole
from scm.eye.find.lines import cell_px
from scm.eye.find.read import RING, is_whole, judge, read_cells
from scm.vehicles.jit import array_kernel

BITS, BORDER, MARGIN = range(3)
"""Columns of a result: wrong bits of 36, wrong border cells of 28, decision margin [grey]."""
_MIN_CELL_PX = 1.5  # smaller cells cannot be read
REFINEMENTS = 2  # of the edges; a third changes nothing
_NOT_FOUND = 99.0


def measure(grey: Image, corners: Floats, white: Bools) -> tuple[Floats, Floats]:
    """Measure tags from predicted places, at most 1.5 cells off.

    Args:
        grey: The frame, contiguous.
        corners: Of each tag, (n, 4, 2) [px]; lower left, lower right, upper right, upper left.
        white: Which cells of each are white, (n, 8, 8), row from the bottom.

    Returns:
        The measured corners, (n, 4, 2), and a result for each, (n, 3); 99 wrong bits if no sides
        were found.
    """
    found = np.array(corners, dtype=np.float64, order="C")
    verdicts = np.empty((len(found), 3))
    work, lines, ends = np.empty((WORK_ROWS, MAX_PROFILE)), np.empty((4, 3)), np.empty((4, 2))
    codes, cells = np.ascontiguousarray(white), np.empty((RING, RING))
    _measure_all(grey, found, codes, work, lines, ends, cells, verdicts)
    return found, verdicts


@array_kernel
def _measure_all(
    grey: Image, quads: Floats, white: Bools, work: Floats, lines: Floats, ends: Floats,
    cells: Floats, verdicts: Floats,
) -> None:  # fmt: skip
    for n in range(len(quads)):
        verdicts[n, 0], verdicts[n, 1], verdicts[n, 2] = _NOT_FOUND, _NOT_FOUND, 0.0
        if _measure_one(grey, quads[n], work, lines, ends):
            read_cells(grey, quads[n], work[0], cells)
            judge(cells, white[n], lines, verdicts[n])


@array_kernel
def _measure_one(grey: Image, quad: Floats, work: Floats, lines: Floats, ends: Floats) -> bool:
    if not is_whole(grey, quad) or cell_px(quad) < _MIN_CELL_PX:
        return False
    if not shift_whole(grey, quad, work, lines, ends):
        return False
    if not lay_coarse(grey, quad, 1.0, work, lines, ends):
        return False
    if not lay_coarse(grey, quad, 0.6, work, lines, ends):
        return False
    for _ in range(REFINEMENTS):
        if not lay_fine(grey, quad, work, lines, ends):
            return False
    return is_whole(grey, quad)
