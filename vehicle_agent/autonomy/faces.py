"""Faces of what sweeps saw: many noisy points become few short lines, and the distances to these.

Points are counted in cells. In each cell that has some, a line is fitted to the points about it,
weighted by their distance (moving least squares), and the cell's mean is put onto it. So noise is
averaged over all sweeps, and a face lies within a fraction of a cell.

A face is one that was hit more often than beams went through it; what moved on is so removed.
Holds: faces farther apart than `SMOOTH_M`; a corner is rounded by about a third of that.
Sources: moving least squares, Levin 1998; log-odds of beams, Moravec and Elfes, ICRA 1985.
"""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.jit import array_kernel, inlined
from vehicle_agent.autonomy.grid_map import CELL_M, FREE, MAX_CELLS, OCCUPIED, UNKNOWN, Cells

BIN_M = 0.04  # of points that become one face
SMOOTH_M = 0.05  # standard deviation of the weights
AROUND = 3  # bins on each side that weigh anything
MIN_WEIGHT = 3.0  # of points, for a face
LINE = 0.5  # of the greater variance: a patch that is broader is drawn as a point
REACH_M = 0.2  # distances beyond it are cut off
BEHIND_M = 0.1  # of a face must a beam end that went through
"""Of a beam's end, else it is noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """Distances to the nearest face, at most `REACH_M`; frame and corner as those of `GridMap`."""

    to_face_m: Floats
    cell_m: float
    x_m: float
    y_m: float


def faces_of(points: Floats, origins: Floats) -> Floats:
    """Return the faces (k, 4) x0, y0, x1, y1 that points show.

    Args:
        points: (m, 2) where beams ended, map frame [m].
        origins: (m, 2) where they began.
    """
    if len(points) == 0:
        return np.zeros((0, 4))
    low, shape = _extent(points, BIN_M, 1)
    lines, cells = _lines(points, float(low[0]), float(low[1]), shape[0], shape[1])
    evidence = _evidence(points, origins, lines, cells, float(low[0]), float(low[1]))
    lines_left = lines[evidence > 0]
    half = lines_left[:, 2:4] * 0.75 * BIN_M
    return np.hstack((lines_left[:, :2] - half, lines_left[:, :2] + half))


def field_of(faces: Floats, cell_m: float = CELL_M) -> Field:
    """Return the distances to faces (k, 4), in cells of this width or, of a large place, wider."""
    ends = faces.reshape(-1, 2) if len(faces) else np.zeros((1, 2))
    size = ends.max(axis=0) - ends.min(axis=0) + 2.0 * REACH_M
    cell_m = max(cell_m, math.sqrt(float(size.prod()) / MAX_CELLS))
    low, shape = _extent(ends, cell_m, math.ceil(REACH_M / cell_m))
    to_face = _to_face(faces, float(low[0]), float(low[1]), cell_m, shape[0], shape[1])
    return Field(to_face, cell_m, float(low[0]), float(low[1]))


def _extent(points: Floats, cell_m: float, margin: int) -> tuple[Floats, tuple[int, int]]:
    """Return the lower left corner of cells that hold all points, and (rows, columns)."""
    low = (np.floor(points.min(axis=0) / cell_m) - margin) * cell_m
    columns, rows = np.ceil((points.max(axis=0) - low) / cell_m).astype(int) + margin
    return low, (int(rows), int(columns))


@array_kernel
def _lines(points: Floats, x_m: float, y_m: float, rows: int, columns: int) -> tuple[Floats, Ints]:
    """Return lines (k, 5) x, y, direction, hits; and the number of each bin's line, or -1."""
    count, sums = np.zeros((rows, columns)), np.zeros((rows, columns, 5))
    for k in range(len(points)):
        i, j = math.floor((points[k, 1] - y_m) / BIN_M), math.floor((points[k, 0] - x_m) / BIN_M)
        x, y = points[k, 0] - x_m, points[k, 1] - y_m
        count[i, j] += 1.0
        sums[i, j, 0] += x
        sums[i, j, 1] += y
        sums[i, j, 2] += x * x
        sums[i, j, 3] += x * y
        sums[i, j, 4] += y * y
    lines, cells = np.empty((np.count_nonzero(count), 5)), np.full((rows, columns), -1)
    found = 0
    for i in range(rows):
        for j in range(columns):
            if count[i, j] == 0.0:
                continue
            x0, y0 = sums[i, j, 0] / count[i, j], sums[i, j, 1] / count[i, j]
            total, mean = 0.0, np.zeros(5)
            for a in range(max(0, i - AROUND), min(rows, i + AROUND + 1)):
                for b in range(max(0, j - AROUND), min(columns, j + AROUND + 1)):
                    n = count[a, b]
                    if n > 0.0:
                        off = (sums[a, b, 0] / n - x0) ** 2 + (sums[a, b, 1] / n - y0) ** 2
                        w = math.exp(-0.5 * off / SMOOTH_M**2)
                        total += w * n
                        for p in range(5):
                            mean[p] += w * sums[a, b, p]
            if total < MIN_WEIGHT:
                continue
            mean /= total
            xx, yy = mean[2] - mean[0] ** 2, mean[4] - mean[1] ** 2
            xy = mean[3] - mean[0] * mean[1]
            angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
            ux, uy = math.cos(angle), math.sin(angle)
            half, apart = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
            along = (x0 - mean[0]) * ux + (y0 - mean[1]) * uy
            is_line = half - apart < LINE * (half + apart)
            lines[found, 0] = x_m + (mean[0] + along * ux if is_line else x0)
            lines[found, 1] = y_m + (mean[1] + along * uy if is_line else y0)
            lines[found, 2] = ux if is_line else 0.0
            lines[found, 3] = uy if is_line else 0.0
            lines[found, 4] = count[i, j]
            cells[i, j] = found
            found += 1
    return lines[:found], cells


