"""Lanes as polylines, the graph they form, and routes as one long path along them."""

import heapq
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from scm.arrays import Floats
from scm.errors import MapError, nearest
from scm.geometry import Pose2, wrap_angle
from scm.maps.coordinates import EXAMPLE, are_coordinates, pose_at
from scm.maps.once_per_map import once_per_map
from scm.maps.polyline import Polyline, advance, extent, join, sample
from scm.maps.signs import SPEED_LIMIT, Held, allowed_next, is_obeyed, looks_along
from scm.records.city_map import Approach, Bay, CityMap, Conflict, Lane, Spawn, StopLine

MAX_HEADING_ERROR_RAD = math.radians(60.0)  # between a car and its lane
MAX_PASSES = 400  # lanes of one route: its path takes 0.1 ms a lane while the city waits
MAX_LANE_DISTANCE_M = 0.5


class LanePath(Polyline):
    """A lane's centre line, from its start to its end.

    Attributes:
        name: The lane's.
        width_m: Across the lane.
        speed_limit_mps: The lane's.
    """

    def __init__(self, lane: Lane) -> None:
        line = sample(Pose2(*lane.start), lane.segments)
        super().__init__(line.points, line.s, line.yaw, line.curvature)
        self.name = lane.name
        self.width_m = lane.width_m
        self.speed_limit_mps = lane.speed_limit_mps


class _Lanes(Mapping[str, LanePath]):
    """Lanes by name; thousands of them are laid only as far as somebody asks for them."""

    def __init__(self, lanes: Sequence[Lane]) -> None:
        self._known = {lane.name: lane for lane in lanes}
        self._laid: dict[str, LanePath] = {}

    def __getitem__(self, name: str) -> LanePath:
        laid = self._laid.get(name)
        if laid is None:
            laid = self._laid[name] = LanePath(self._known[name])
        return laid

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


class OnLane(NamedTuple):
    """A place on a lane: distance from its start and to the left of its centre line [m]."""

    lane: str
    s: float
    lateral: float


