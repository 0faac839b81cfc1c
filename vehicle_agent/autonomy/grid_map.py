"""A map as the stages use it: square cells, and how far every point is from the nearest obstacle.

From a city's map, which has walls and boxes as outlines, or from a scanned grid. Frame: the map's,
x right and y up; row 0 is the lowest, column 0 the leftmost.
Holds: obstacles are as tall as the scanner, and what is not drawn on a city's map is free.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats
from scm.errors import MapError
from scm.maps.grid import OccupancyGrid
from scm.maps.segments import box_outline, wall_outlines
from scm.records.city_map import CityMap
from scm.vehicles.jit import inlined

CELL_M = 0.01
MAX_CELLS = 4_000_000
SUBCELL_BITS = 4  # of the corners that outlines are drawn by
FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""What a cell is, in the numbers of ROS's `nav_msgs/OccupancyGrid`."""

Cells = NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class GridMap:
    """Cells that are free, occupied or unknown. All arrays have shape (rows, columns).

    Attributes:
        cells: `FREE`, `OCCUPIED` or `UNKNOWN`.
        cell_m: Edge of a cell.
        x_m, y_m: Lower left corner of cell (0, 0).
        to_face_m: From each cell's middle to the nearest face that a scanner can see; of a scanned
            grid, to the middle of the nearest occupied cell.
        clearance_m: To the nearest place where no car may be, occupied or unknown; inside one,
            minus the way out.
    """

    cells: Cells
    cell_m: float
    x_m: float
    y_m: float
    to_face_m: Floats
    clearance_m: Floats


def grid_of_city(city_map: CityMap) -> GridMap:
    """Return the grid of a city's floor, walls and boxes; boxes that are not mapped are left out.

    Cells are `CELL_M` wide, wider where there would be more than `MAX_CELLS`. Distances are those
    to the outlines themselves, not to cells; where two outlines are about equally near, they may be
    a cell too long.

    Raises:
        MapError: when the map has neither floor nor walls.
    """
    by_thickness = sorted(city_map.walls, key=lambda wall: wall.thickness_m > 0.0)
    first_solid = sum(wall.thickness_m == 0.0 for wall in city_map.walls)
    solids = [wall_outlines(wall) for wall in by_thickness]
    solids += [[box_outline(box)] for box in city_map.boxes if box.mapped]
    left, low, right, high = _extent(city_map, solids)
    cell_m = max(CELL_M, math.sqrt((right - left) * (high - low) / MAX_CELLS))
    left, low, right, high = left - cell_m, low - cell_m, right + cell_m, high + cell_m
    shape = math.ceil((high - low) / cell_m), math.ceil((right - left) / cell_m)
    inside, lines = np.zeros(shape, np.uint8), np.zeros(shape, np.int32)
    faces: list[Sequence[float]] = []
    for number, outlines in enumerate(solids):
        drawn = [
            np.round(((np.array(one) - (left, low)) / cell_m - 0.5) * 2**SUBCELL_BITS).astype(int)
            for one in outlines
        ]
        if number >= first_solid:
            cv2.fillPoly(inside, drawn, OCCUPIED, cv2.LINE_8, SUBCELL_BITS)
        for outline, pixels in zip(outlines, drawn, strict=True):
            for ends, (a, b) in zip(
                itertools.pairwise(outline), itertools.pairwise(pixels), strict=True
            ):
                faces.append((*ends[0], *ends[1]))
                cv2.line(lines, a, b, len(faces), 1, cv2.LINE_8, SUBCELL_BITS)
    cells = np.where((inside > 0) | (lines > 0), OCCUPIED, FREE).astype(np.int8)
    free = (cells == FREE).astype(np.uint8)
    free[[0, -1]] = free[:, [0, -1]] = 0  # nobody looks from beyond the floor
    seen = cv2.dilate(free, np.ones((3, 3), np.uint8)) > 0
    to_face = _to_face(
        np.where(seen, lines, 0), np.array(faces).reshape(-1, 4), (left, low), cell_m
    )
    clearance = np.where(inside > 0, -to_face, to_face)
    return GridMap(cells, cell_m, left, low, to_face, clearance)


def grid_of_cells(cells: Cells, cell_m: float, x_m: float, y_m: float) -> GridMap:
    """Return a grid of cells, as a scanner made them; arguments as those of `GridMap`."""
    blocked = cells != FREE
    clearance = np.where(blocked, 0.5 - _distance(blocked), _distance(~blocked) - 0.5) * cell_m
    return GridMap(cells, cell_m, x_m, y_m, _distance(cells != OCCUPIED) * cell_m, clearance)


