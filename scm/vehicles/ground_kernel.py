"""What each wheel stands on, worked out for all cars of a fleet in one compiled call.

A wheel is a disc that rolls: it rests where its rim first meets the floor, not where its middle is.

    height(P) = max over t of floor(P + t u) - (r - sqrt(r^2 - t^2)),   |t| < r,   u: where it rolls

so an edge lifts it along a quarter of a circle, and the slope of `height` is how the edge pushes
back. Over a plane piece the maximum is exact; over a height map it is that of `LOOKS` places.
Holds: edges lower than `CLIMBS` of a wheel radius above the ground it stands on; what is higher is
not there for this wheel, which is how a car drives under a bridge.   Source: rolling a rigid disc
over a profile (the "enveloping" of road unevenness; J. Y. Wong, Theory of Ground Vehicles, 2008).
"""

import math
from typing import NamedTuple

from scm.arrays import Bools, Floats, Ints
from scm.vehicles.jit import array_kernel, law

CLIMBS = 0.7
RIM = 0.98  # of the radius: at the very rim the slope has no end
STEEPEST = 3.0
LOOKS = 4  # places looked at on each side of a wheel's middle
ANYTHING = 1e9


class Sheet(NamedTuple):
    """A floor as the kernel reads it; `scm/vehicles/ground.py` makes it.

    Attributes:
        frame: x and y of the lower left of the cells, their edge, grip and rolling of the floor.
        cells: Columns and rows.
        starts: (columns * rows + 1,) where each cell's shapes begin in `items`.
        items: Shapes that reach into a cell: patches by their number, then pieces of height.
        first: (shapes + 1,) where each shape's corners begin; a circle has none.
        corners: (k, 2) counter-clockwise.
        circles: (patches, 3) x, y, radius.
        holds: (patches, 2) grip and rolling.
        planes: (pieces, 3) height = at + rise_x x + rise_y y.
        friction: Grey 0 to 1 from the lowest row up; no rows: none.
        friction_frame: x, y of the picture's lower left, size of a pixel in x and y, then grip of
            black and white, rolling of black and white.
        heights: (rows, columns) from the lowest row up [m]; no rows: none.
        height_frame: As the first four of `friction_frame`.
    """

    frame: Floats
    cells: Ints
    starts: Ints
    items: Ints
    first: Ints
    corners: Floats
    circles: Floats
    holds: Floats
    planes: Floats
    friction: Floats
    friction_frame: Floats
    heights: Floats
    height_frame: Floats


@law
def is_inside(x: float, y: float, corners: Floats, low: int, high: int) -> bool:
    """Return whether a point lies in a polygon of any shape."""
    inside = False
    before = high - 1
    for i in range(low, high):
        if (corners[i, 1] > y) != (corners[before, 1] > y):
            share = (y - corners[i, 1]) / (corners[before, 1] - corners[i, 1])
            if x < corners[i, 0] + share * (corners[before, 0] - corners[i, 0]):
                inside = not inside
        before = i
    return inside


@law
def blend(picture: Floats, frame: Floats, x: float, y: float) -> tuple[float, float, float]:
    """Return value and gradient of a picture at a place, between pixels' middles, rim kept."""
    rows, columns = picture.shape
    u = min(max((x - frame[0]) / frame[2] - 0.5, 0.0), columns - 1.0)
    v = min(max((y - frame[1]) / frame[3] - 0.5, 0.0), rows - 1.0)
    i, j = min(int(u), columns - 2), min(int(v), rows - 2)
    p, q = u - i, v - j
    a, b = picture[j, i], picture[j, i + 1]
    c, d = picture[j + 1, i], picture[j + 1, i + 1]
    value = (1.0 - q) * ((1.0 - p) * a + p * b) + q * ((1.0 - p) * c + p * d)
    along_x = ((1.0 - q) * (b - a) + q * (d - c)) / frame[2]
    along_y = ((1.0 - p) * (c - a) + p * (d - b)) / frame[3]
    return value, along_x, along_y


@law
def over_hills(
    sheet: Sheet, x: float, y: float, ux: float, uy: float, radius: float
) -> tuple[float, float, float]:
    """Return height and gradient of a wheel over the height map."""
    best, best_x, best_y = -ANYTHING, 0.0, 0.0
    for k in range(-LOOKS, LOOKS + 1):
        t = RIM * radius * k / LOOKS
        value, rise_x, rise_y = blend(sheet.heights, sheet.height_frame, x + t * ux, y + t * uy)
        value += math.sqrt(radius * radius - t * t) - radius
        if value > best:
            best, best_x, best_y = value, rise_x, rise_y
    return best, best_x, best_y


