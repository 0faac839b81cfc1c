"""In which order a scanner looks at the cells around its own: the nearest first.

Bearings are told apart by 64 sectors, so that a set of them is the bits of one number.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats
from scm.vehicles.rays.grid import ROUNDING, Numbers

Bits = NDArray[np.uint64]

SECTORS = 64
WIDTH = 2.0 * math.pi / SECTORS


class Order(NamedTuple):
    """Cells by how near any of their points may be to any point of the scanner's own cell.

    Attributes:
        i, j: (t,) steps from the scanner's cell.
        near: (t,) that distance [m], rising.
        sectors: (t,) bit s is set when the cell can lie at bearings from s to s + 1 sectors,
            counter-clockwise from the map's x axis; all bits for the nine cells about the scanner.
    """

    i: Numbers
    j: Numbers
    near: Floats
    sectors: Bits


class Sectors(NamedTuple):
    """Which beams lie in each sector, counted from beam 0: begin[s] to end[s] - 1."""

    begin: Numbers
    end: Numbers


@cache
def order_of(size: float, farthest: float) -> Order:
    """Return all cells of a size that have a point within reach of a scanner [m]."""
    reach = math.ceil(farthest / size)
    steps = np.arange(-reach, reach + 1)
    i, j = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
    gap_i, gap_j = (np.maximum(np.abs(step) - 1, 0) * size for step in (i, j))
    near = np.hypot(gap_i, gap_j)
    near_cells = np.flatnonzero(near <= farthest)
    near_cells = near_cells[np.argsort(near[near_cells], kind="stable")]
    i, j, near = i[near_cells], j[near_cells], near[near_cells]
    centre = np.arctan2(j, i)
    # from any point of one cell to any point of the other: a square of twice the edge
    corners = np.stack([np.arctan2(j + b, i + a) for a in (-1, 1) for b in (-1, 1)])
    aside = (corners - centre + math.pi) % (2.0 * math.pi) - math.pi
    start, span = centre + aside.min(axis=0), aside.max(axis=0) - aside.min(axis=0)
    touches = np.maximum(np.abs(i), np.abs(j)) <= 1
    start, span = np.where(touches, 0.0, start), np.where(touches, 2.0 * math.pi, span)
    lows, highs = np.floor(start / WIDTH - ROUNDING), np.floor((start + span) / WIDTH + ROUNDING)
    sectors = np.array([_bits(int(a), int(b)) for a, b in zip(lows, highs, strict=True)], np.uint64)
    return Order(i.astype(np.int32), j.astype(np.int32), near, sectors)


def _bits(low: int, high: int) -> int:
    if high - low >= SECTORS - 1:
        return int(2**SECTORS - 1)
    bits = 0
    for sector in range(low, high + 1):
        bits |= 1 << (sector % SECTORS)
    return bits


@cache
def sectors_of(step: float, beams: int) -> Sectors:
    """Return the beams of each sector; there may be none."""
    edges = np.ceil(np.arange(SECTORS + 1) * (WIDTH / step) - ROUNDING).clip(0, beams)
    edges[-1] = beams
    return Sectors(edges[:-1].astype(np.int32), edges[1:].astype(np.int32))
