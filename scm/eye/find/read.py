"""Reads a tag's cells through the homography of its corners, and compares them with a code."""

import math

from scm.arrays import Bools, Floats, Image
from scm.eye.find.lines import grey_at
from scm.vehicles.jit import array_kernel

RING = 10
"""Cells along a print: the tag's 8 and a white margin of one on either side."""
_OFF_CENTRE = 0.22
"""Distance of a cell's nine sample points from its centre [cells]."""


@array_kernel
def read_cells(grey: Image, quad: Floats, h: Floats, cells: Floats) -> None:
    """Write the mean grey in the centre of each cell, margin included, (10, 10) from lower left.

    Args:
        grey: The frame.
        quad: Corners of the black square.
        h: Work array, at least 8.
        cells: Receives the grey.
    """
    _homography(quad, h)
    for row in range(RING):
        for column in range(RING):
            total = 0.0
            for j in range(-1, 2):
                v = (row - 0.5 + j * _OFF_CENTRE) / 8.0
                for i in range(-1, 2):
                    u = (column - 0.5 + i * _OFF_CENTRE) / 8.0
                    w = h[6] * u + h[7] * v + 1.0
                    x = (h[0] * u + h[1] * v + h[2]) / w
                    y = (h[3] * u + h[4] * v + h[5]) / w
                    total += grey_at(grey, x, y)
            cells[row, column] = total / 9.0


@array_kernel
def _homography(quad: Floats, h: Floats) -> None:
    """Write the homography from (0, 0), (1, 0), (1, 1), (0, 1) to the corners, 8 numbers."""
    sx = quad[0, 0] - quad[1, 0] + quad[2, 0] - quad[3, 0]
    sy = quad[0, 1] - quad[1, 1] + quad[2, 1] - quad[3, 1]
    ax, ay = quad[1, 0] - quad[2, 0], quad[1, 1] - quad[2, 1]
    bx, by = quad[3, 0] - quad[2, 0], quad[3, 1] - quad[2, 1]
    across = ax * by - bx * ay
    g, k = (sx * by - bx * sy) / across, (ax * sy - sx * ay) / across
    h[0], h[1], h[2] = quad[1, 0] * (1.0 + g) - quad[0, 0], quad[3, 0] * (1.0 + k) - quad[0, 0], 0.0
    h[3], h[4], h[5] = quad[1, 1] * (1.0 + g) - quad[0, 1], quad[3, 1] * (1.0 + k) - quad[0, 1], 0.0
    h[2], h[5], h[6], h[7] = quad[0, 0], quad[0, 1], g, k


@array_kernel
def judge(cells: Floats, white: Bools, plane: Floats, verdict: Floats) -> None:
    """Compare the cells with a code; write wrong bits, wrong border cells and margin.

    Black is a plane of grey through the border, white one through the margin around it; each cell's
    threshold is between the two. The decision margin is the mean distance from it [grey levels], of
    the white bits or of the black ones, whichever is smaller.

    Args:
        cells: Grey, (10, 10).
        white: Which of the tag's cells are white, (8, 8), row from the bottom.
        plane: Work array, at least (2, 3).
        verdict: Receives the three.
    """
    _ring_plane(cells, 1, plane[0])
    _ring_plane(cells, 0, plane[1])
    bits, border = 0, 0
    total_white, total_black, whites, blacks = 0.0, 0.0, 0, 0
    for row in range(8):
        for column in range(8):
            x, y = column - 3.5, row - 3.5
            black = plane[0, 0] + plane[0, 1] * x + plane[0, 2] * y
            light = plane[1, 0] + plane[1, 1] * x + plane[1, 2] * y
            above = cells[row + 1, column + 1] - 0.5 * (black + light)
            wrong = (above > 0.0) != white[row, column]
            if row in (0, 7) or column in (0, 7):
                border += wrong
                continue
            bits += wrong
            if white[row, column]:
                total_white += above
                whites += 1
            else:
                total_black -= above
                blacks += 1
    verdict[0], verdict[1] = float(bits), float(border)
    verdict[2] = min(total_white / max(1, whites), total_black / max(1, blacks))


@array_kernel
def _ring_plane(cells: Floats, ring: int, plane: Floats) -> None:
    """Write level and slopes of the plane through one ring of cells; by symmetry, sums suffice."""
    total, sx, sy, sxx, count = 0.0, 0.0, 0.0, 0.0, 0
    last = RING - 1 - ring
    for row in range(ring, RING - ring):
        for column in range(ring, RING - ring):
            if row in (ring, last) or column in (ring, last):
                x, y = column - 4.5, row - 4.5
                total += cells[row, column]
                sx += x * cells[row, column]
                sy += y * cells[row, column]
                sxx += x * x
                count += 1
    plane[0], plane[1], plane[2] = total / count, sx / sxx, sy / sxx


@array_kernel
def is_whole(grey: Image, quad: Floats) -> bool:
    """Return whether all corners are finite and in the frame."""
    height, width = grey.shape
    for i in range(4):
        x, y = quad[i, 0], quad[i, 1]
        if not (math.isfinite(x) and math.isfinite(y)):
            return False
        if not (0.0 <= x <= width - 1.0 and 0.0 <= y <= height - 1.0):
            return False
    return True
