"""Where the ways of a junction meet, and which groups may never be green together: geometry."""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats
from scm.maps.route import Roads
from scm.records.city_map import Conflict, Junction


class Meeting(NamedTuple):
    """Where two movements come closer than a lane is wide, along the lane of each [m]."""

    from_m: float
    to_m: float
    other_from_m: float
    other_to_m: float


def conflicting_groups(junction: Junction, roads: Roads) -> frozenset[frozenset[str]]:
    """Return the pairs of groups whose movements come closer than a lane is wide.

    Two lanes overlap where their centre lines are less than half of each width apart. Movements of
    one lane conflict as well: their groups would tell the same car different things.
    """
    return frozenset(
        frozenset((one.name, other.name))
        for one, other in combinations(junction.groups, 2)
        if any(meeting(a, b, roads) for a in one.movements for b in other.movements)
    )


def meeting(one: Conflict, other: Conflict, roads: Roads) -> Meeting | None:
    """Return where two movements meet, None if they do not; a pair of a known shape is known."""
    shape = _shape(one, other, roads)
    if shape not in roads.meetings:
        roads.meetings[shape] = _measure(one, other, roads)
    found: Meeting | None = roads.meetings[shape]
    return found


def _shape(one: Conflict, other: Conflict, roads: Roads) -> tuple[object, ...]:
    """Return all that decides whether two movements meet, wherever they lie; to a micrometre."""
    a, b = roads.definition(one.lane), roads.definition(other.lane)
    apart = tuple(round(b.start[k] - a.start[k], 6) for k in (0, 1))
    first = (a.start[2], a.segments, a.width_m, one.from_m, one.to_m)
    return (first, apart, b.start[2], b.segments, b.width_m, other.from_m, other.to_m)


def _measure(one: Conflict, other: Conflict, roads: Roads) -> Meeting | None:
    first, second = roads.lane(one.lane), roads.lane(other.lane)
    (a, at_a), (b, at_b) = _stretch(one, roads), _stretch(other, roads)
    least_m = (first.width_m + second.width_m) / 2.0
    apart = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0))
    if apart.max() >= least_m:
        return None
    dx, dy = np.subtract.outer(a[:, 0], b[:, 0]), np.subtract.outer(a[:, 1], b[:, 1])
    near = dx * dx + dy * dy < least_m**2
    if not near.any():
        return None
    along_a, along_b = at_a[near.any(axis=1)], at_b[near.any(axis=0)]
    return Meeting(
        float(along_a.min()), float(along_a.max()), float(along_b.min()), float(along_b.max())
    )


def _stretch(movement: Conflict, roads: Roads) -> tuple[Floats, Floats]:
    """Return the points of the movement's lane between its ends, (n, 2), and where each is [m]."""
    lane = roads.lane(movement.lane)
    inside = (lane.s > movement.from_m) & (lane.s < movement.to_m)
    ends = [lane.at(s)[:2] for s in (movement.from_m, movement.to_m)]
    at = np.concatenate((lane.s[inside], (movement.from_m, movement.to_m)))
    return np.vstack([lane.points[inside], np.array(ends)]), at
