"""From laid lanes and turns to a city map: floor, junctions or signs, spawn places."""

import math
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, Protocol

import msgspec

from scm.geometry import Pose2
from scm.maps.conflicts import meeting
from scm.maps.model import (
    Approach,
    Area,
    CityMap,
    Conflict,
    Crossing,
    Floor,
    Group,
    Junction,
    Lane,
    Light,
    MapTag,
    Point,
    Segment,
    Sign,
    Spawn,
    StopLine,
)
from scm.maps.polyline import advance, extent
from scm.maps.route import Roads
from scm.maps.sumo_curves import Curve
from scm.maps.sumo_read import Net, NetLane, NetLink

FASTEST_MPS = 0.25
SLOWEST_MPS = 0.08
PAINT_M = 0.01  # beside each lane: neighbours that touch are no conflict
LINE_BEFORE_M = 0.06
BESIDE_M = 0.45
TAG_M = 0.15  # from the floor's corner to the tag
POLE_M = 0.07
SPAWN_FROM_M = 0.10
SPAWN_EVERY_M = 0.7
SPAWN_TO_LINE_M = 0.35
PLAN = "calm"
DIGITS = 9


class LaidTurn(Protocol):
    """A way over a junction as it is laid."""

    @property
    def link(self) -> NetLink:
        """What it is in the network."""
        ...

    @property
    def curve(self) -> Curve:
        """Where it runs."""
        ...


