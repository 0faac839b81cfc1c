"""Which cars are on the way ahead: outlines against the corridor that the own car will sweep.

Along a segment of the way a car's outline is the box that holds it, with sides along and across the
way at its middle. In a bend it is taken as wider by what the way curves over its length, and the
corridor as wider on the outside by what the own front swings out.
"""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.lane_tracking import foot
from scm.vehicles.drivers.memory import FRONT, WIDTH
from scm.vehicles.drivers.stations import (
    AT_X,
    AT_Y,
    CELLS_X,
    CELLS_Y,
    LARGEST,
    LOW_X,
    LOW_Y,
    Heard,
    cell_number,
    known_to,
)
from scm.vehicles.drivers.streets import (
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
from scm.vehicles.jit import law

REACH = 2.0
MARGIN = 0.01
STANDSTILL_GAP = 0.08
MOST_AHEAD = 32
MOST_SEGMENTS = 32

# Columns of a car ahead: where its rear is along the way, its speed along it, its length.
REAR_AT, SPEED_OF, LENGTH_OF = range(3)
# Columns of a window over the floor.
LEFT, LOW, RIGHT, HIGH = range(4)


class Scratch(NamedTuple):
    """Room to work in, one a thread.

    Attributes:
        ids: (32,) segments of the way; `begins` (33,) where each begins, from the rear axle on.
        ahead: (32, 3) cars ahead, nearest first.
        window: (4,) over the floor.
    """

    ids: Ints
    begins: Floats
    ahead: Floats
    window: Floats


def scratch() -> Scratch:
    """Return room for one thread."""
    return Scratch(
        ids=np.zeros(MOST_SEGMENTS, np.int64),
        begins=np.zeros(MOST_SEGMENTS + 1),
        ahead=np.zeros((MOST_AHEAD, 3)),
        window=np.zeros(4),
    )


@law
def cars_ahead(
    segments: Floats,
    heard: Heard,
    room: Scratch,
    kind: Floats,
    car: int,
    count: int,
    reach: float,
    now_ns: int,
    seed: int,
) -> int:
    """Find the cars on the surveyed way, nearest first; return how many.

    They are looked for from the own front bumper on, as far as `reach` [m]. `room` holds the
    surveyed segments, `count` of them, and takes the cars.
    """
    span(segments, room.ids, room.begins, room.window, count, kind[FRONT], reach)
    floor, window = heard.floor, room.window
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
        first = heard.cell_first[row * across + left]
        last = heard.cell_first[row * across + right + 1]
        for at in range(first, last):
            other = heard.in_cell[at]
            if other == car or is_outside(window, heard.at[other]):
                continue
            known, x, y, cos, sin, speed = known_to(heard, other, car, now_ns, seed)
            if not known:
                continue
            half_length, half_width = 0.5 * heard.size[other, 0], 0.5 * heard.size[other, 1]
            hit, rear, same_way = first_overlap(
                segments,
                room.ids,
                room.begins,
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
                    room.ahead, found, rear, max(0.0, speed * same_way), 2.0 * half_length
                )
    return found


@law
def is_outside(window: Floats, at: Floats) -> bool:
    """Return whether a car's middle lies outside a window, and cannot reach into the way."""
    x, y = at[AT_X], at[AT_Y]
    return bool(x < window[LEFT] or x > window[RIGHT] or y < window[LOW] or y > window[HIGH])


@law
def span(
    segments: Floats,
    ids: Ints,
    begins: Floats,
    window: Floats,
    count: int,
    front: float,
    reach: float,
) -> None:
    """Lay a window over the way from the front bumper to the end of the reach."""
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


@law
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
    """Return whether an outline reaches into the corridor, where first, and how much it goes along.

    The last is the cosine of the angle between its heading and the way.
    """
    front = kind[FRONT]
    half = 0.5 * kind[WIDTH] + MARGIN
    for at in range(count):
        begin, end = max(front, begins[at]), min(front + reach, begins[at + 1])
        row = segments[ids[at]]
        swing = 0.5 * row[CURVATURE] * front * front
        if end < begin or is_beside(row, x, y, half + abs(swing) + half_length + half_width):
            continue
        along, beside, turn_cos, turn_sin = foot(row, x, y, 0.5 * row[LENGTH])
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


@law
def is_beside(row: Floats, x: float, y: float, wide: float) -> bool:
    """Return whether a point lies farther beside the line of a segment than `wide` [m]."""
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


@law
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
    """Return where along a segment an outline begins [m], seen from the bumper that is nearer."""
    back = -half_length if same >= 0.0 else half_length
    along, _, turn_cos, turn_sin = foot(row, x + back * cos, y + back * sin, 0.5 * row[LENGTH])
    way_cos = row[COS] * turn_cos - row[SIN] * turn_sin
    way_sin = row[SIN] * turn_cos + row[COS] * turn_sin
    across: float = abs(way_cos * sin - way_sin * cos)
    return along - half_width * across


@law
def insert(ahead: Floats, found: int, rear: float, speed: float, length: float) -> int:
    """Put a car in its place, the farthest out if there are too many; return how many there are."""
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
