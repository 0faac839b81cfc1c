"""From laid lanes and turns to a city map: floor, junctions or signs, spawn places."""

import math
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol

import msgspec

from scm.geometry import Pose2
from scm.maps.conflicts import meeting
from scm.maps.polyline import advance, extent
from scm.maps.route import Roads
from scm.maps.sumo_curves import Curve
from scm.maps.sumo_read import Net, NetLane, NetLink
from scm.maps.sumo_ruled import Ruled, bus_names, ruled
from scm.records.city_map import (
    Approach,
    Area,
    CityMap,
    Conflict,
    Crossing,
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
from scm.records.floor import Floor

MAX_SPEED_MPS = 0.25  # of the fastest street: a Nigel drives 0.267 m/s
MIN_SPEED_MPS = 0.08  # of the slowest, so that nobody stands
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
    """One city in the making; lengths are scaled already, speeds are not.

    Attributes:
        ruled: The junctions where ways meet, once the city is made.
        idle_signals: The network's traffic lights that rule nothing, for no ways meet there.
    """

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
        self.ruled: list[Ruled] = []
        self.idle_signals: list[str] = []
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
            name=_map_name(self._net.name),
            title=f"{self._net.name}, 1:{self._scale:g}",
            source="imported from a SUMO network",
            drives_on=self._net.head.drives_on,
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
        speed = MAX_SPEED_MPS * min(lane.speed_mps for lane in like) / self._fastest
        x, y, yaw = curve.start
        return Lane(
            name=name,
            width_m=round(min(lane.width_m for lane in like) - PAINT_M, 4),
            start=(*self._at(x, y), round(yaw, DIGITS)),
            segments=tuple(_rounded(segment) for segment in curve.segments),
            next=following,
            speed_limit_mps=round(max(MIN_SPEED_MPS, speed), 4),
        )

    def _at(self, x: float, y: float) -> Point:
        return round(x + self._shift[0], DIGITS), round(y + self._shift[1], DIGITS)

    def in_network(self, x_m: float, y_m: float) -> Point:
        """Return where a place of the city is in the network [m at full size]."""
        return (x_m - self._shift[0]) * self._scale, (y_m - self._shift[1]) * self._scale

    def _areas(self) -> Iterator[Area]:
        names = bus_names(self._net.shapes)
        for name, shape in zip(names, self._net.shapes.values(), strict=True):
            points = tuple(self._at(x / self._scale, y / self._scale) for x, y in shape)
            if len(set(points)) > 2:
                yield Area(name=name, points=points)

    def _ruled(self, bare: CityMap) -> CityMap:
        """Return the city with signals, signs and spawn places."""
        roads = Roads(bare)
        links = [turn.link for turn in self._turns]
        self.ruled, self.idle_signals = ruled(
            links, lambda a, b: meeting(_way(a, roads), _way(b, roads), roads) is not None
        )
        lit = [junction for junction in self.ruled if junction.signals]
        unlit = [junction for junction in self.ruled if not junction.signals]
        lines = [
            StopLine(
                name=lane, lane=lane, at_m=line_at(roads, lane), junction=junction.name, group=lane
            )
            for junction in lit for lane in junction.approaches
        ]  # fmt: skip
        return msgspec.structs.replace(
            bare,
            junctions=tuple(_junction(one, k, roads) for k, one in enumerate(lit, start=1)),
            crossings=tuple(_crossing(one, roads) for one in unlit),
            stop_lines=tuple(lines),
            lights=tuple(
                Light(
                    light_id=k, junction=line.junction, group=line.group,
                    **_pole(roads, line.lane, line.at_m),
                )
                for k, line in enumerate(lines, start=1)
            ),
            signs=tuple(_signs(unlit, roads)),
            spawns=tuple(_spawns(roads, list(self._lanes))),
        )  # fmt: skip


def _map_name(given: str) -> str:
    name = re.sub(r"[^a-z0-9_]", "_", given.lower())[:32]
    return name if name.strip("_") else "city"


def way_name(link: NetLink) -> str:
    """Return the name of the lane over a junction from one lane to another."""
    return f"{link.start}..{link.end}"


def line_at(roads: Roads, lane: str) -> float:
    """Return where cars wait at the end of a lane."""
    length = roads.length_of(lane)
    return round(max(length - LINE_BEFORE_M, 0.5 * length), 4)


def _way(link: NetLink, roads: Roads) -> Conflict:
    name = way_name(link)
    return Conflict(lane=name, from_m=0.0, to_m=math.floor(roads.length_of(name) * 1e4) / 1e4)


def _junction(junction: Ruled, number: int, roads: Roads) -> Junction:
    groups = []
    for count, (lane, links) in enumerate(junction.approaches.items(), start=1):
        first, *more = (_way(link, roads) for link in links)
        groups.append(Group(name=lane, number=count, movement=first, more=tuple(more)))
    return Junction(name=junction.name, number=number, groups=tuple(groups), plan=PLAN)


def _crossing(junction: Ruled, roads: Roads) -> Crossing:
    return Crossing(
        name=junction.name,
        approaches=tuple(
            Approach(
                name=lane, lane=lane, at_m=line_at(roads, lane),
                ways=tuple(_way(link, roads) for link in links),
            )
            for lane, links in junction.approaches.items()
        ),
    )  # fmt: skip


def _signs(unlit: Sequence[Ruled], roads: Roads) -> Iterator[Sign]:
    """Yield the signs of lanes that do not go first; SUMO's state is that of the straightest."""
    number = 0
    approaches = (pair for junction in unlit for pair in junction.approaches.items())
    for lane, links in approaches:
        straightest = min(links, key=lambda link: _bend(roads, way_name(link)))
        if {link.state for link in links} & {"s", "w"}:
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
    """Return the place of what stands beside a line, on the road's own side, facing the cars."""
    x, y, yaw = _pose(roads.definition(lane), at_m)
    out = roads.definition(lane).width_m / 2.0 + POLE_M
    side = 1.0 if roads.city_map.drives_on == "left" else -1.0
    beside = Pose2(x, y, yaw).apply(0.0, side * out)
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
