"""Faces sorted by place: square cells, each with the faces and bodies that may be in it.

A face is listed in every cell that it crosses, so that whoever has looked at all cells within a
distance has seen everything within it.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats
from scm.vehicles.jit import array_kernel, kernel_function

Numbers = NDArray[np.int32]

CELLS_IN_REACH = 24.0
MIN_CELL_M = 0.5
MAX_CELLS = 4_000_000
ROUNDING = 1e-9


class Window(NamedTuple):
    """Which cells (i, j) there are, i across and j up; cell (0, 0) begins at the map's origin.

    Attributes:
        size: Edge of a cell [m].
        i0, j0: The first cell; `ni`, `nj`: how many there are each way.
    """

    size: float
    i0: int
    j0: int
    ni: int
    nj: int


class Cells(NamedTuple):
    """What lies in each cell of a window.

    Attributes:
        starts: (ni * nj + 1,) where each cell's items begin; cells run along j first.
        items: Numbers of faces or bodies, cell after cell.
    """

    window: Window
    starts: Numbers
    items: Numbers


def cell_size(farthest: float) -> float:
    """Return the edge of cells that suits a scanner of some reach: a power of two, both in m."""
    return float(2.0 ** math.ceil(math.log2(max(farthest / CELLS_IN_REACH, MIN_CELL_M))))


class WallGrid:
    """Everything that never moves, sorted once for each size of cells that is asked for.

    Args:
        edges: (m, 4) x0, y0, x1, y1 of each face, map frame [m].
    """

    def __init__(self, edges: Floats) -> None:
        self.edges = np.ascontiguousarray(edges, dtype=np.float64).reshape(-1, 4)
        self._by_size: dict[float, Cells] = {}

    def cells(self, size: float, around: Window) -> Cells:
        """Return the numbers of `edges` by cells of a size [m].

        Walls that are spread too wide to be sorted once are sorted `around` a window, every time.
        """
        if size not in self._by_size:
            window = window_of(self.edges.reshape(-1, 2), size)
            if not fits(window):
                return _sorted(self.edges, 1, around)
            self._by_size[size] = _sorted(self.edges, 1, window)
        return self._by_size[size]


def sort_bodies(outlines: Floats, window: Window) -> Cells:
    """Return four-faced bodies (4 n, 4) by those cells of a window that they reach into."""
    return _sorted(outlines, 4, window)


def window_of(points: Floats, size: float, margin: float = 0.0) -> Window:
    """Return the cells of a size about points (n, 2) and a margin around them [m]."""
    if len(points) == 0:
        return Window(size, 0, 0, 0, 0)
    low = np.floor((points.min(axis=0) - margin) / size - ROUNDING).astype(int)
    high = np.floor((points.max(axis=0) + margin) / size + ROUNDING).astype(int)
    ni, nj = (high - low + 1).tolist()
    return Window(size, int(low[0]), int(low[1]), ni, nj)


def fits(window: Window) -> bool:
    """Return whether a window has few enough cells to be laid out."""
    return window.ni * window.nj <= MAX_CELLS


def _sorted(edges: Floats, faces: int, window: Window) -> Cells:
    cells = window.ni * window.nj
    counts = np.zeros(cells + 1, np.int32)
    _list(edges, faces, window, counts, np.zeros(0, np.int32))
    starts = np.zeros(cells + 1, np.int32)
    np.cumsum(counts[:-1], out=starts[1:])
    items = np.empty(starts[-1], np.int32)
    _list(edges, faces, window, starts[:-1].copy(), items)
    return Cells(window, starts, items)


@array_kernel
def _list(edges: Floats, faces: int, window: Window, places: Numbers, items: Numbers) -> None:
    """Count items in `places`, or, given room for `items`, write each where its place says."""
    size, i0, j0, ni, nj = window
    for number in range(edges.shape[0] // faces):
        first, last = number * faces, (number + 1) * faces
        left, right = _span(edges, first, last, 0, size)
        low, high = _span(edges, first, last, 1, size)
        for i in range(max(left, i0), min(right, i0 + ni - 1) + 1):
            bottom, top = low, high
            if faces == 1:
                bottom, top = _within(edges[number], i * size, (i + 1) * size, size)
            for j in range(max(bottom, j0), min(top, j0 + nj - 1) + 1):
                cell = (i - i0) * nj + j - j0
                if len(items):
                    items[places[cell]] = number
                places[cell] += 1


@kernel_function
def _span(edges: Floats, first: int, last: int, axis: int, size: float) -> tuple[int, int]:
    """Return the first and the last column (or row) that some faces reach into."""
    low = high = edges[first, axis]
    for face in range(first, last):
        low = min(low, edges[face, axis], edges[face, axis + 2])
        high = max(high, edges[face, axis], edges[face, axis + 2])
    return math.floor(low / size - ROUNDING), math.floor(high / size + ROUNDING)


@kernel_function
def _within(edge: Floats, left: float, right: float, size: float) -> tuple[int, int]:
    """Return the rows that a face crosses between two abscissas."""
    x0, y0, x1, y1 = edge
    low, high = min(y0, y1), max(y0, y1)
    if x0 != x1:
        slope = (y1 - y0) / (x1 - x0)
        at_left, at_right = y0 + (left - x0) * slope, y0 + (right - x0) * slope
        low = max(low, min(at_left, at_right))
        high = min(high, max(at_left, at_right))
    return math.floor(low / size - ROUNDING), math.floor(high / size + ROUNDING)
