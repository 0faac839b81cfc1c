"""Straight sides: grey values along a side's normal, and quadrilaterals from four lines.

A quadrilateral's corners (4, 2) [px] go lower left, lower right, upper right, upper left of the
print, so its outside lies on the right of each side in a picture with y down. Side i runs from
corner i to the next; `offsets[i]` are the outward shifts of its two ends [px].
"""

import math

import numpy as np

from scm.arrays import Floats, Image
from scm.vehicles.jit import array_kernel, inlined

_ROUNDING = 1e-6


@inlined
def grey_at(grey: Image, x: float, y: float) -> float:
    """Return the interpolated grey; outside the frame, its edge's."""
    height, width = grey.shape
    x = min(max(x, 0.0), width - 1.0)
    y = min(max(y, 0.0), height - 1.0)
    left, top = int(x), int(y)
    right, bottom = min(left + 1, width - 1), min(top + 1, height - 1)
    u, v = x - left, y - top
    upper = (1.0 - u) * grey[top, left] + u * grey[top, right]
    lower = (1.0 - u) * grey[bottom, left] + u * grey[bottom, right]
    return float((1.0 - v) * upper + v * lower)


@inlined
def _grey_within(grey: Image, x: float, y: float) -> float:
    """Return the interpolated grey of four pixels inside the frame."""
    left, top = np.uint32(x), np.uint32(y)
    u, v = x - left, y - top
    upper = grey[top, left] + u * (grey[top, left + 1] - float(grey[top, left]))
    lower = grey[top + 1, left] + u * (grey[top + 1, left + 1] - float(grey[top + 1, left]))
    return float(upper + v * (lower - upper))


@array_kernel
def look_across(
    grey: Image, quad: Floats, side: int, along: float, reach: float, out: Floats
) -> None:
    """Write the grey along a side's normal, evenly from `reach` [px] inside to as far outside.

    Args:
        grey: The frame.
        quad: Corners.
        side: Which.
        along: Position on the side, 0 to 1 from its start.
        reach: Half the length sampled [px].
        out: Receives the grey, (m,).
    """
    end = (side + 1) % 4
    dx, dy = quad[end, 0] - quad[side, 0], quad[end, 1] - quad[side, 1]
    length = math.sqrt(dx * dx + dy * dy)
    nx, ny = -dy / length, dx / length
    x, y = quad[side, 0] + along * dx, quad[side, 1] + along * dy
    step = 2.0 * reach / (len(out) - 1)
    height, width = grey.shape
    margin_x, margin_y = reach * abs(nx) + _ROUNDING, reach * abs(ny) + _ROUNDING
    if margin_x <= x < width - 1.0 - margin_x and margin_y <= y < height - 1.0 - margin_y:
        for m in range(len(out)):
            s = m * step - reach
            out[m] = _grey_within(grey, x + s * nx, y + s * ny)
        return
    for m in range(len(out)):
        s = m * step - reach
        out[m] = grey_at(grey, x + s * nx, y + s * ny)


@array_kernel
def move_sides(quad: Floats, offsets: Floats, lines: Floats) -> bool:
    """Move the sides outwards and the corners to their intersections.

    Args:
        quad: Corners, changed in place.
        offsets: Of the start and the end of each side [px], (4, 2).
        lines: Work array, (4, 3).

    Returns:
        Whether they still form a convex quadrilateral of the same orientation.
    """
    for i in range(4):
        j = (i + 1) % 4
        dx, dy = quad[j, 0] - quad[i, 0], quad[j, 1] - quad[i, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if not length > 1.0:
            return False
        nx, ny = -dy / length, dx / length
        ax, ay = quad[i, 0] + offsets[i, 0] * nx, quad[i, 1] + offsets[i, 0] * ny
        bx, by = quad[j, 0] + offsets[i, 1] * nx, quad[j, 1] + offsets[i, 1] * ny
        lines[i, 0], lines[i, 1] = by - ay, ax - bx
        lines[i, 2] = lines[i, 0] * ax + lines[i, 1] * ay
    for i in range(4):
        a, b = (i + 3) % 4, i
        across = lines[a, 0] * lines[b, 1] - lines[a, 1] * lines[b, 0]
        if not across < 0.0:
            return False
        quad[i, 0] = (lines[a, 2] * lines[b, 1] - lines[a, 1] * lines[b, 2]) / across
        quad[i, 1] = (lines[a, 0] * lines[b, 2] - lines[a, 2] * lines[b, 0]) / across
    return True


@array_kernel
def cell_px(quad: Floats) -> float:
    """Return the mean edge of a tag's cell [px]; 0 for the wrong orientation."""
    ax, ay = quad[2, 0] - quad[0, 0], quad[2, 1] - quad[0, 1]
    bx, by = quad[3, 0] - quad[1, 0], quad[3, 1] - quad[1, 1]
    area = 0.5 * (ay * bx - ax * by)
    return math.sqrt(max(area, 0.0)) / 8.0
