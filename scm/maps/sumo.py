"""A SUMO network as a city: lanes as straights and arcs, signals and signs for our drivers.

    length   full scale / scale
    speed    the fastest lane of the network is driven at 0.25 m/s, all others in proportion
    turns    laid anew from lane to lane; where a turn is tighter than a Nigel can steer, the lanes
             before and behind it are cut back until it fits; turns back are left out instead
    signals  one group for each lane that a traffic light holds; which may be green together follows
             from where their ways meet; SUMO's programs come along, to be kept where they are safe
    signs    stop, give way from the states of SUMO's links; right before left has none

Speeds follow the car, not Froude's law: by that 50 km/h would be 3.7 m/s at 1:14, fourteen times
what a Nigel drives, and no limit of the network would ever hold anybody.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from scm.errors import MapError
from scm.maps.sumo_build import BESIDE_M, LINE_BEFORE_M, PAINT_M, CityBuilder
from scm.maps.sumo_clear import STRAY_M, Strip, apart_m, is_clear, strip_of, unruled
from scm.maps.sumo_curves import Curve, Dots, cut, distance_m, dotted, fit, length_of, turn
from scm.maps.sumo_program import with_programs
from scm.maps.sumo_read import Net, NetLane, NetLink, read_head, read_net
from scm.records.city_map import CityMap, Point

LEAST_RADIUS_M = 0.38  # a Nigel turns on 0.245 m; at 0.35 m drivers swing 40 mm wide, here 8 mm
WIDE_RADIUS_M = 0.6  # of a street's bend beside another lane: cars swing 37 mm, not 54
LEAST_WIDTH_M = 0.20  # a Nigel is 0.175 m wide
MAX_FIT_ERROR_M = 0.03
WORST_ERROR_M = 0.25  # a right angle in the middle of a street is cut by 0.16 m
MIN_LANE_M = 0.40  # left when lanes are shortened for their turns
CUT_STEP_M = 0.04
MIN_CUT_M = 0.001  # a shorter cut is rounding
MAX_ROUNDS = 60  # of shortening at one junction
DEFAULT_SCALE = 14.0
ROOM_M = 0.015  # that turns are given beside others; what is left in the end may be a little less
LOOK_M = 1.2  # from a junction: so far it matters that lanes are close to each other


@dataclass(frozen=True, slots=True)
class Imported:
    """A city from a network, and what became of that.

    Attributes:
        error_m: How far a lane's centre line lies from the network's, at the worst place.
        tightest_m: Least radius that cars must drive.
        left_out: Turns that the city does not have, as (from, to).
        shortened: How many lanes were cut back for a turn.
        unread: Junctions whose program cannot be written as stages, and why.
        idle_signals: Traffic lights of the network where no ways of cars meet: left out.
        renamed: Edges whose id holds characters that no name here may have: id, name.
    """

    city_map: CityMap
    scale: float
    error_m: float
    tightest_m: float
    left_out: tuple[tuple[str, str], ...]
    shortened: int
    unread: dict[str, str]
    idle_signals: tuple[str, ...]
    renamed: dict[str, str]


def import_sumo(
    path: Path,
    *,
    scale: float | None = None,
    floor_m: tuple[float, float] | None = None,
    report: Callable[[str], None] = lambda _: None,
) -> Imported:
    """Return the city that a SUMO network stands for.

    Args:
        path: The network, `.net.xml`.
        scale: Full size over ours; None: 14, or what makes it fit the floor.
        floor_m: Width and depth of the floor that it must fit; None: as large as it needs.
        report: Called with what is known before it is computed: sizes.

    Raises:
        MapError: it cannot be read, does not fit the floor, is too narrow or too tight, or has
            lanes on which cars would touch with nothing to rule them.
    """
    head = read_head(path)
    if head.size_m is not None:
        report(_sizes(head.size_m, scale or (DEFAULT_SCALE if floor_m is None else None)))
    net = read_net(path)
    report(f"{len(net.lanes)} lanes, {len(net.links)} ways over junctions")
    scale = _scale(path, net, scale, floor_m)
    lanes = {lane.name: _scaled(lane, scale) for lane in net.lanes}
    _check_widths(path, lanes.values(), scale)
    laid, builder, city_map = _clear_city(path, net, lanes, scale, floor_m)
    error_m = max(distance_m(laid.remaining(name), laid.curve(name)) for name in lanes)
    if error_m > WORST_ERROR_M:
        raise MapError(
            f"{path}: bends are too tight at 1:{scale:g}: a lane that a Nigel can drive lies "
            f"{error_m:.2f} m beside the network's; expected at most {WORST_ERROR_M} m, as at a "
            f"larger scale"
        )
    curves = [*(laid.curve(n) for n in lanes), *(t.curve for t in laid.turns)]
    city_map, unread = with_programs(city_map, builder.ruled, net.programs)
    return Imported(
        city_map=city_map,
        scale=scale,
        error_m=error_m,
        tightest_m=min(curve.least_radius_m for curve in curves),
        left_out=tuple((link.start, link.end) for link in laid.left_out),
        shortened=laid.shortened,
        unread=unread,
        idle_signals=tuple(builder.idle_signals),
        renamed=dict(net.renamed),
    )


def _sizes(size_m: tuple[float, float], scale: float | None) -> str:
    full = f"{size_m[0]:.0f} x {size_m[1]:.0f} m at full size"
    if scale is None:
        return full
    width, depth = (side / scale + 2.0 * BESIDE_M for side in size_m)
    return f"{full}; at 1:{scale:g} a floor of some {width:.0f} x {depth:.0f} m"


def _check_widths(path: Path, lanes: Iterable[NetLane], scale: float) -> None:
    """Refuse lanes that are too narrow for a car.

    Raises:
        MapError: naming the narrowest, and the scale that would do.
    """
    narrow = min(lanes, key=lambda lane: lane.width_m)
    if narrow.width_m < LEAST_WIDTH_M:
        fits = scale * narrow.width_m / LEAST_WIDTH_M
        raise MapError(
            f"{path}: lane {narrow.name!r} would be {narrow.width_m:.3f} m wide at 1:{scale:g}; "
            f"expected at least {LEAST_WIDTH_M} m for a Nigel: a scale of 1:{fits:.1f} or larger"
        )


def _clear_city(
    path: Path,
    net: Net,
    lanes: dict[str, NetLane],
    scale: float,
    floor_m: tuple[float, float] | None,
) -> tuple["_Laying", CityBuilder, CityMap]:
    """Return a city where no cars touch that nothing rules; its bends are wide where they must be.

    Raises:
        MapError: naming the closest pair of lanes, and how many there are.
    """
    wide: set[str] = set()
    while True:
        laid = _Laying(path, lanes, net.links, scale, wide)
        laid.lay()
        builder = CityBuilder(net, lanes, {n: laid.curve(n) for n in lanes}, laid.turns, scale)
        city_map = builder.city(floor_m)
        close = unruled(city_map)
        bends = {name for pair in close for name in (pair.lane, pair.other)} & lanes.keys() - wide
        if not bends:
            break
        wide |= bends
    if close:
        worst = min(close, key=lambda pair: pair.gap_m)
        x, y = builder.in_network(worst.x_m, worst.y_m)
        raise MapError(
            f"{path}: cars would touch at 1:{scale:g} on {len(close)} pair(s) of lanes that no "
            f"signal or sign rules: {worst.lane!r} and {worst.other!r} leave "
            f"{max(0.0, 1e3 * worst.gap_m):.1f} mm between cars at x {x:.1f} m, y {y:.1f} m of the "
            f"network; expected {1e3 * STRAY_M:.0f} or more. Lanes side by side need a larger "
            f"scale, junctions close to each other netconvert --junctions.join; a bridge cannot "
            f"be on a level floor"
        )
    return laid, builder, city_map


def _scale(
    path: Path, net: Net, scale: float | None, floor_m: tuple[float, float] | None
) -> float:  # fmt: skip
    """Return the scale to build at; refuse one that does not fit the floor."""
    if floor_m is None:
        return scale or DEFAULT_SCALE
    xs, ys = zip(*(point for lane in net.lanes for point in lane.points), strict=True)
    room = [side - 2.0 * BESIDE_M for side in floor_m]
    if min(room) <= 0.0:
        msg = f"--floor: got {floor_m[0]:g}x{floor_m[1]:g}, expected more than {2 * BESIDE_M} m"
        raise MapError(msg)
    fits = max((max(xs) - min(xs)) / room[0], (max(ys) - min(ys)) / room[1])
    if scale is not None and scale < fits:
        raise MapError(
            f"{path}: at 1:{scale:g} it does not fit {floor_m[0]:g} x {floor_m[1]:g} m; expected "
            f"a scale of 1:{fits:.1f} or smaller, or a larger floor"
        )
    return scale or fits


def _scaled(lane: NetLane, scale: float) -> NetLane:
    points = tuple((x / scale, y / scale) for x, y in lane.points)
    return NetLane(lane.name, lane.edge, points, lane.width_m / scale, lane.speed_mps)


@dataclass(frozen=True, slots=True)
class Turn:
    """A way over a junction as it is laid."""

    link: NetLink
    curve: Curve


class _Laying:
    """Lays lanes and the turns between them, and cuts lanes back where turns need it.

    A turn needs room where it is too tight, or where it comes too close to a lane of its junction
    that it does not belong to: cars wait at the end of that lane, or stand at its beginning.
    """

    def __init__(
        self,
        path: Path,
        lanes: dict[str, NetLane],
        links: Iterable[NetLink],
        scale: float,
        wide: Collection[str],
    ) -> None:
        self._path, self._lanes, self._scale, self._wide = path, lanes, scale, wide
        self._cuts: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
        self._curves: dict[str, Curve] = {}
        self._strips: dict[tuple[str, int], Strip] = {}
        self._ways: dict[NetLink, Strip | None] = {}
        self._clear: dict[tuple[Strip, Strip], bool] = {}
        self._links: dict[str, list[NetLink]] = defaultdict(list)
        self._of_lane: dict[str, list[NetLink]] = defaultdict(list)
        for link in links:
            self._links[link.node].append(link)
            for lane in (link.start, link.end):
                self._of_lane[lane].append(link)
        self.turns: list[Turn] = []
        self.left_out: list[NetLink] = []

    @property
    def shortened(self) -> int:
        """How many lanes were cut back."""
        return sum(1 for ends in self._cuts.values() if any(ends))

    def remaining(self, name: str) -> list[Point]:
        """Return what is left of a lane's polyline."""
        points, (front, back) = self._lanes[name].points, self._cuts[name]
        return cut(points, front, length_of(points) - back)

    def curve(self, name: str) -> Curve:
        """Return a lane as it is laid."""
        if name not in self._curves:
            radius_m = WIDE_RADIUS_M if name in self._wide else LEAST_RADIUS_M
            self._curves[name] = fit(self.remaining(name), radius_m, MAX_FIT_ERROR_M)
        return self._curves[name]

    def lay(self) -> None:
        """Lay all turns.

        Raises:
            MapError: some turn finds no room, however its lanes are cut back.
        """
        rounds: Counter[str] = Counter()
        todo = dict.fromkeys(self._links)
        while todo:
            node = next(iter(todo))
            del todo[node]
            ends = self._ends_in_the_way(node)
            if ends and rounds[node] < MAX_ROUNDS:
                rounds[node] += 1
                for lane in self._cut_back(ends):
                    todo |= dict.fromkeys(link.node for link in self._of_lane[lane])
        tight = []
        for link in (link for links in self._links.values() for link in links):
            curve = self._turn(link)
            if curve is not None and curve.least_radius_m >= LEAST_RADIUS_M:
                self.turns.append(Turn(link, curve))
            elif link.turns_back:
                self.left_out.append(link)
            else:
                tight.append((link, curve.least_radius_m if curve is not None else 0.0))
        if tight:
            self._refuse(tight)

    def _turn(self, link: NetLink) -> Curve | None:
        return turn(self.curve(link.start).end, self.curve(link.end).start)

    def _ends_in_the_way(self, node: str) -> set[tuple[str, int]]:
        """Return which lanes leave a turn of a junction no room, and at which end: 1 the back."""
        links, tight, ways = self._links[node], set(), []
        for link in links:
            way = self._way(link)
            if way is not None:
                ways.append((link, way))
            elif not link.turns_back:
                tight |= {(link.start, 1), (link.end, 0)}
        return tight or {*self._lanes_in_the_way(links, ways), *self._ways_in_the_way(ways)}

    def _lanes_in_the_way(
        self, links: Iterable[NetLink], ways: Sequence[tuple[NetLink, Strip]]
    ) -> Iterator[tuple[str, int]]:
        """Yield ends of lanes where cars stand too close to others, or to a turn of others."""
        ends = {(link.start, 1) for link in links} | {(link.end, 0) for link in links}
        near = {(lane, end): self._near(lane, end) for lane, end in sorted(ends)}
        for pair in combinations(near, 2):
            if not self._are_clear(near[pair[0]], near[pair[1]]):
                yield from pair
        for link, way in ways:
            for place, stood in near.items():
                if place[0] not in {link.start, link.end} and not self._are_clear(way, stood):
                    yield place

    def _ways_in_the_way(
        self, ways: Sequence[tuple[NetLink, Strip]]
    ) -> Iterator[tuple[str, int]]:  # fmt: skip
        """Yield ends of lanes whose turns are too close to pass, and too far apart to be ruled."""
        for (a, one), (b, other) in combinations(ways, 2):
            if a.start == b.start or a.end == b.end or self._are_clear(one, other):
                continue
            width = sum(self._lanes[name].width_m for name in (a.start, b.start)) / 2.0 - PAINT_M
            if apart_m(one.middle, other.middle) >= width:
                yield from ((a.start, 1), (b.start, 1), (a.end, 0), (b.end, 0))

    def _are_clear(self, one: Strip, other: Strip) -> bool:
        if (one, other) not in self._clear:
            self._clear[one, other] = is_clear(one, other, ROOM_M)
        return self._clear[one, other]

    def _way(self, link: NetLink) -> Strip | None:
        """Return what cars cover on a turn; None: it is too tight."""
        if link not in self._ways:
            curve = self._turn(link)
            wide = curve is not None and curve.least_radius_m >= LEAST_RADIUS_M
            self._ways[link] = strip_of(dotted(curve)) if curve is not None and wide else None
        return self._ways[link]

    def _near(self, lane: str, end: int) -> Strip:
        """Return what cars cover near one end of a lane; 1: at its back, before its line."""
        if (lane, end) not in self._strips:
            dots = dotted(self.curve(lane))
            away_m = dots.at_m[-1] - dots.at_m if end else dots.at_m
            near = Dots(*(values[away_m < LOOK_M] for values in dots))
            stand = away_m[away_m < LOOK_M] >= end * LINE_BEFORE_M
            self._strips[lane, end] = strip_of(near, stand=stand)
        return self._strips[lane, end]

    def _cut_back(self, ends: Iterable[tuple[str, int]]) -> Iterator[str]:
        """Cut lanes back by a little at these ends; yield those that had room for it."""
        for name, end in ends:
            left_m = length_of(self._lanes[name].points) - sum(self._cuts[name]) - MIN_LANE_M
            if left_m >= MIN_CUT_M:
                self._cuts[name][end] += min(CUT_STEP_M, left_m)
                self._curves.pop(name, None)
                self._strips.pop((name, 0), None)
                self._strips.pop((name, 1), None)
                for link in self._of_lane[name]:
                    self._ways.pop(link, None)
                yield name

    def _refuse(self, tight: list[tuple[NetLink, float]]) -> None:
        link, radius = min(tight, key=lambda pair: pair[1])
        fits = self._scale * radius / LEAST_RADIUS_M
        at = f" (1:{math.floor(fits)} would do for this one)" if fits >= 1.0 else ""
        raise MapError(
            f"{self._path}: {len(tight)} turn(s) too tight at 1:{self._scale:g}: at junction "
            f"{link.node!r} the one from {link.start!r} to {link.end!r} has a radius of "
            f"{radius:.2f} m; expected at least {LEAST_RADIUS_M} m, as at a larger scale{at}"
        )