class CityBuilder:
    """One city in the making; lengths are scaled already, speeds are not."""

    def __init__(
        self,
        net: Net,
        lanes: Mapping[str, NetLane],
        curves: Mapping[str, Curve],
        turns: Sequence[LaidTurn],
        scale: float,
    ) -> None:
        self._net, self._lanes, self._curves, self._turns = net, lanes, curves, turns
        self._scale = scale
        self._fastest = max(lane.speed_mps for lane in lanes.values())
        self._names: dict[str, str] = {}
        xs, ys = zip(*(point for lane in lanes.values() for point in lane.points), strict=True)
        self._low, self._high = (min(xs), min(ys)), (max(xs), max(ys))
        self._shift = (0.0, 0.0)

    def city(self, floor_m: tuple[float, float] | None) -> CityMap:
        """Return the city on a floor of this size; None: as large as it needs."""
        sides = [high - low for low, high in zip(self._low, self._high, strict=True)]
        width, depth = floor_m or (sides[0] + 2.0 * BESIDE_M, sides[1] + 2.0 * BESIDE_M)
        margins = ((width - sides[0]) / 2.0, (depth - sides[1]) / 2.0)
        self._shift = (
            margins[0] - TAG_M - self._low[0],
            margins[1] - TAG_M - self._low[1],
        )
        bare = CityMap(
            map=1,
            name=re.sub(r"[^a-z0-9_]", "_", self._net.name.lower())[:32],
            title=f"{self._net.name}, 1:{self._scale:g}",
            source="imported from a SUMO network",
            floor=Floor(x_m=_span(width), y_m=_span(depth), colour="#8ea583"),
            tag=MapTag(tag_id=0, size_m=0.0762),
            lanes=(*self._street_lanes(), *self._turn_lanes()),
            areas=tuple(self._areas()),
        )
        return self._ruled(bare)

    def _street_lanes(self) -> Iterator[Lane]:
        following: dict[str, list[str]] = defaultdict(list)
        for turn in self._turns:
            following[turn.link.start].append(way_name(turn.link))
        for name, lane in self._lanes.items():
            yield self._lane(name, self._curves[name], [lane], tuple(following[name]))

    def _turn_lanes(self) -> Iterator[Lane]:
        for turn in self._turns:
            both = [self._lanes[turn.link.start], self._lanes[turn.link.end]]
            yield self._lane(way_name(turn.link), turn.curve, both, (turn.link.end,))

    def _lane(
        self, name: str, curve: Curve, like: Sequence[NetLane], following: tuple[str, ...]
    ) -> Lane:
        speed = FASTEST_MPS * min(lane.speed_mps for lane in like) / self._fastest
        x, y, yaw = curve.start
        return Lane(
            name=name,
            width_m=round(min(lane.width_m for lane in like) - PAINT_M, 4),
            start=(*self._at(x, y), round(yaw, DIGITS)),
            segments=tuple(_rounded(segment) for segment in curve.segments),
            next=following,
            speed_limit_mps=round(max(SLOWEST_MPS, speed), 4),
        )

    def _at(self, x: float, y: float) -> Point:
        return round(x + self._shift[0], DIGITS), round(y + self._shift[1], DIGITS)

    def _areas(self) -> Iterator[Area]:
        for node, shape in self._net.shapes.items():
            points = tuple(self._at(x / self._scale, y / self._scale) for x, y in shape)
            if len(set(points)) > 2:
                yield Area(name=self.name_of(node), points=points)

    def name_of(self, node: str) -> str:
        """Return a junction's name on the bus, always the same for the same SUMO id."""
        if node not in self._names:
            wished = re.sub(r"[^a-z0-9_-]", "_", node.lower())[:22] or "_"
            taken = set(self._names.values())
            count, name = 1, wished
            while name in taken:
                count += 1
                name = f"{wished}_{count}"
            self._names[node] = name
        return self._names[node]

    def _ruled(self, bare: CityMap) -> CityMap:
        """Return the city with signals, signs and spawn places."""
        roads = Roads(bare)
        lit, unlit = self._by_junction(roads)
        junctions, lines = [], []
        lights: list[Light] = []
        for number, (name, approaches) in enumerate(lit.items(), start=1):
            groups = []
            for count, (lane, links) in enumerate(approaches.items(), start=1):
                first, *more = _ways(links, roads)
                groups.append(Group(name=lane, number=count, movement=first, more=tuple(more)))
                at_m = line_at(roads, lane)
                lines.append(
                    StopLine(name=f"{name}_{lane}", lane=lane, at_m=at_m, junction=name, group=lane)
                )
                pole = _pole(roads, lane, at_m)
                lights.append(Light(light_id=len(lights) + 1, junction=name, group=lane, **pole))
            junctions.append(Junction(name=name, number=number, groups=tuple(groups), plan=PLAN))
        crossings = [
            Crossing(name=name, approaches=tuple(_approach(lane, links, roads)
                     for lane, links in approaches.items()))
            for name, approaches in unlit.items()
        ]  # fmt: skip
        signed = [(lane, links) for approaches in unlit.values() for lane, links in
                  approaches.items()]  # fmt: skip
        return msgspec.structs.replace(
            bare,
            junctions=tuple(junctions),
            crossings=tuple(crossings),
            stop_lines=tuple(lines),
            lights=tuple(lights),
            signs=tuple(_signs(signed, roads)),
            spawns=tuple(_spawns(roads, list(self._lanes))),
        )

    def _by_junction(
        self, roads: Roads
    ) -> tuple[dict[str, dict[str, list[NetLink]]], dict[str, dict[str, list[NetLink]]]]:
        """Return the links by junction and lane: those with signals, and those without.

        Where no ways of two lanes meet there is nothing to rule.
        """
        lit: dict[str, dict[str, list[NetLink]]] = defaultdict(lambda: defaultdict(list))
        unlit: dict[str, dict[str, list[NetLink]]] = defaultdict(lambda: defaultdict(list))
        for turn in self._turns:
            link = turn.link
            table, key = (lit, link.signal) if link.signal else (unlit, link.node)
            table[self.name_of(key)][link.start].append(link)
        return tuple(  # type: ignore[return-value]
            {name: lanes for name, lanes in table.items() if _any_meet(lanes, roads)}
            for table in (lit, unlit)
        )


def way_name(link: NetLink) -> str:
    """Return the name of the lane over a junction from one lane to another."""
    return f"{link.start}..{link.end}"


