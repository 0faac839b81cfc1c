"""Which cars are on the route ahead: outlines against the corridor that the own car will sweep.

On each segment a car's outline is its bounding box, with sides along and across the route. In a
bend it is widened by the curvature over its length, and the corridor is widened on the outside by
the swing of the own front.
"""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.drivers.driver_state import FRONT, WIDTH
from scm.vehicles.drivers.lane_graph import (
    COS,
    CURVATURE,
    EAST,
    LENGTH,
    NORTH,
    SIN,
    SOUTH,
    WEST,
    X,
    Y,
)
from scm.vehicles.drivers.lane_tracking import project
from scm.vehicles.drivers.received_cams import (
    AT_X,
    AT_Y,
    CELLS_X,
    CELLS_Y,
    LARGEST,
    LOW_X,
    LOW_Y,
    ReceivedCams,
    cell_number,
    estimate_for,
)
from scm.vehicles.jit import kernel_function

REACH = 2.0  # beyond the front bumper [m]
MARGIN = 0.01  # on both sides of the corridor [m]
STANDSTILL_GAP = 0.08  # to the car ahead at rest [m]
MAX_CARS_AHEAD = 32
MAX_SEGMENTS = 32

# Columns of a car ahead: place of its rear along the route, speed along it, length.
REAR_AT, SPEED_OF, LENGTH_OF = range(3)
# Columns of a rectangle on the floor.
LEFT, LOW, RIGHT, HIGH = range(4)


class Scratch(ArrayStruct):
    """Working arrays of one thread.

    Attributes:
        ids: (32,) segments of the route; `begins` (33,) where each begins, from the rear axle.
        ahead: (32, 3) cars ahead, nearest first.
        window: (4,) rectangle on the floor.
    """

    ids: Ints
    begins: Floats
    ahead: Floats
    window: Floats


def new_scratch() -> Scratch:
    """Return the working arrays for one thread."""
    return Scratch(
        ids=np.zeros(MAX_SEGMENTS, np.int64),
        begins=np.zeros(MAX_SEGMENTS + 1),
        ahead=np.zeros((MAX_CARS_AHEAD, 3)),
        window=np.zeros(4),
    )


@kernel_function
def find_cars_ahead(
    segments: Floats,
    received: ReceivedCams,
    scratch: Scratch,
    kind: Floats,
    car: int,
    count: int,
    reach: float,
    now_ns: int,
    seed: int,
) -> int:
    """Write the cars on the listed segments to `scratch`, nearest first; return how many.

    `scratch` holds `count` listed segments. The search goes from the own front bumper to `reach`
    [m] beyond it.
    """
    span(segments, scratch.ids, scratch.begins, scratch.window, count, kind[FRONT], reach)
    floor, window = received.floor, scratch.window
    margin = 0.5 * kind[WIDTH] + MARGIN + floor[LARGEST]
    window[LEFT], window[RIGHT] = window[LEFT] - margin, window[RIGHT] + margin
    window[LOW], window[HIGH] = window[LOW] - margin, window[HIGH] + margin
    across = int(floor[CELLS_X])
    left = cell_number(floor, window[LEFT], LOW_X, CELLS_X)
    right = cell_number(floor, window[RIGHT], LOW_X, CELLS_X)
    low = cell_number(floor, window[LOW], LOW_Y, CELLS_Y)
    high = cell_number(floor, window[HIGH], LOW_Y, CELLS_Y)
    found = 0
    for row in range(low, high + 1):
        first = received.cell_first[row * across + left]
        last = received.cell_first[row * across + right + 1]
        for at in range(first, last):
            other = received.in_cell[at]
            if other == car or is_outside(window, received.at[other]):
                continue
            known, x, y, cos, sin, speed = estimate_for(received, other, car, now_ns, seed)
            if not known:
                continue
            half_length, half_width = 0.5 * received.size[other, 0], 0.5 * received.size[other, 1]
            hit, rear, same_way = first_overlap(
                segments,
                scratch.ids,
                scratch.begins,
                kind,
                count,
                reach,
                x,
                y,
                cos,
                sin,
                half_length,
                half_width,
            )
            if hit:
                found = insert(
                    scratch.ahead, found, rear, max(0.0, speed * same_way), 2.0 * half_length
                )
    return found


@kernel_function
def is_outside(window: Floats, at: Floats) -> bool:
    """Return whether a car's centre lies outside a rectangle, so that it cannot be on the route."""
    x, y = at[AT_X], at[AT_Y]
    return bool(x < window[LEFT] or x > window[RIGHT] or y < window[LOW] or y > window[HIGH])


