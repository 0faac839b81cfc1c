"""Where a car is along its way, and what lies ahead: compiled, over straights and arcs.

On an arc of curvature k that begins at the origin towards +x, the point (u, v) has its foot at
s = atan2(k u, 1 - k v) / k and lies (2 v - k (u^2 + v^2)) / (1 + sqrt((k u)^2 + (1 - k v)^2)) to
the left of it; for k = 0 that is (u, v) itself.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.drivers.chance import mixed
from scm.vehicles.drivers.memory import (
    AFTER,
    BEHIND,
    BESIDE,
    CIRCULATE,
    COUNT,
    DONE,
    HERE,
    IN_SIGHT,
    INDEX,
    LOOP,
    ROUTE,
    SEED,
    Memory,
    S,
)
from scm.vehicles.drivers.streets import AT, COS, CURVATURE, LENGTH, SIN, Ways, X, Y
from scm.vehicles.jit import array_kernel, law

TURN = 2.0 * math.pi
MOST_STEPS = 16


@law
def lane_at(ways: Ways, memory: Memory, car: int, index: int, before: int) -> int:
    """Return lane number `index` of a car's way, given the one before it; -1 beyond the end."""
    ints = memory.ints[car]
    if 0 <= index < ints[COUNT]:
        return int(memory.routes[ints[ROUTE] + index])
    if ints[AFTER] == LOOP:
        return int(memory.routes[ints[ROUTE] + index % ints[COUNT]])
    if ints[AFTER] != CIRCULATE or before < 0:
        return -1
    first = ways.next_first[before]
    choices = ways.next_first[before + 1] - first
    if choices == 0:
        return -1
    return int(ways.following[first + mixed(ints[SEED], index) % choices])


@array_kernel
def look_from(ways: Ways, memory: Memory, car: int, lane: int) -> None:
    """Fill a car's sight from the lane it is on; its INDEX says which of its way that is."""
    sight = memory.sight[car]
    loops = memory.ints[car, AFTER] == LOOP
    sight[BEHIND] = lane_at(ways, memory, car, memory.ints[car, INDEX] - 1, -1) if loops else -1
    sight[HERE] = lane
    for ahead in range(HERE + 1, IN_SIGHT):
        index = memory.ints[car, INDEX] + ahead - HERE
        sight[ahead] = lane_at(ways, memory, car, index, sight[ahead - 1])


@law
def choose_again(ways: Ways, memory: Memory, car: int) -> None:
    """Let a car that circulates turn elsewhere behind the lane it is on; a route stays as it is."""
    ints, sight = memory.ints[car], memory.sight[car]
    ints[SEED] = mixed(ints[SEED], ints[INDEX])
    for ahead in range(HERE + 1, IN_SIGHT):
        index = ints[INDEX] + ahead - HERE
        sight[ahead] = lane_at(ways, memory, car, index, sight[ahead - 1])


@law
def go_on(ways: Ways, memory: Memory, car: int) -> None:
    """Move a car's sight on by one lane."""
    sight = memory.sight[car]
    for ahead in range(IN_SIGHT - 1):
        sight[ahead] = sight[ahead + 1]
    memory.ints[car, INDEX] += 1
    index = memory.ints[car, INDEX] + IN_SIGHT - 1 - HERE
    sight[IN_SIGHT - 1] = lane_at(ways, memory, car, index, sight[IN_SIGHT - 2])


@law
def go_back(memory: Memory, car: int) -> None:
    """Move a car's sight back by the one lane that it remembers."""
    sight = memory.sight[car]
    for ahead in range(IN_SIGHT - 1, 0, -1):
        sight[ahead] = sight[ahead - 1]
    sight[BEHIND] = -1
    memory.ints[car, INDEX] -= 1


@law
def segment_at(first: Ints, segments: Floats, lane: int, s: float) -> int:
    """Return the segment that holds a distance along a lane."""
    segment = first[lane]
    last = first[lane + 1] - 1
    while segment < last and s >= segments[segment + 1, AT]:
        segment += 1
    return int(segment)