class Roads:
    """The lanes of a map as a graph.

    Attributes:
        city_map: The map they come from.
        lanes: By name, in the order of the file; each is laid when it is first asked for.
        meetings: Where movements of known shapes meet, for `maps.conflicts`.
        signs: Those that cars obey, by lane.
        lane_graph: The same lanes for compiled drivers, once built.
    """

    def __init__(self, city_map: CityMap) -> None:
        self.city_map = city_map
        self.lanes: Mapping[str, LanePath] = _Lanes(city_map.lanes)
        self.lane_graph: Any = None
        self.meetings: dict[tuple[object, ...], Any] = {}
        self._definitions = {lane.name: lane for lane in city_map.lanes}
        self._length = {
            lane.name: sum(extent(segment)[0] for segment in lane.segments)
            for lane in city_map.lanes
        }
        self._spawns: dict[str, Spawn | Bay] = {spawn.name: spawn for spawn in city_map.spawns}
        self._spawns |= {bay.name: bay for bay in city_map.bays}
        self._lines: dict[str, list[StopLine]] = {}
        for line in sorted(city_map.stop_lines, key=lambda line: line.at_m):
            self._lines.setdefault(line.lane, []).append(line)
        self._group_lines: dict[tuple[str, str], list[StopLine]] = {}
        for line in city_map.stop_lines:
            self._group_lines.setdefault((line.junction, line.group), []).append(line)
        self._movements: dict[str, list[tuple[str, Conflict]]] = {}
        for junction in city_map.junctions:
            for group in junction.groups:
                for move in group.movements:
                    self._movements.setdefault(move.lane, []).append((junction.name, move))
        self._approaches: dict[str, list[tuple[str, Approach]]] = {}
        for crossing in city_map.crossings:
            for approach in crossing.approaches:
                self._approaches.setdefault(approach.lane, []).append((crossing.name, approach))
                for move in approach.ways:
                    self._movements.setdefault(move.lane, []).append((crossing.name, move))
        self._boxes: Floats | None = None
        self.signs = self._held_signs()
        self._next = {name: lane.next for name, lane in self._definitions.items()}
        for name, held in self.signs.items():
            signs = tuple(one.sign for one in held)
            self._next[name] = allowed_next(self._definitions[name], self._definitions, signs)

    def lane(self, name: str) -> LanePath:
        """Return a lane; MapError names the nearest one if there is none of that name."""
        self.check_lane(name)
        return self.lanes[name]

    def check_lane(self, name: str) -> str:
        """Return the name of a lane that exists; MapError names the nearest one otherwise."""
        if name not in self._definitions:
            raise MapError(
                f"map {self.city_map.name}: no lane {name!r}{nearest(name, list(self.lanes))}"
            )
        return name

    def definition(self, lane: str) -> Lane:
        """Return a lane as the map says it."""
        return self._definitions[self.check_lane(lane)]

    def length_of(self, lane: str) -> float:
        """Return the length of a lane's centre line [m], without laying it."""
        return self._length[self.check_lane(lane)]

    def successors(self, lane: str) -> tuple[str, ...]:
        """Return the lanes that begin where this one ends, as far as its turn signs allow."""
        return self._next[self.check_lane(lane)]

    def nearest(self, pose: Pose2) -> OnLane | None:
        """Return the closest lane that runs within 60 degrees of the pose's direction.

        None if the map has no lane of such a direction, or the pose is over 0.5 m off all of them.
        """
        best: tuple[float, OnLane] | None = None
        for lane in self._lanes_near(pose.x, pose.y):
            s, lateral = lane.project(pose.x, pose.y)
            foot = lane.at(s)
            if abs(wrap_angle(foot.yaw - pose.yaw)) > MAX_HEADING_ERROR_RAD:
                continue
            away = math.hypot(pose.x - foot.x, pose.y - foot.y)
            if away <= MAX_LANE_DISTANCE_M and (best is None or away < best[0] - 1e-9):
                best = away, OnLane(lane.name, s, lateral)
        return best[1] if best else None

    def stop_lines_on(self, lane: str) -> tuple[StopLine, ...]:
        """Return the stop lines of a lane in driving order."""
        return tuple(self._lines.get(lane, ()))

    def line_ahead(self, lanes: Iterable[str], from_m: float) -> tuple[StopLine, float] | None:
        """Return the next stop line on some lanes, one after the other, and the way there [m].

        Args:
            lanes: Of a route.
            from_m: Where on it the way begins, from the begin of the first lane.
        """
        begin_m = -from_m
        for lane in lanes:
            for line in self.stop_lines_on(lane):
                if begin_m + line.at_m >= 0.0:
                    return line, begin_m + line.at_m
            begin_m += self.length_of(lane)
        return None

    def stop_lines_of(self, junction: str, group: str) -> tuple[StopLine, ...]:
        """Return the stop lines at which a signal group is obeyed."""
        return tuple(self._group_lines.get((junction, group), ()))

    def movements_on(self, lane: str) -> tuple[tuple[str, Conflict], ...]:
        """Return (junction, stretch) of every movement on a lane, in the order of the file."""
        return tuple(self._movements.get(lane, ()))

    def approaches_on(self, lane: str) -> tuple[tuple[str, Approach], ...]:
        """Return (crossing, approach) of every line without lights on a lane."""
        return tuple(self._approaches.get(lane, ()))

    def limits_on(self, lane: str) -> list[tuple[float, float]]:
        """Return (from [m], speed limit [m/s]) along a lane: its own, then those of its signs."""
        limits = [(0.0, self.definition(lane).speed_limit_mps)]
        for held in self.signs.get(lane, ()):
            if held.sign.kind == SPEED_LIMIT and held.sign.value_mps is not None:
                limits.append((held.at_m, min(limits[0][1], held.sign.value_mps)))
        return limits

    def spawn_pose(self, name: str) -> Pose2:
        """Return the pose of the rear axle of a car at a spawn place, in a bay, or at `X,Y,DEG`.

        Raises:
            MapError: when there is no such place, or the coordinates lie off the floor.
        """
        if are_coordinates(name):
            return self._on_floor(name)
        spawn = self._spawns.get(name)
        if spawn is None:
            known = nearest(name, list(self._spawns))
            expected = (
                f"expected one of {', '.join(self._spawns) or 'none'}, or X,Y,DEG as {EXAMPLE}"
            )
            raise MapError(f"map {self.city_map.name}: no spawn {name!r}{known}; {expected}")
        return self._pose_of(spawn)

    def _on_floor(self, coordinates: str) -> Pose2:
        pose, floor = pose_at(coordinates), self.city_map.floor
        for axis, value, (low, high) in (("x", pose.x, floor.x_m), ("y", pose.y, floor.y_m)):
            if not low <= value <= high:
                msg = (
                    f"spawn: {axis} of {coordinates!r} is {value:g} m, expected {low:g} to {high:g}"
                )
                raise MapError(f"{msg}: the floor of map {self.city_map.name}")
        return pose

    def route(self, start_lane: str, via: tuple[str, ...] = (), laps: int = 1) -> tuple[str, ...]:
        """Return the lanes of the shortest way from a lane through others, in driving order.

        Args:
            start_lane: First lane of the route.
            via: Lanes to pass in this order; the last one ends the route. The start lane counts
                as passed if it is the first. Empty: the loop that the start lane lies on.
            laps: How often to pass `via`, or the loop.

        Raises:
            MapError: A lane is unknown or cannot be reached, or there are too many to pass.
        """
        if laps < 1:
            raise MapError(f"laps: expected at least 1, got {laps}")
        passes = laps * max(1, len(via))
        if passes > MAX_PASSES:  # its path takes 0.1 ms a lane to lay, while the car's city waits
            msg = f"laps x via: expected at most {MAX_PASSES} lanes to pass, got {passes}"
            raise MapError(msg)
        if not via:
            return self.loop(start_lane) * laps
        lanes = [self.check_lane(start_lane)]
        wanted = list(via) * laps
        if wanted[0] == start_lane:
            del wanted[0]
        for name in wanted:
            lanes += self._way(lanes[-1], self.check_lane(name))
        return tuple(lanes)

    def circulate(self, start_lane: str) -> Iterator[str]:
        """Yield lanes for ever, at each end the first lane that follows; stops at a dead end."""
        lane = self.check_lane(start_lane)
        while True:
            yield lane
            following = self._next[lane]
            if not following:
                return
            lane = following[0]

    def loop(self, start_lane: str) -> tuple[str, ...]:
        """Return one round of `circulate`; MapError if it does not come back to its start."""
        lanes: list[str] = []
        for lane in self.circulate(start_lane):
            if lanes and lane == start_lane:
                return tuple(lanes)
            if lane in lanes:
                break
            lanes.append(lane)
        raise MapError(
            f"map {self.city_map.name}: no way round from lane {start_lane!r} back to it "
            f"(the first followers lead {' -> '.join(lanes)})"
        )

    def _way(self, start: str, goal: str) -> list[str]:
        """Return the shortest way after `start` up to `goal`, which may be the same lane again."""
        queue: list[tuple[float, list[str]]] = [(0.0, [start])]
        done: set[str] = set()
        while queue:
            length, lanes = heapq.heappop(queue)
            if lanes[-1] == goal and len(lanes) > 1:
                return lanes[1:]
            for following in self._next[lanes[-1]]:
                if following not in done:
                    done.add(following)
                    way = length + self._length[following]
                    heapq.heappush(queue, (way, [*lanes, following]))
        raise MapError(f"map {self.city_map.name}: no way from lane {start!r} to {goal!r}")

    def _held_signs(self) -> dict[str, tuple[Held, ...]]:
        """Return the signs that cars obey by lane, in driving order."""
        found: dict[str, list[Held]] = {}
        for sign in filter(is_obeyed, self.city_map.signs):
            place = self.nearest(looks_along(sign)) if sign.lane is None else None
            lane = place.lane if place is not None else sign.lane
            if lane is not None:
                at_m = sign.at_m if sign.at_m is not None else place.s if place is not None else 0.0
                found.setdefault(lane, []).append(Held(sign, lane, at_m))
        return {lane: tuple(sorted(row, key=lambda h: h.at_m)) for lane, row in found.items()}

    def _lanes_near(self, x: float, y: float) -> list[LanePath]:
        """Return the lanes that may come within reach of a point, in the order of the file."""
        if self._boxes is None:
            boxes = [_box_of(lane) for lane in self.city_map.lanes]
            self._boxes = np.array(boxes, np.float64).reshape(-1, 4)
        left, low, right, high = self._boxes.T
        near = (left <= x) & (x <= right) & (low <= y) & (y <= high)
        return [self.lanes[self.city_map.lanes[k].name] for k in np.flatnonzero(near)]

    def _pose_of(self, spawn: Spawn | Bay) -> Pose2:
        """Return the pose that a spawn's lane and distance, or its own pose, stands for."""
        if isinstance(spawn, Bay):
            return Pose2(*spawn.pose)
        if spawn.pose is not None:
            return Pose2(*spawn.pose)
        if spawn.lane is None or spawn.at_m is None:
            raise MapError(f"spawn {spawn.name!r}: expected lane and at_m, or pose; got neither")
        return self.lane(spawn.lane).at(spawn.at_m)