@law
def over_piece(
    sheet: Sheet, shape: int, plane: int, x: float, y: float, ux: float, uy: float, radius: float
) -> tuple[float, float, float]:
    """Return height and gradient of a wheel over one plane piece; far below: it does not reach."""
    nearest, farthest = -RIM * radius, RIM * radius
    near_x, near_y, near_run = 0.0, 0.0, 0.0
    far_x, far_y, far_run = 0.0, 0.0, 0.0
    corners = sheet.corners
    low, high = sheet.first[shape], sheet.first[shape + 1]
    before = high - 1
    for i in range(low, high):
        inward_x = corners[before, 1] - corners[i, 1]
        inward_y = corners[i, 0] - corners[before, 0]
        away = inward_x * (x - corners[i, 0]) + inward_y * (y - corners[i, 1])
        run = inward_x * ux + inward_y * uy
        before = i
        if run > 0.0 and -away > nearest * run:
            nearest, near_x, near_y, near_run = -away / run, inward_x, inward_y, run
        elif run < 0.0 and -away > farthest * run:
            farthest, far_x, far_y, far_run = -away / run, inward_x, inward_y, run
        elif run == 0.0 and away < 0.0:
            return -ANYTHING, 0.0, 0.0
    if nearest > farthest:
        return -ANYTHING, 0.0, 0.0
    rise_x, rise_y = sheet.planes[plane, 1], sheet.planes[plane, 2]
    rise = rise_x * ux + rise_y * uy
    t = radius * rise / math.sqrt(1.0 + rise * rise)
    edge_x, edge_y, run = 0.0, 0.0, 0.0
    if t < nearest:
        t, edge_x, edge_y, run = nearest, near_x, near_y, near_run
    elif t > farthest:
        t, edge_x, edge_y, run = farthest, far_x, far_y, far_run
    drop = math.sqrt(radius * radius - t * t)
    height = sheet.planes[plane, 0] + rise_x * x + rise_y * y + rise * t + drop - radius
    if run != 0.0:
        steep = (t / drop - rise) / run
        rise_x, rise_y = rise_x + steep * edge_x, rise_y + steep * edge_y
    return height, rise_x, rise_y


@law
def cell_of(sheet: Sheet, x: float, y: float) -> int:
    """Return the number of the cell at a place; -1: outside of all that has shapes."""
    column = math.floor((x - sheet.frame[0]) / sheet.frame[2])
    row = math.floor((y - sheet.frame[1]) / sheet.frame[2])
    if column < 0 or row < 0 or column >= sheet.cells[0] or row >= sheet.cells[1]:
        return -1
    return int(row * sheet.cells[0] + column)


@law
def holding(sheet: Sheet, cell: int, x: float, y: float) -> tuple[float, float]:
    """Return grip and rolling at a place."""
    grip, rolling = sheet.frame[3], sheet.frame[4]
    if sheet.friction.shape[0] > 0:
        frame = sheet.friction_frame
        rows, columns = sheet.friction.shape
        inside_x = 0.0 <= x - frame[0] <= columns * frame[2]
        if inside_x and 0.0 <= y - frame[1] <= rows * frame[3]:
            grey, _, _ = blend(sheet.friction, frame, x, y)
            grip = frame[4] + grey * (frame[5] - frame[4])
            rolling = frame[6] + grey * (frame[7] - frame[6])
    if cell >= 0:
        for k in range(sheet.starts[cell], sheet.starts[cell + 1]):
            i = sheet.items[k]
            if i >= sheet.holds.shape[0]:
                continue
            dx, dy, r = x - sheet.circles[i, 0], y - sheet.circles[i, 1], sheet.circles[i, 2]
            within = dx * dx + dy * dy <= r * r
            if sheet.first[i + 1] > sheet.first[i]:
                within = is_inside(x, y, sheet.corners, sheet.first[i], sheet.first[i + 1])
            if within:
                grip, rolling = sheet.holds[i, 0], sheet.holds[i, 1]
    return grip, rolling


@law
def standing(
    sheet: Sheet, cell: int, x: float, y: float, ux: float, uy: float, radius: float, top: float
) -> tuple[float, float, float]:
    """Return height and gradient of the floor under a wheel; nothing above `top` counts."""
    best, best_x, best_y = 0.0, 0.0, 0.0
    if sheet.heights.shape[0] > 0:
        best, best_x, best_y = over_hills(sheet, x, y, ux, uy, radius)
    if cell >= 0:
        patches = sheet.holds.shape[0]
        for k in range(sheet.starts[cell], sheet.starts[cell + 1]):
            i = sheet.items[k]
            if i < patches:
                continue
            height, rise_x, rise_y = over_piece(sheet, i, i - patches, x, y, ux, uy, radius)
            if best < height <= top:
                best, best_x, best_y = height, rise_x, rise_y
    steep = math.sqrt(best_x * best_x + best_y * best_y)
    less = STEEPEST / steep if steep > STEEPEST else 1.0
    return best, less * best_x, less * best_y


@array_kernel
def feel(
    sheet: Sheet, alive: Bools, x: Floats, y: Floats, yaw: Floats, steer: Floats,
    radius: float, climbs: float,
    height: Floats, slope_x: Floats, slope_y: Floats, grip: Floats, rolling: Floats,
) -> None:  # fmt: skip
    """Write what each wheel of each car in use stands on.

    Args:
        sheet: The floor.
        alive: (n,) rows in use.
        x: (n, 4) where the wheels are.
        y: As x.
        yaw: (n,) of the car.
        steer: (n,) its mean road-wheel angle.
        radius: Of these cars' wheels [m].
        climbs: How far above the ground it stands on a wheel meets ground [m].
        height: (n, 4) read as the ground the wheels stood on, and written; the rest is written.
        slope_x: (n, 4) gradient of the height along map x.
        slope_y: (n, 4) along map y.
        grip: (n, 4) factor on the tyres' friction.
        rolling: (n, 4) coefficient on top of the tyres' own.
    """
    for row in range(alive.shape[0]):
        if not alive[row]:
            continue
        c, s = math.cos(yaw[row]), math.sin(yaw[row])
        c_front, s_front = math.cos(yaw[row] + steer[row]), math.sin(yaw[row] + steer[row])
        for w in range(4):
            at_x, at_y = x[row, w], y[row, w]
            ux, uy = (c_front, s_front) if w < 2 else (c, s)
            cell = cell_of(sheet, at_x, at_y)
            grip[row, w], rolling[row, w] = holding(sheet, cell, at_x, at_y)
            height[row, w], slope_x[row, w], slope_y[row, w] = standing(
                sheet, cell, at_x, at_y, ux, uy, radius, height[row, w] + climbs
            )