@array_kernel
def _evidence(
    points: Floats, origins: Floats, lines: Floats, cells: Ints, x_m: float, y_m: float
) -> Floats:
    """Return how many beams ended at each line, less those that went through it."""
    evidence = lines[:, 4].copy()
    for k in range(len(points)):
        x, y = (origins[k, 0] - x_m) / BIN_M, (origins[k, 1] - y_m) / BIN_M
        dx, dy = (points[k, 0] - x_m) / BIN_M - x, (points[k, 1] - y_m) / BIN_M - y
        length = math.hypot(dx, dy) * BIN_M
        if length <= BEHIND_M:
            continue
        i, j = math.floor(y), math.floor(x)
        to_i, a_row = to_border(y, dy, i)
        to_j, a_column = to_border(x, dx, j)
        gone, last = 0.0, 1.0 - BEHIND_M / length
        while gone <= last:
            if 0 <= i < cells.shape[0] and 0 <= j < cells.shape[1] and cells[i, j] >= 0:
                m = cells[i, j]
                if _is_through(origins[k], points[k], lines[m]):
                    evidence[m] -= 1.0
            gone = min(to_i, to_j)
            if to_i <= to_j:
                to_i, i = to_i + a_row, i + (1 if dy > 0.0 else -1)
            else:
                to_j, j = to_j + a_column, j + (1 if dx > 0.0 else -1)
    return evidence


@inlined
def to_border(at: float, way: float, cell: int) -> tuple[float, float]:
    """Return which share of a way leads to the next border of cells, and from border to border."""
    if abs(way) < 1e-12:
        return math.inf, math.inf
    return ((cell + 1 if way > 0.0 else cell) - at) / way, 1.0 / abs(way)


