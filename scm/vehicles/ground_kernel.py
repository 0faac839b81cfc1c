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
from scm.vehicles.jit import array_kernel, kernel_function

CLIMBS = 0.7
RIM = 0.98  # of the radius: at the very rim the slope has no end
MAX_SLOPE = 3.0
LOOKS = 4  # places looked at on each side of a wheel's middle
ANYTHING = 1e9


class Sheet(NamedTuple):
    """A floor as the kernel reads it; `scm/vehicles/ground.py` makes it.

    Attributes:
        frame: x and y of the lower left of the cells, their edge, grip and rolling of the floor.
        cells: Columns and rows.
        starts: (columns * rows + 2,) where each cell's shapes begin in `items`; the last cell is
            the empty one around all others.
        items: Shapes that reach into a cell: patches by their number, then pieces of height.
        busy: (columns * rows + 1,) whether a car whose rear left wheel is in a cell can reach
            anything but the usual floor.
        first: (shapes + 1,) where each shape's corners begin; a circle has none.
        corners: (k, 2) counter-clockwise.
        circles: (patches, 3) x, y, radius.
        holds: (patches, 2) grip and rolling.
        planes: (pieces, 3) height = at + rise_x x + rise_y y.
        friction: Grey 0 to 1 from the lowest row up; no rows: none.
        friction_frame: x, y of the picture's lower left, size of a pixel in x and y, then grip of
            black and white, rolling of black and white.
        heights: (rows, columns) from the lowest row up [m]; no rows: none.
        level: (rows, columns) whether a wheel there stands level: nothing rises in its reach.
        height_frame: As the first four of `friction_frame`.
    """

    frame: Floats
    cells: Ints
    starts: Ints
    items: Ints
    busy: Bools
    first: Ints
    corners: Floats
    circles: Floats
    holds: Floats
    planes: Floats
    friction: Floats
    friction_frame: Floats
    heights: Floats
    level: Bools
    height_frame: Floats


@kernel_function
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


@kernel_function
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