@once_per_map
def roads_of(city_map: CityMap) -> Roads:
    """Return the roads of a map, shared by all who are given the same map."""
    return Roads(city_map)


class Path:
    """The lanes of a route as one polyline; all distances count from the route's start.

    Attributes:
        roads: Where its lanes come from.
        lanes: The route.
        closed: The route goes round for ever: every distance may exceed `length_m` or be negative,
            and `project` near a hint counts on through the laps.
        length_m: Of the route, or of one round.
        stop_lines: With their distances, in driving order, of one round.
        conflicts: Stretches (from, to, junction) where nobody may stop, of one round.
    """

    def __init__(self, roads: Roads, lanes: Sequence[str], *, closed: bool = False) -> None:
        if not lanes:
            raise MapError("route: expected at least one lane, got none")
        self.roads = roads
        self.lanes = tuple(lanes)
        self.closed = closed
        self._check_follows(roads)
        pieces = [roads.lane(name) for name in lanes]
        self._line = join(pieces, closed=closed)
        self.length_m = self._line.length_m
        self._starts = [0.0]
        for piece in pieces:
            self._starts.append(self._starts[-1] + piece.length_m)
        self._limits = [roads.limits_on(name) for name in lanes]
        self.stop_lines = [
            (start + line.at_m, line)
            for start, name in zip(self._starts, lanes, strict=False)
            for line in roads.stop_lines_on(name)
        ]
        self.conflicts = sorted(
            (start + move.from_m, start + move.to_m, junction)
            for start, name in zip(self._starts, lanes, strict=False)
            for junction, move in roads.movements_on(name)
        )

    @classmethod
    def circulation(cls, roads: Roads, start_lane: str) -> "Path":
        """Return the closed path of the loop that a lane lies on."""
        return cls(roads, roads.loop(start_lane), closed=True)

    def at(self, s: float) -> Pose2:
        """Return the pose on the centre line; beyond an open end it stays at the end."""
        return self._line.at(s)

    def curvature(self, s: float) -> float:
        """Return the curvature [1/m], + = turns left."""
        return self._line.curvature_at(s)

    def project(self, x: float, y: float, near_s: float | None = None) -> tuple[float, float]:
        """Return distance along the path and beside it [m], + = left; see `Polyline.project`.

        A route may pass the same place twice: give `near_s`, the last known distance.
        """
        return self._line.project(x, y, near_s)

    def lane_at(self, s: float) -> str:
        """Return the name of the lane at a distance."""
        return self.lanes[self._lane_index(s)]

    def index_at(self, s: float) -> tuple[int, float]:
        """Return which lane of the route holds a distance, and the distance from its start [m]."""
        index = self._lane_index(s)
        return index, self._inside(s) - self._starts[index]

    def speed_limit_mps(self, s: float) -> float:
        """Return the limit at a distance: of the lane, or of the last sign on it."""
        index, on_lane = self.index_at(s)
        return next(limit for at, limit in reversed(self._limits[index]) if at <= on_lane)

    def _lane_index(self, s: float) -> int:
        """Return which lane of the route holds a distance."""
        inside = self._inside(s)
        for index in range(len(self.lanes) - 1, 0, -1):
            if inside >= self._starts[index]:
                return index
        return 0

    def _inside(self, s: float) -> float:
        """Return the same place as a distance from 0 to the length."""
        return s % self.length_m if self.closed else min(max(s, 0.0), self.length_m)

    def _check_follows(self, roads: Roads) -> None:
        """Refuse a route with a lane that does not follow the one before it."""
        pairs = list(zip(self.lanes, self.lanes[1:], strict=False))
        if self.closed:
            pairs.append((self.lanes[-1], self.lanes[0]))
        for before, after in pairs:
            if after not in roads.successors(before):
                raise MapError(
                    f"route: lane {after!r} does not follow {before!r}; expected one of "
                    f"{', '.join(roads.successors(before)) or 'none: it is a dead end'}"
                )


def _box_of(lane: Lane) -> tuple[float, float, float, float]:
    """Return left, low, right, high of a lane, wide enough for all that counts as near it [m]."""
    pose = Pose2(*lane.start)
    xs, ys, bulge = [pose.x], [pose.y], 0.0
    for segment in lane.segments:
        length, curvature = extent(segment)
        pose = advance(pose, length, curvature)
        xs.append(pose.x)
        ys.append(pose.y)
        if curvature:
            bulge = max(bulge, min(0.5 * length, 2.0 / abs(curvature)))
    out = bulge + MAX_LANE_DISTANCE_M
    return min(xs) - out, min(ys) - out, max(xs) + out, max(ys) + out
