"""Where a car is along its route, and which lane segments are around it: compiled.

On an arc of curvature k that begins at the origin towards +x, the point (u, v) has its foot at
s = atan2(k u, 1 - k v) / k and lies (2 v - k (u^2 + v^2)) / (1 + sqrt((k u)^2 + (1 - k v)^2)) to
the left of it; for k = 0 that is (u, v) itself.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.channel import pcg_hash
from scm.vehicles.drivers.driver_state import (
    AFTER,
    BEHIND,
    BESIDE,
    CIRCULATE,
    COUNT,
    DONE,
    HERE,
    INDEX,
    LOOP,
    ROUTE,
    SEED,
    WINDOW_SIZE,
    DriverState,
    S,
)
from scm.vehicles.drivers.lane_graph import AT, COS, CURVATURE, LENGTH, SIN, LaneArrays, X, Y
from scm.vehicles.jit import array_kernel, kernel_function

TURN = 2.0 * math.pi
MAX_STEPS = 16  # segments that one call moves on; a car passes fewer between decisions


@kernel_function
def lane_at(lanes: LaneArrays, state: DriverState, car: int, index: int, before: int) -> int:
    """Return lane number `index` of a car's route, given the one before it; -1 beyond the end."""
    ints = state.ints[car]
    if 0 <= index < ints[COUNT]:
        return int(state.routes[ints[ROUTE] + index])
    if ints[AFTER] == LOOP:
        return int(state.routes[ints[ROUTE] + index % ints[COUNT]])
    if ints[AFTER] != CIRCULATE or before < 0:
        return -1
    first = lanes.next_first[before]
    choices = lanes.next_first[before + 1] - first
    if choices == 0:
        return -1
    return int(lanes.following[first + pcg_hash(ints[SEED], index) % choices])


@array_kernel
def fill_window(lanes: LaneArrays, state: DriverState, car: int, lane: int) -> None:
    """Fill a car's lane window from its current lane; INDEX is that lane's place on the route."""
    lane_window = state.lane_window[car]
    loops = state.ints[car, AFTER] == LOOP
    lane_window[BEHIND] = (
        lane_at(lanes, state, car, state.ints[car, INDEX] - 1, -1) if loops else -1
    )
    lane_window[HERE] = lane
    for ahead in range(HERE + 1, WINDOW_SIZE):
        index = state.ints[car, INDEX] + ahead - HERE
        lane_window[ahead] = lane_at(lanes, state, car, index, lane_window[ahead - 1])


@kernel_function
def choose_other_branch(lanes: LaneArrays, state: DriverState, car: int) -> None:
    """Choose other branches after the current lane for a circulating car; fixed routes stay."""
    ints, lane_window = state.ints[car], state.lane_window[car]
    ints[SEED] = pcg_hash(ints[SEED], ints[INDEX])
    for ahead in range(HERE + 1, WINDOW_SIZE):
        index = ints[INDEX] + ahead - HERE
        lane_window[ahead] = lane_at(lanes, state, car, index, lane_window[ahead - 1])


@kernel_function
def advance_window(lanes: LaneArrays, state: DriverState, car: int) -> None:
    """Advance a car's lane window by one lane."""
    lane_window = state.lane_window[car]
    for ahead in range(WINDOW_SIZE - 1):
        lane_window[ahead] = lane_window[ahead + 1]
    state.ints[car, INDEX] += 1
    index = state.ints[car, INDEX] + WINDOW_SIZE - 1 - HERE
    lane_window[WINDOW_SIZE - 1] = lane_at(lanes, state, car, index, lane_window[WINDOW_SIZE - 2])


@kernel_function
def step_back_window(state: DriverState, car: int) -> None:
    """Move a car's lane window back by one lane."""
    lane_window = state.lane_window[car]
    for ahead in range(WINDOW_SIZE - 1, 0, -1):
        lane_window[ahead] = lane_window[ahead - 1]
    lane_window[BEHIND] = -1
    state.ints[car, INDEX] -= 1


@kernel_function
def segment_at(first: Ints, segments: Floats, lane: int, s: float) -> int:
    """Return the segment at a distance along a lane."""
    segment = first[lane]
    last = first[lane + 1] - 1
    while segment < last and s >= segments[segment + 1, AT]:
        segment += 1
    return int(segment)


@kernel_function
def project(row: Floats, x: float, y: float, near: float) -> tuple[float, float, float, float]:
    """Project a point on a segment: distance along it, offset to the left, direction there.

    The direction is (cos, sin) relative to the segment's start. On a long arc the projection is
    the one within half a turn of `near` [m].
    """
    dx, dy = x - row[X], y - row[Y]
    u, v = dx * row[COS] + dy * row[SIN], dy * row[COS] - dx * row[SIN]
    k = row[CURVATURE]
    if k == 0.0:
        return u, v, 1.0, 0.0
    p, q = k * u, 1.0 - k * v
    radius = math.sqrt(p * p + q * q)
    turned = math.atan2(p, q)
    turned += TURN * math.floor((k * near - turned) / TURN + 0.5)
    return (
        turned / k,
        (2.0 * v - k * (u * u + v * v)) / (1.0 + radius),
        q / radius,
        p / radius,
    )