def line_at(roads: Roads, lane: str) -> float:
    """Return where cars wait at the end of a lane."""
    length = roads.length_of(lane)
    return round(max(length - LINE_BEFORE_M, 0.5 * length), 4)


def _ways(links: Sequence[NetLink], roads: Roads) -> list[Conflict]:
    names = [way_name(link) for link in links]
    return [
        Conflict(lane=name, from_m=0.0, to_m=math.floor(roads.length_of(name) * 1e4) / 1e4)
        for name in names
    ]


def _any_meet(lanes: Mapping[str, Sequence[NetLink]], roads: Roads) -> bool:
    ways = {lane: _ways(links, roads) for lane, links in lanes.items()}
    return any(
        meeting(a, b, roads) is not None
        for one, other in combinations(ways.values(), 2)
        for a in one
        for b in other
    )


def _approach(lane: str, links: Sequence[NetLink], roads: Roads) -> Approach:
    return Approach(
        name=lane, lane=lane, at_m=line_at(roads, lane), ways=tuple(_ways(links, roads))
    )


def _signs(signed: Sequence[tuple[str, Sequence[NetLink]]], roads: Roads) -> Iterator[Sign]:
    """Yield the signs of lanes that do not go first; SUMO's state is that of the straightest."""
    number = 0
    for lane, links in signed:
        states = {link.state for link in links}
        straightest = min(links, key=lambda link: _bend(roads, way_name(link)))
        if states & {"s", "w"}:
            kind = "stop"
        elif straightest.state == "m":
            kind = "give_way"
        else:
            continue
        number += 1
        at_m = line_at(roads, lane)
        yield Sign(sign_id=number, kind=kind, lane=lane, at_m=at_m, **_pole(roads, lane, at_m))


def _bend(roads: Roads, lane: str) -> float:
    pieces = map(extent, roads.definition(lane).segments)
    return abs(sum(length * curvature for length, curvature in pieces))


def _pole(roads: Roads, lane: str, at_m: float) -> dict[str, Any]:
    """Return the place of what stands to the right of a line and looks at who comes."""
    x, y, yaw = _pose(roads.definition(lane), at_m)
    right = roads.definition(lane).width_m / 2.0 + POLE_M
    beside = Pose2(x, y, yaw).apply(0.0, -right)
    yaw = math.remainder(yaw + math.pi, math.tau)
    return {"x_m": round(beside[0], 4), "y_m": round(beside[1], 4), "yaw_rad": round(yaw, 6)}


def _pose(lane: Lane, at_m: float) -> Pose2:
    pose = Pose2(*lane.start)
    for length, curvature in map(extent, lane.segments):
        if at_m <= length:
            return advance(pose, at_m, curvature)
        pose, at_m = advance(pose, length, curvature), at_m - length
    return pose


def _spawns(roads: Roads, lanes: Sequence[str]) -> Iterator[Spawn]:
    """Yield places along the lanes: first one on each of them, then a second one, ..."""
    rooms = {lane: line_at(roads, lane) - SPAWN_TO_LINE_M for lane in lanes}
    most = max((int((room - SPAWN_FROM_M) / SPAWN_EVERY_M) for room in rooms.values()), default=-1)
    for k in range(most + 1):
        for lane, room in rooms.items():
            at_m = SPAWN_FROM_M + k * SPAWN_EVERY_M
            if at_m <= room:
                yield Spawn(name=f"{lane}_at{k}", lane=lane, at_m=round(at_m, 4))


def _rounded(segment: Segment) -> Segment:
    if segment.length_m is not None:
        return Segment(length_m=round(segment.length_m, DIGITS))
    assert segment.radius_m is not None  # noqa: S101 an arc has both
    assert segment.angle_rad is not None  # noqa: S101
    return Segment(
        radius_m=round(segment.radius_m, DIGITS), angle_rad=round(segment.angle_rad, DIGITS)
    )


def _span(side_m: float) -> tuple[float, float]:
    return round(-TAG_M, 4), round(side_m - TAG_M, 4)