@kernel_function
def span(
    segments: Floats,
    ids: Ints,
    begins: Floats,
    window: Floats,
    count: int,
    front: float,
    reach: float,
) -> None:
    """Set the rectangle that holds the route from the front bumper to the end of the reach."""
    window[LEFT] = window[LOW] = math.inf
    window[RIGHT] = window[HIGH] = -math.inf
    for at in range(count):
        begin = max(front, begins[at]) - begins[at]
        end = min(front + reach, begins[at + 1]) - begins[at]
        if end < begin:
            continue
        row = segments[ids[at]]
        west, south, east, north = row[WEST], row[SOUTH], row[EAST], row[NORTH]
        if row[CURVATURE] == 0.0:
            x0, x1 = row[X] + row[COS] * begin, row[X] + row[COS] * end
            y0, y1 = row[Y] + row[SIN] * begin, row[Y] + row[SIN] * end
            west, east, south, north = min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1)
        window[LEFT], window[RIGHT] = min(window[LEFT], west), max(window[RIGHT], east)
        window[LOW], window[HIGH] = min(window[LOW], south), max(window[HIGH], north)


@kernel_function
def first_overlap(
    segments: Floats,
    ids: Ints,
    begins: Floats,
    kind: Floats,
    count: int,
    reach: float,
    x: float,
    y: float,
    cos: float,
    sin: float,
    half_length: float,
    half_width: float,
) -> tuple[bool, float, float]:
    """Return whether an outline reaches into the corridor, where first, and its alignment.

    The alignment is the cosine of the angle between its heading and the route.
    """
    front = kind[FRONT]
    half = 0.5 * kind[WIDTH] + MARGIN
    for at in range(count):
        begin, end = max(front, begins[at]), min(front + reach, begins[at + 1])
        row = segments[ids[at]]
        swing = 0.5 * row[CURVATURE] * front * front
        if end < begin or is_beside(row, x, y, half + abs(swing) + half_length + half_width):
            continue
        along, beside, turn_cos, turn_sin = project(row, x, y, 0.5 * row[LENGTH])
        way_cos = row[COS] * turn_cos - row[SIN] * turn_sin
        way_sin = row[SIN] * turn_cos + row[COS] * turn_sin
        same, across = way_cos * cos + way_sin * sin, abs(way_cos * sin - way_sin * cos)
        lengthwise = half_length * abs(same) + half_width * across
        sideways = half_length * across + half_width * abs(same)
        bend = 0.5 * row[CURVATURE] * lengthwise * lengthwise
        right_edge = beside - sideways - max(0.0, bend)
        left_edge = beside + sideways + max(0.0, -bend)
        if left_edge < -half - max(0.0, swing) or right_edge > half + max(0.0, -swing):
            continue
        if begins[at] + along + lengthwise < begin:
            continue
        own_rear = rear_end(row, x, y, cos, sin, same, half_length, half_width)
        rear = max(begin, begins[at] + own_rear)
        if rear <= end:
            return True, rear, same
    return False, 0.0, 0.0


@kernel_function
def is_beside(row: Floats, x: float, y: float, wide: float) -> bool:
    """Return whether a point is more than `wide` [m] beside the line of a segment."""
    dx, dy = x - row[X], y - row[Y]
    v = dy * row[COS] - dx * row[SIN]
    k = row[CURVATURE]
    if k == 0.0:
        return bool(abs(v) > wide)
    # between two circles about the arc's centre, of radii r - wide and r + wide; all times k^2
    squared = k * k * (dx * dx + dy * dy) - 2.0 * k * v
    spread = abs(k) * wide
    is_inside = spread < 1.0 and squared < spread * (spread - 2.0)
    return bool(is_inside or squared > spread * (2.0 + spread))


@kernel_function
def rear_end(
    row: Floats,
    x: float,
    y: float,
    cos: float,
    sin: float,
    same: float,
    half_length: float,
    half_width: float,
) -> float:
    """Return where along a segment an outline begins [m], by its nearer bumper."""
    back = -half_length if same >= 0.0 else half_length
    along, _, turn_cos, turn_sin = project(row, x + back * cos, y + back * sin, 0.5 * row[LENGTH])
    way_cos = row[COS] * turn_cos - row[SIN] * turn_sin
    way_sin = row[SIN] * turn_cos + row[COS] * turn_sin
    across: float = abs(way_cos * sin - way_sin * cos)
    return along - half_width * across


@kernel_function
def insert(ahead: Floats, found: int, rear: float, speed: float, length: float) -> int:
    """Insert a car in order and drop the farthest if there are too many; return the count."""
    at = found
    if found == len(ahead):
        at -= 1
        if ahead[at, REAR_AT] <= rear:
            return found
    while at > 0 and ahead[at - 1, REAR_AT] > rear:
        for column in range(3):
            ahead[at, column] = ahead[at - 1, column]
        at -= 1
    ahead[at, REAR_AT], ahead[at, SPEED_OF], ahead[at, LENGTH_OF] = rear, speed, length
    return min(found + 1, len(ahead))
