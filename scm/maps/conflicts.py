"""Which signal groups of a junction may never be green together: read off their geometry."""

from itertools import combinations

import numpy as np

from scm.arrays import Floats
from scm.maps.model import Conflict, Junction
from scm.maps.route import Roads


def conflicting_groups(junction: Junction, roads: Roads) -> frozenset[frozenset[str]]:
    """Return the pairs of groups whose movements come closer than a lane is wide.

    Two lanes overlap where their centre lines are less than half of each width apart. Movements of
    one lane conflict as well: their groups would tell the same car different things.
    """
    return frozenset(
        frozenset((one.name, other.name))
        for one, other in combinations(junction.groups, 2)
        if any(_meet(a, b, roads) for a in one.movements for b in other.movements)
    )


def _meet(one: Conflict, other: Conflict, roads: Roads) -> bool:
    """Return whether two movements overlap; a pair that looks like an earlier one is known."""
    shape = _shape(one, other, roads)
    if shape not in roads.overlaps:
        roads.overlaps[shape] = _overlap(one, other, roads)
    return roads.overlaps[shape]


def _shape(one: Conflict, other: Conflict, roads: Roads) -> tuple[object, ...]:
    """Return all that decides whether two movements meet, wherever they lie; to a micrometre."""
    a, b = roads.definition(one.lane), roads.definition(other.lane)
    apart = tuple(round(b.start[k] - a.start[k], 6) for k in (0, 1))
    first = (a.start[2], a.segments, a.width_m, one.from_m, one.to_m)
    return (first, apart, b.start[2], b.segments, b.width_m, other.from_m, other.to_m)


def _overlap(one: Conflict, other: Conflict, roads: Roads) -> bool:
    first, second = roads.lane(one.lane), roads.lane(other.lane)
    a, b = _stretch(one, roads), _stretch(other, roads)
    squared = ((a[:, None, :] - b[None, :, :]) ** 2).sum(axis=2)
    return bool(squared.min() < ((first.width_m + second.width_m) / 2.0) ** 2)


def _stretch(movement: Conflict, roads: Roads) -> Floats:
    """Return the points of the movement's lane between its ends, shape (n, 2) [m]."""
    lane = roads.lane(movement.lane)
    inside = (lane.s > movement.from_m) & (lane.s < movement.to_m)
    ends = [lane.at(s)[:2] for s in (movement.from_m, movement.to_m)]
    return np.vstack([lane.points[inside], np.array(ends)])
