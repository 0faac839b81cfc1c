"""Closed tracks of one lane: a random polygon whose corners are arcs, driven one way round."""

import math

import numpy as np

from scm.arrays import Floats
from scm.records.city_map import CityMap, Lane, MapTag, Segment, Spawn, Wall
from scm.records.floor import Floor

CORNERS, REACH_M = (5, 8), (1.1, 1.9)  # of the polygon; of a corner from the middle
RADIUS_M, STRAIGHT_M = (0.5, 0.8), 0.1  # of a corner's arc, where it has room; least between two
LANE_M, SPEED_MPS, BESIDE_M = 0.257, 0.25, 0.35  # as in Driving School; from track to wall
TIGHTEST_M, TRIES = 0.4, 500
FLOORS = ("#8ea583", "#9a9184", "#7f8f9c")


def track(seed: int) -> CityMap:
    """Return a random track; every second one is driven clockwise.

    Raises:
        RuntimeError: when none is found.
    """
    rng = np.random.default_rng([seed, *b"track"])
    for _ in range(TRIES):
        count = int(rng.integers(*CORNERS, endpoint=True))
        about = np.sort(rng.uniform(0.0, 2.0 * math.pi, count))
        reach = rng.uniform(*REACH_M, count)
        corners = np.column_stack((reach * np.cos(about), reach * np.sin(about)))
        lane = _lane(corners if seed % 2 else corners[::-1], rng)
        if lane is not None:
            return _map(f"track_{seed}", lane, corners, FLOORS[seed % len(FLOORS)])
    raise RuntimeError(f"track {seed}: expected a polygon with room for arcs, found none")


def _lane(corners: Floats, rng: np.random.Generator) -> Lane | None:
    """Return the lane, from behind the first corner; None: an arc has no room, or it bends back."""
    sides = np.roll(corners, -1, axis=0) - corners
    lengths, yaws = np.hypot(*sides.T), np.arctan2(sides[:, 1], sides[:, 0])
    turns = np.angle(np.exp(1j * (yaws - np.roll(yaws, 1))))  # at each corner
    if abs(abs(turns.sum()) - 2.0 * math.pi) > 1e-6 or np.abs(turns).max() > 2.2:
        return None
    tangents = np.tan(0.5 * np.abs(turns))
    radii = rng.uniform(*RADIUS_M, len(corners))
    room = 0.5 * (np.minimum(lengths, np.roll(lengths, 1)) - STRAIGHT_M)
    radii = np.minimum(radii, room / np.maximum(tangents, 1e-9))
    if radii.min() < TIGHTEST_M:
        return None
    cut = radii * tangents
    straights = lengths - cut - np.roll(cut, -1)
    start = corners[0] + cut[0] * sides[0] / lengths[0]
    segments = list[Segment]()
    for at in range(len(corners)):
        after = (at + 1) % len(corners)
        segments += [
            Segment(length_m=float(straights[at])),
            Segment(radius_m=float(radii[after]), angle_rad=float(turns[after])),
        ]
    pose = float(start[0]), float(start[1]), float(yaws[0])
    return Lane(
        name="track", width_m=LANE_M, start=pose, segments=tuple(segments), next=("track",),
        speed_limit_mps=SPEED_MPS,
    )  # fmt: skip


def _map(name: str, lane: Lane, corners: Floats, colour: str) -> CityMap:
    low, high = corners.min(axis=0) - BESIDE_M, corners.max(axis=0) + BESIDE_M
    (left, bottom), (right, top) = map(tuple, (low.tolist(), high.tolist()))
    walls = ((left, bottom), (right, bottom), (right, top), (left, top))
    return CityMap(
        map=1, name=name, title=name, source="studies/tracks.py",
        floor=Floor(x_m=(left, right), y_m=(bottom, top), colour=colour),
        tag=MapTag(tag_id=0, size_m=0.0762), lanes=(lane,),
        walls=(Wall(points=walls, closed=True),),
        spawns=(Spawn(name="start", lane=lane.name, at_m=0.0),),
    )  # fmt: skip