@kernel_function
def over_hills(
    heights: Floats, level: Bools, frame: Floats,
    x: float, y: float, way: float, radius: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Return height and gradient of a wheel over the height map; 0 if there is none."""
    rows, columns = heights.shape
    if rows == 0:
        return 0.0, 0.0, 0.0
    i = int(min(max((x - frame[0]) / frame[2], 0.0), columns - 1.0))
    j = int(min(max((y - frame[1]) / frame[3], 0.0), rows - 1.0))
    if level[j, i]:
        return heights[j, i], 0.0, 0.0
    ux, uy = math.cos(way), math.sin(way)
    best, best_x, best_y = -ANYTHING, 0.0, 0.0
    for k in range(-LOOKS, LOOKS + 1):
        t = RIM * radius * k / LOOKS
        value, rise_x, rise_y = blend(heights, frame, x + t * ux, y + t * uy)
        value += math.sqrt(radius * radius - t * t) - radius
        if value > best:
            best, best_x, best_y = value, rise_x, rise_y
    return best, best_x, best_y


@kernel_function
def over_piece(
    corners: Floats, low: int, high: int, plane: Floats,
    x: float, y: float, way: float, radius: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Return height and gradient of a wheel over one plane piece; far below: it does not reach."""
    ux, uy = math.cos(way), math.sin(way)
    nearest, farthest = -RIM * radius, RIM * radius
    near_x, near_y, near_run = 0.0, 0.0, 0.0
    far_x, far_y, far_run = 0.0, 0.0, 0.0
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
    at, rise_x, rise_y = plane[0], plane[1], plane[2]
    rise = rise_x * ux + rise_y * uy
    t = radius * rise / math.sqrt(1.0 + rise * rise)
    edge_x, edge_y, run = 0.0, 0.0, 0.0
    if t < nearest:
        t, edge_x, edge_y, run = nearest, near_x, near_y, near_run
    elif t > farthest:
        t, edge_x, edge_y, run = farthest, far_x, far_y, far_run
    drop = math.sqrt(radius * radius - t * t)
    height = at + rise_x * x + rise_y * y + rise * t + drop - radius
    if run != 0.0:
        steep = (t / drop - rise) / run
        rise_x, rise_y = rise_x + steep * edge_x, rise_y + steep * edge_y
    return height, rise_x, rise_y


@kernel_function
def cell_of(frame: Floats, columns: int, rows: int, x: float, y: float) -> int:
    """Return the number of the cell at a place; outside of all that is one more, the empty one."""
    column, row = math.floor((x - frame[0]) / frame[2]), math.floor((y - frame[1]) / frame[2])
    if column < 0 or row < 0 or column >= columns or row >= rows:
        return columns * rows
    return int(row * columns + column)


@kernel_function
def painted(friction: Floats, frame: Floats, x: float, y: float) -> float:
    """Return the grey of the friction map at a place; below 0 where there is none."""
    rows, columns = friction.shape
    if rows == 0:
        return -1.0
    over_x, over_y = x - frame[0], y - frame[1]
    if over_x < 0.0 or over_y < 0.0 or over_x > columns * frame[2] or over_y > rows * frame[3]:
        return -1.0
    grey, _, _ = blend(friction, frame, x, y)
    return grey


@kernel_function
def is_on(
    circles: Floats, corners: Floats, i: int, low: int, high: int, x: float, y: float
) -> bool:
    """Return whether a place lies on a patch."""
    if high > low:
        return is_inside(x, y, corners, low, high)
    dx, dy, r = x - circles[i, 0], y - circles[i, 1], circles[i, 2]
    return bool(dx * dx + dy * dy <= r * r)


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
    frame, columns, lines = sheet.frame, sheet.cells[0], sheet.cells[1]
    busy = sheet.busy
    starts, items, first, corners = sheet.starts, sheet.items, sheet.first, sheet.corners
    circles, holds, planes = sheet.circles, sheet.holds, sheet.planes
    grey_map, black = sheet.friction, sheet.friction_frame
    hills, level, hill_frame = sheet.heights, sheet.level, sheet.height_frame
    patches = holds.shape[0]
    for row in range(alive.shape[0]):
        if not alive[row]:
            continue
        if not busy[cell_of(frame, columns, lines, x[row, 2], y[row, 2])]:
            grip[row, :], rolling[row, :] = frame[3], frame[4]
            height[row, :], slope_x[row, :], slope_y[row, :] = 0.0, 0.0, 0.0
            continue
        for w in range(4):
            at_x, at_y = x[row, w], y[row, w]
            way = yaw[row] + (steer[row] if w < 2 else 0.0)
            grey = painted(grey_map, black, at_x, at_y)
            held = frame[3] if grey < 0.0 else black[4] + grey * (black[5] - black[4])
            rolls = frame[4] if grey < 0.0 else black[6] + grey * (black[7] - black[6])
            up, rise_x, rise_y = over_hills(hills, level, hill_frame, at_x, at_y, way, radius)
            top = height[row, w] + climbs
            cell = cell_of(frame, columns, lines, at_x, at_y)
            for k in range(starts[cell], starts[cell + 1]):
                i = items[k]
                if i < patches:
                    if is_on(circles, corners, i, first[i], first[i + 1], at_x, at_y):
                        held, rolls = holds[i, 0], holds[i, 1]
                    continue
                reached, along_x, along_y = over_piece(
                    corners, first[i], first[i + 1], planes[i - patches],
                    at_x, at_y, way, radius,
                )  # fmt: skip
                if up < reached <= top:
                    up, rise_x, rise_y = reached, along_x, along_y
            less = MAX_SLOPE / max(math.sqrt(rise_x * rise_x + rise_y * rise_y), MAX_SLOPE)
            grip[row, w], rolling[row, w], height[row, w] = held, rolls, up
            slope_x[row, w], slope_y[row, w] = less * rise_x, less * rise_y
