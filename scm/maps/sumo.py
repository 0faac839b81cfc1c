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

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from scm.errors import MapError
from scm.maps.model import CityMap, Point
from scm.maps.sumo_build import CityBuilder
from scm.maps.sumo_curves import Curve, cut, distance_m, fit, length_of, turn
from scm.maps.sumo_program import with_programs
from scm.maps.sumo_read import Net, NetLane, NetLink, read_net

LEAST_RADIUS_M = 0.38  # a Nigel turns on 0.245 m; at 0.35 m drivers swing 40 mm wide, here 8 mm
LEAST_WIDTH_M = 0.20  # a Nigel is 0.175 m wide
ERROR_M = 0.03
WORST_ERROR_M = 0.25  # a right angle in the middle of a street is cut by 0.16 m
LEAST_LANE_M = 0.40
CUT_M = 0.02
ROUNDS = 120
DEFAULT_SCALE = 14.0
BESIDE_M = 0.45


@dataclass(frozen=True, slots=True)
class Imported:
    """A city from a network, and what became of that.

    Attributes:
        error_m: How far a lane's centre line lies from the network's, at the worst place.
        tightest_m: Least radius that cars must drive.
        left_out: Turns that the city does not have, as (from, to).
        shortened: How many lanes were cut back for a turn.
        unread: Junctions whose program cannot be told as stages, and why.
    """

    city_map: CityMap
    scale: float
    error_m: float
    tightest_m: float
    left_out: tuple[tuple[str, str], ...]
    shortened: int
    unread: dict[str, str]


def import_sumo(
    path: Path, *, scale: float | None = None, floor_m: tuple[float, float] | None = None
) -> Imported:
    """Return the city that a SUMO network stands for.

    Args:
        path: The network, `.net.xml`.
        scale: Full size over ours; None: 14, or what makes it fit the floor.
        floor_m: Width and depth of the floor that it must fit; None: as large as it needs.

    Raises:
        MapError: it cannot be read, does not fit the floor, or is too narrow or too tight.
    """
    net = read_net(path)
    scale = _scale(path, net, scale, floor_m)
    lanes = {lane.name: _scaled(lane, scale) for lane in net.lanes}
    narrow = min(lanes.values(), key=lambda lane: lane.width_m)
    if narrow.width_m < LEAST_WIDTH_M:
        fits = scale * narrow.width_m / LEAST_WIDTH_M
        raise MapError(
            f"{path}: lane {narrow.name!r} would be {narrow.width_m:.3f} m wide at 1:{scale:g}; "
            f"expected at least {LEAST_WIDTH_M} m for a Nigel: a scale of 1:{fits:.1f} or larger"
        )
    laid = _Laying(path, lanes, net.links, scale)
    laid.lay()
    error_m = max(distance_m(laid.kept(name), laid.curve(name)) for name in lanes)
    if error_m > WORST_ERROR_M:
        raise MapError(
            f"{path}: bends are too tight at 1:{scale:g}: a lane that a Nigel can drive lies "
            f"{error_m:.2f} m beside the network's; expected at most {WORST_ERROR_M} m, as at a "
            f"larger scale"
        )
    builder = CityBuilder(net, lanes, {n: laid.curve(n) for n in lanes}, laid.turns, scale)
    curves = [*(laid.curve(n) for n in lanes), *(t.curve for t in laid.turns)]
    links = [laid_turn.link for laid_turn in laid.turns]
    city_map, unread = with_programs(builder.city(floor_m), net, links, builder.name_of)
    return Imported(
        city_map=city_map,
        scale=scale,
        error_m=error_m,
        tightest_m=min(curve.least_radius_m for curve in curves),
        left_out=tuple((link.start, link.end) for link in laid.left_out),
        shortened=laid.shortened,
        unread=unread,
    )


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
    """Lays lanes and the turns between them, and cuts lanes back where turns need it."""

    def __init__(
        self, path: Path, lanes: dict[str, NetLane], links: Iterable[NetLink], scale: float
    ) -> None:
        self._path, self._lanes, self._scale = path, lanes, scale
        self._links = list(links)
        self._cuts: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
        self._curves: dict[str, Curve] = {}
        self.turns: list[Turn] = []
        self.left_out: list[NetLink] = []

    @property
    def shortened(self) -> int:
        """How many lanes were cut back."""
        return sum(1 for ends in self._cuts.values() if any(ends))

    def kept(self, name: str) -> list[Point]:
        """Return what is left of a lane's polyline."""
        points, (front, back) = self._lanes[name].points, self._cuts[name]
        return cut(points, front, length_of(points) - back)

    def curve(self, name: str) -> Curve:
        """Return a lane as it is laid."""
        if name not in self._curves:
            self._curves[name] = fit(self.kept(name), LEAST_RADIUS_M, ERROR_M)
        return self._curves[name]

    def lay(self) -> None:
        """Lay all turns.

        Raises:
            MapError: some turn finds no room, however its lanes are cut back.
        """
        for _ in range(ROUNDS):
            self.turns, self.left_out, tight = [], [], []
            for link in self._links:
                curve = turn(self.curve(link.start).end, self.curve(link.end).start)
                if curve is not None and curve.least_radius_m >= LEAST_RADIUS_M:
                    self.turns.append(Turn(link, curve))
                elif link.direction == "t":
                    self.left_out.append(link)
                else:
                    tight.append((link, curve.least_radius_m if curve is not None else 0.0))
            if not tight:
                return
            if not self._make_room({link for link, _ in tight}):
                break
        self._refuse(tight)

    def _make_room(self, links: Iterable[NetLink]) -> bool:
        """Cut the lanes of some turns back by a little; return whether any had room for it."""
        ends = {(link.start, 1) for link in links} | {(link.end, 0) for link in links}
        made = False
        for name, end in ends:
            length = length_of(self._lanes[name].points) - sum(self._cuts[name])
            if length - CUT_M >= LEAST_LANE_M:
                self._cuts[name][end] += CUT_M
                self._curves.pop(name, None)
                made = True
        return made

    def _refuse(self, tight: list[tuple[NetLink, float]]) -> None:
        link, radius = min(tight, key=lambda pair: pair[1])
        fits = self._scale * radius / LEAST_RADIUS_M
        at = f" (1:{fits:.0f} would do for this one)" if fits >= 1.0 else ""
        raise MapError(
            f"{self._path}: {len(tight)} turn(s) too tight at 1:{self._scale:g}: at junction "
            f"{link.node!r} the one from {link.start!r} to {link.end!r} has a radius of "
            f"{radius:.2f} m; expected at least {LEAST_RADIUS_M} m, as at a larger scale{at}"
        )