def grid_of_scan(scanned: OccupancyGrid) -> GridMap:
    """Return a scanned grid's cells.

    Raises:
        MapError: when the scan's cells are turned against its frame.
    """
    if scanned.origin.yaw != 0.0:
        msg = f"{scanned.name}: origin: expected a yaw of 0, got {scanned.origin.yaw:g} rad"
        raise MapError(msg)
    cells = np.where(scanned.occupied, OCCUPIED, np.where(scanned.free, FREE, UNKNOWN))
    return grid_of_cells(cells.astype(np.int8), scanned.cell_m, scanned.origin.x, scanned.origin.y)


def with_points(grid: GridMap, points: Floats) -> GridMap:
    """Return a grid with more obstacles, points (n, 2) [m]; those outside it are left out.

    Clearance and cells change, and `to_face_m` does not: it is of what the map shows.
    """
    place = np.floor((points - (grid.x_m, grid.y_m)) / grid.cell_m).astype(np.int64)
    rows, columns = grid.cells.shape
    inside = ((place >= 0) & (place < (columns, rows))).all(axis=1)
    points, (column, row) = points[inside], place[inside].T
    lines = np.zeros(grid.cells.shape, np.int32)
    lines[row, column] = np.arange(1, len(points) + 1)
    to_point = _to_face(lines, np.hstack((points, points)), (grid.x_m, grid.y_m), grid.cell_m)
    return replace(
        grid,
        cells=np.where(lines > 0, OCCUPIED, grid.cells).astype(np.int8),
        clearance_m=np.minimum(grid.clearance_m, to_point),
    )


def _distance(cells: Bools) -> Floats:
    """Return how far each cell is from the nearest that is not marked, middle to middle [cells]."""
    if cells.all():
        return np.full(cells.shape, math.hypot(*cells.shape))
    picture = cells.astype(np.uint8)
    return cv2.distanceTransform(picture, cv2.DIST_L2, cv2.DIST_MASK_PRECISE).astype(np.float64)


def _to_face(
    lines: NDArray[np.int32], faces: Floats, corner: Sequence[float], cell_m: float
) -> Floats:
    """Return how far the middle of each cell is from the nearest face [m].

    Args:
        lines: Number of the face, from 1, that was drawn on a cell; 0: none.
        faces: (m, 4) x0, y0, x1, y1 [m].
        corner: Lower left one of cell (0, 0) [m].
        cell_m: Edge of a cell.
    """
    if len(faces) == 0:
        return np.full(lines.shape, cell_m * math.hypot(*lines.shape))
    empty = (lines == 0).astype(np.uint8)
    _, labels = cv2.distanceTransformWithLabels(
        empty, cv2.DIST_L2, cv2.DIST_MASK_PRECISE, labelType=cv2.DIST_LABEL_PIXEL
    )
    number = np.zeros(labels.max() + 1, np.int64)
    number[labels[lines > 0]] = lines[lines > 0] - 1
    nearest = faces[number[labels]]
    rows, columns = np.indices(lines.shape)
    x = corner[0] + (columns + 0.5) * cell_m - nearest[..., 0]
    y = corner[1] + (rows + 0.5) * cell_m - nearest[..., 1]
    dx, dy = nearest[..., 2] - nearest[..., 0], nearest[..., 3] - nearest[..., 1]
    part = np.clip((x * dx + y * dy) / np.maximum(dx * dx + dy * dy, 1e-12), 0.0, 1.0)
    return np.hypot(x - part * dx, y - part * dy)


def _extent(
    city_map: CityMap, solids: Sequence[Sequence[Sequence[tuple[float, float]]]]
) -> tuple[float, float, float, float]:
    """Return left, low, right and high edge of floor and solids."""
    points = [point for outlines in solids for outline in outlines for point in outline]
    floor = city_map.floor
    if floor is not None:
        points += zip(floor.x_m, floor.y_m, strict=True)
    if not points:
        raise MapError(f"{city_map.name}: expected a floor or walls to make a grid of, got none")
    corners = np.array(points)
    return (*map(float, corners.min(axis=0)), *map(float, corners.max(axis=0)))  # type: ignore[return-value]


@inlined
def value_at(field: Floats, column: float, row: float) -> float:
    """Return a field's value between the four middles of cells round a place; NaN outside.

    Args:
        field: (rows, columns).
        column: In cells from the field's corner, (x - x_m) / cell_m.
        row: Likewise, (y - y_m) / cell_m.
    """
    column, row = column - 0.5, row - 0.5
    i, j = math.floor(row), math.floor(column)
    if i < 0 or j < 0 or i + 1 >= field.shape[0] or j + 1 >= field.shape[1]:
        return math.nan
    up, right = row - i, column - j
    low = (1.0 - right) * field[i, j] + right * field[i, j + 1]
    high = (1.0 - right) * field[i + 1, j] + right * field[i + 1, j + 1]
    return float((1.0 - up) * low + up * high)