@kernel_function
def update_position(lanes: LaneArrays, state: DriverState, car: int, x: float, y: float) -> None:
    """Update a car's place on its route from its last one, and the distance driven."""
    lane_window, floats = state.lane_window[car], state.floats[car]
    segment = segment_at(lanes.segment_first, lanes.segments, lane_window[HERE], floats[S])
    near = floats[S] - lanes.segments[segment, AT]
    moved, walked = -floats[S], 0
    along = beside = 0.0
    for _ in range(MAX_STEPS):
        lane = lane_window[HERE]
        row = lanes.segments[segment]
        along, beside, _c, _s = project(row, x, y, near)
        step = 1 if along > row[LENGTH] else (-1 if along < 0.0 else 0)
        if step in (0, -walked):  # in a bend a point can lie between two normals
            break
        if step > 0 and segment + 1 < lanes.segment_first[lane + 1]:
            segment += 1
        elif step > 0 and lane_window[HERE + 1] >= 0:
            moved += lanes.length[lane]
            advance_window(lanes, state, car)
            segment = lanes.segment_first[lane_window[HERE]]
        elif step < 0 and segment > lanes.segment_first[lane]:
            segment -= 1
        elif step < 0 and lane_window[BEHIND] >= 0:
            step_back_window(state, car)
            moved -= lanes.length[lane_window[HERE]]
            segment = lanes.segment_first[lane_window[HERE] + 1] - 1
        else:
            break
        walked = step
        near = 0.0 if step > 0 else lanes.segments[segment, LENGTH]
    row = lanes.segments[segment]
    s = row[AT] + min(max(along, 0.0), row[LENGTH])
    floats[S], floats[BESIDE] = s, beside
    floats[DONE] += moved + s


@kernel_function
def list_segments(
    first: Ints,
    segments: Floats,
    lane_window: Ints,
    s: float,
    back: float,
    reach: float,
    ids: Ints,
    begins: Floats,
) -> tuple[int, int, bool]:
    """List the segments of a route around a car.

    Args:
        first: First segment of each lane.
        segments: Of all lanes.
        lane_window: Of the car.
        s: Its place on its lane [m].
        back: Distance to look back [m].
        reach: Distance to look ahead [m].
        ids: Output: the segments, in driving order.
        begins: Output: where each begins, relative to the car [m], and the end of the last one.

    Returns:
        Number of segments, index of the car's own, and whether the route ends within reach.
    """
    at, segment, begin, here = first_segment_behind(first, segments, lane_window, s, back)
    lane = lane_window[at]
    count = 0
    while True:
        ids[count], begins[count] = segment, begin
        count += 1
        begin += segments[segment, LENGTH]
        if begin > reach or count == len(ids):
            ends = False
            break
        segment += 1
        if segment == first[lane + 1]:
            at += 1
            if at == WINDOW_SIZE or lane_window[at] < 0:
                ends = at < WINDOW_SIZE
                break
            lane = lane_window[at]
            segment = first[lane]
    begins[count] = begin
    return count, min(here, count - 1), ends


@kernel_function
def first_segment_behind(
    first: Ints, segments: Floats, lane_window: Ints, s: float, back: float
) -> tuple[int, int, float, int]:
    """Return the segment at a distance behind the car.

    Returns:
        Its lane in the window, its number, its start relative to the car [m], and how many
        segments later the car is.
    """
    at, lane, here = HERE, lane_window[HERE], 0
    segment = segment_at(first, segments, lane, s)
    begin = segments[segment, AT] - s
    while begin > -back:
        if segment > first[lane]:
            segment -= 1
        elif at == HERE and lane_window[BEHIND] >= 0:
            at, lane = BEHIND, lane_window[BEHIND]
            segment = first[lane + 1] - 1
        else:
            break
        begin -= segments[segment, LENGTH]
        here += 1
    return at, segment, float(begin), here


@kernel_function
def heading_change(
    segments: Floats, ids: Ints, begins: Floats, count: int, here: int, offset: float
) -> float:
    """Return the change of heading from the car to an offset along its route [rad], + = left.

    Beyond the listed segments the route is assumed straight.
    """
    total = 0.0
    at = here
    if offset >= 0.0:
        while at < count and begins[at] < offset:
            piece = min(offset, begins[at + 1]) - max(0.0, begins[at])
            total += segments[ids[at], CURVATURE] * piece
            at += 1
        return total
    while at >= 0 and begins[at + 1] > offset:
        piece = min(0.0, begins[at + 1]) - max(offset, begins[at])
        total -= segments[ids[at], CURVATURE] * piece
        at -= 1
    return total