@inlined
def _is_through(origin: Floats, point: Floats, line: Floats) -> bool:
    """Return whether a beam crosses a line's piece and ends well behind it."""
    ux, uy = line[2], line[3]
    if ux == 0.0 and uy == 0.0:
        length = math.hypot(point[0] - origin[0], point[1] - origin[1])
        ux, uy = (origin[1] - point[1]) / length, (point[0] - origin[0]) / length
    before = (origin[0] - line[0]) * uy - (origin[1] - line[1]) * ux
    after = (point[0] - line[0]) * uy - (point[1] - line[1]) * ux
    if before * after >= 0.0 or abs(after) < BEHIND_M:
        return False
    part = before / (before - after)
    x = origin[0] + part * (point[0] - origin[0]) - line[0]
    y = origin[1] + part * (point[1] - origin[1]) - line[1]
    return bool(abs(x * ux + y * uy) < 0.5 * BIN_M)


@array_kernel
def _to_face(
    faces: Floats, x_m: float, y_m: float, cell_m: float, rows: int, columns: int
) -> Floats:
    """Return how far the middle of each cell is from the nearest face, at most `REACH_M`."""
    to_face = np.full((rows, columns), REACH_M)
    for m in range(len(faces)):
        ax, ay = faces[m, 0] - x_m, faces[m, 1] - y_m
        dx, dy = faces[m, 2] - faces[m, 0], faces[m, 3] - faces[m, 1]
        square = max(dx * dx + dy * dy, 1e-12)
        first = max(0, math.floor((min(ax, ax + dx) - REACH_M) / cell_m))
        last = min(columns, math.ceil((max(ax, ax + dx) + REACH_M) / cell_m))
        low = max(0, math.floor((min(ay, ay + dy) - REACH_M) / cell_m))
        high = min(rows, math.ceil((max(ay, ay + dy) + REACH_M) / cell_m))
        for i in range(low, high):
            for j in range(first, last):
                x, y = (j + 0.5) * cell_m - ax, (i + 0.5) * cell_m - ay
                part = min(max((x * dx + y * dy) / square, 0.0), 1.0)
                off = (x - part * dx) ** 2 + (y - part * dy) ** 2
                if off < to_face[i, j] ** 2:
                    to_face[i, j] = math.sqrt(off)
    return to_face


def cells_of(faces: Floats, points: Floats, origins: Floats, field: Field) -> Cells:
    """Return which cells of a field are occupied by faces, free as beams saw them, or unknown.

    Args:
        faces: (k, 4), map frame [m].
        points: (m, 2) where beams ended.
        origins: (m, 2) where they began.
        field: Of the faces.
    """
    corner, cell_m = (field.x_m, field.y_m), field.cell_m
    cells = np.full(field.to_face_m.shape, UNKNOWN, np.int8)
    ends = (faces.reshape(-1, 2, 2) - corner) / cell_m
    _draw(cells, ends[:, 0], ends[:, 1], OCCUPIED)
    _draw(cells, (origins - corner) / cell_m, (points - corner) / cell_m, FREE)
    return cells


@array_kernel
def _draw(cells: Cells, begins: Floats, ends: Floats, state: int) -> None:
    """Set all cells that lines touch, in order; a line of free cells ends at an occupied one."""
    rows, columns = cells.shape
    for k in range(len(begins)):
        x, y = begins[k]
        dx, dy = ends[k, 0] - x, ends[k, 1] - y
        i, j = math.floor(y), math.floor(x)
        to_i, a_row = to_border(y, dy, i)
        to_j, a_column = to_border(x, dx, j)
        gone = 0.0
        while gone <= 1.0:
            if 0 <= i < rows and 0 <= j < columns:
                if state == FREE and cells[i, j] == OCCUPIED:
                    break
                cells[i, j] = state
            gone = min(to_i, to_j)
            if to_i <= to_j:
                to_i, i = to_i + a_row, i + (1 if dy > 0.0 else -1)
            else:
                to_j, j = to_j + a_column, j + (1 if dx > 0.0 else -1)