@law
def foot(row: Floats, x: float, y: float, near: float) -> tuple[float, float, float, float]:
    """Return a point's place by a segment: along it, left of it, and the direction at its foot.

    The direction is (cos, sin) of what the segment has turned since its start. On a long arc the
    foot is looked for within half a turn of `near` [m].
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
    return turned / k, (2.0 * v - k * (u * u + v * v)) / (1.0 + radius), q / radius, p / radius


@law
def locate(ways: Ways, memory: Memory, car: int, x: float, y: float) -> None:
    """Find a car's foot on its way, walking from where it was; count what it has driven."""
    sight, floats = memory.sight[car], memory.floats[car]
    segment = segment_at(ways.segment_first, ways.segments, sight[HERE], floats[S])
    near = floats[S] - ways.segments[segment, AT]
    gone, walked = -floats[S], 0
    along = beside = 0.0
    for _ in range(MOST_STEPS):
        lane = sight[HERE]
        row = ways.segments[segment]
        along, beside, _c, _s = foot(row, x, y, near)
        step = 1 if along > row[LENGTH] else (-1 if along < 0.0 else 0)
        if step in (0, -walked):  # in a bend a point may lie between two normals
            break
        if step > 0 and segment + 1 < ways.segment_first[lane + 1]:
            segment += 1
        elif step > 0 and sight[HERE + 1] >= 0:
            gone += ways.length[lane]
            go_on(ways, memory, car)
            segment = ways.segment_first[sight[HERE]]
        elif step < 0 and segment > ways.segment_first[lane]:
            segment -= 1
        elif step < 0 and sight[BEHIND] >= 0:
            go_back(memory, car)
            gone -= ways.length[sight[HERE]]
            segment = ways.segment_first[sight[HERE] + 1] - 1
        else:
            break
        walked = step
        near = 0.0 if step > 0 else ways.segments[segment, LENGTH]
    row = ways.segments[segment]
    s = row[AT] + min(max(along, 0.0), row[LENGTH])
    floats[S], floats[BESIDE] = s, beside
    floats[DONE] += gone + s


@law
def survey(
    first: Ints,
    segments: Floats,
    sight: Ints,
    s: float,
    back: float,
    reach: float,
    ids: Ints,
    begins: Floats,
) -> tuple[int, int, bool]:
    """List the segments of a way around a place on it.

    Args:
        first: Of each lane, its first segment.
        segments: Of all lanes.
        sight: The car's lanes in sight.
        s: Its place on the lane it is on [m].
        back: How far to look back [m].
        reach: How far to look ahead [m].
        ids: Takes the segments, in driving order.
        begins: Takes where each begins, counted from the place [m]; one more for the last one's
            end.

    Returns:
        How many there are, which of them holds the place, and whether the way ends in sight.
    """
    at, segment, begin, here = look_back(first, segments, sight, s, back)
    lane = sight[at]
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
            if at == IN_SIGHT or sight[at] < 0:
                ends = at < IN_SIGHT
                break
            lane = sight[at]
            segment = first[lane]
    begins[count] = begin
    return count, min(here, count - 1), ends


@law
def look_back(
    first: Ints, segments: Floats, sight: Ints, s: float, back: float
) -> tuple[int, int, float, int]:
    """Return the first segment that a survey needs.

    Returns:
        Which lane in sight it is on, its number, where it begins from the car's place on [m], and
        how many segments later that place is.
    """
    at, lane, here = HERE, sight[HERE], 0
    segment = segment_at(first, segments, lane, s)
    begin = segments[segment, AT] - s
    while begin > -back:
        if segment > first[lane]:
            segment -= 1
        elif at == HERE and sight[BEHIND] >= 0:
            at, lane = BEHIND, sight[BEHIND]
            segment = first[lane + 1] - 1
        else:
            break
        begin -= segments[segment, LENGTH]
        here += 1
    return at, segment, float(begin), here


@law
def turned(
    segments: Floats, ids: Ints, begins: Floats, count: int, here: int, offset: float
) -> float:
    """Return by how much the way turns from the car's place to an offset along it [rad], + = left.

    Beyond what was surveyed the way is taken as straight.
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
