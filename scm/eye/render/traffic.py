"""Cars that drive by themselves for a picture: along a map's lanes, or around its floor.

No physics: each keeps its speed and follows its line exactly, so its pose at any time is known
exactly. Cars start where none meets another for the length of the film.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.errors import EyeError
from scm.eye.render.motion import Driven
from scm.geometry import Pose2
from scm.maps.polyline import Polyline, join, sample
from scm.maps.route import Roads
from scm.records.city_map import CityMap, Segment
from scm.records.floor import Floor
from scm.scenery.bodies import car_body
from scm.v2x.messages.world_snapshot import SnapshotVehicle

RING_STEP_M = 0.25
MIN_RADIUS_M = 0.12  # of a corner on the ring
SAMPLE_S = 0.1  # between two poses that are kept apart
NEAR_M = 0.03
"""Minimum gap from bumper to bumper."""
MAX_TRIES = 200  # to place one car


@dataclass(frozen=True, slots=True)
class Tour:
    """A car on its line.

    Attributes:
        line: Path of its rear axle.
        start_m: Along the line, at time 0.
        speed_mps: Constant.
        tag_id: On its roof.
        car: Name of its car file.
    """

    line: Polyline
    start_m: float
    speed_mps: float
    tag_id: int
    car: str = "nigel"

    def at(self, t_s: float) -> Driven:
        """Return the car at a time [s]; at the end of an open line it stops."""
        s = self.start_m + self.speed_mps * t_s
        x, y, yaw = self.line.at(s)
        ended = not self.line.closed and not 0.0 <= s < self.line.length_m
        speed = 0.0 if ended else self.speed_mps
        bend = self.line.curvature_at(s)
        car = SnapshotVehicle(
            vehicle=f"n{self.tag_id}", kind="hosted", car=self.car, tag_id=self.tag_id,
            x_m=x, y_m=y, yaw_rad=yaw, speed_mps=speed,
            steering_rad=math.atan(car_body(self.car).wheelbase * bend),
        )  # fmt: skip
        return Driven(car, speed * bend)


def tours(
    city_map: CityMap,
    count: int,
    speed_mps: float,
    duration_s: float,
    rng: np.random.Generator,
    *,
    on_lanes: bool,
    car: str = "nigel",
) -> tuple[Tour, ...]:
    """Return cars that never collide for that long, tags numbered as in the map.

    Args:
        city_map: Where.
        count: How many cars.
        speed_mps: Of all of them.
        duration_s: How long the film is.
        rng: Of where they start.
        on_lanes: Along the map's lanes; otherwise around the floor, one ring in another.
        car: Name of their car file.

    Raises:
        EyeError: The map has no lanes, or too little room.
    """
    if on_lanes and not city_map.lanes:
        raise EyeError(f"map {city_map.name}: expected lanes to drive on, got a map without any")
    ids = range(city_map.first_vehicle_tag_id, city_map.first_vehicle_tag_id + count)
    if on_lanes:
        found = _along_lanes(city_map, ids, speed_mps, duration_s, car, rng)
    else:
        places = _places(rings(city_map.floor), car, rng)
        chosen = [places[k] for k in rng.permutation(len(places))]
        found = [
            Tour(line, start_m, speed_mps, tag_id, car)
            for (line, start_m), tag_id in zip(chosen, ids, strict=False)
        ]
    if len(found) < count:
        where = "on the lanes" if on_lanes else "on the floor"
        raise EyeError(
            f"map {city_map.name}: expected room for {count} cars {where}, found {len(found)}"
        )
    return tuple(found)


def _places(
    lines: Sequence[Polyline], car: str, rng: np.random.Generator
) -> list[tuple[Polyline, float]]:
    """Return start places on closed lines, as many as there is room for."""
    rear, front = car_body(car).x_span
    places = []
    for line in lines:
        count = int(line.length_m / (front - rear + NEAR_M))
        phase = float(rng.uniform())
        places += [(line, (k + phase) * line.length_m / count) for k in range(count)]
    return places


def _along_lanes(
    city_map: CityMap,
    ids: Sequence[int],
    speed_mps: float,
    duration_s: float,
    car: str,
    rng: np.random.Generator,
) -> list[Tour]:
    """Return cars on lanes, at most one for each id: as many as fit."""
    lines = _lane_lines(city_map, speed_mps * duration_s, rng)
    times = np.arange(0.0, duration_s + SAMPLE_S, SAMPLE_S)
    found: list[tuple[Tour, Floats]] = []
    for tag_id in ids:
        more = _free(lines, found, times, speed_mps, tag_id, car, rng)
        if more is None:
            break
        found.append(more)
    return [tour for tour, _ in found]


def _free(
    lines: Sequence[Polyline],
    others: Sequence[tuple[Tour, Floats]],
    times: Floats,
    speed_mps: float,
    tag_id: int,
    car: str,
    rng: np.random.Generator,
) -> tuple[Tour, Floats] | None:
    """Return a start from which a car stays clear of all others, and the area it covers."""
    lengths = np.array([line.length_m for line in lines])
    anywhere = rng.uniform(0.0, 1.0, MAX_TRIES // 4)
    in_turn = np.linspace(0.0, 1.0, MAX_TRIES, endpoint=False)  # for crowded lanes
    for share in (*anywhere, *in_turn):
        line = lines[int(rng.choice(len(lines), p=lengths / lengths.sum()))]
        start = float(share) * line.length_m
        if start + speed_mps * times[-1] > line.length_m:
            continue
        tour = Tour(line, start, speed_mps, tag_id, car)
        if any(_too_close(tour, other) for other, _ in others):
            continue
        discs = _discs(tour, times)
        if all(other.line is line or _clear(discs, theirs, car) for other, theirs in others):
            return tour, discs
    return None


def _too_close(tour: Tour, other: Tour) -> bool:
    """Return whether two cars on the same line would touch."""
    if tour.line is not other.line:
        return False
    rear, front = car_body(tour.car).x_span
    return abs(tour.start_m - other.start_m) < front - rear + NEAR_M


def _discs(tour: Tour, times: Floats) -> Floats:
    """Return the centres of three discs that cover the car, at each time, (times, 3, 2) [m]."""
    rear, front = car_body(tour.car).x_span
    length = front - rear
    along = [rear + length * share for share in (1 / 6, 1 / 2, 5 / 6)]
    s = tour.start_m + tour.speed_mps * times
    poses = [tour.line.at(float(one)) for one in s]
    return np.array([[pose.apply(x, 0.0) for x in along] for pose in poses])


def _clear(discs: Floats, others: Floats, car: str) -> bool:
    body = car_body(car)
    sixth = (body.x_span[1] - body.x_span[0]) / 6.0
    radius = math.hypot(sixth, max(abs(edge) for edge in body.y_span))
    gap = discs[:, :, None] - others[:, None]
    return bool(np.hypot(gap[..., 0], gap[..., 1]).min() > 2.0 * radius + NEAR_M / 2.0)


def _lane_lines(city_map: CityMap, room_m: float, rng: np.random.Generator) -> list[Polyline]:
    """Return a drive's line from every lane, of the lane's length and the room it needs."""
    roads = Roads(city_map)
    lines = []
    for name in roads.lanes:
        pieces, length, at = [roads.lanes[name]], roads.length_of(name), name
        wanted = length + room_m + 0.01
        while length < wanted and roads.successors(at):
            following = roads.successors(at)
            at = following[int(rng.integers(len(following)))]
            pieces.append(roads.lanes[at])
            length += roads.length_of(at)
        lines.append(join(pieces) if len(pieces) > 1 else pieces[0])
    return lines


def rings(floor: Floor) -> list[Polyline]:
    """Return closed lines around a floor, nested, every second one in the other direction.

    Raises:
        EyeError: The floor is too small for one.
    """
    (x0, x1), (y0, y1) = floor.x_m, floor.y_m
    found: list[Polyline] = []
    inset = 0.15
    while min(x1 - x0, y1 - y0) / 2.0 - inset >= MIN_RADIUS_M:
        ring = _ring(x0 + inset, x1 - inset, y0 + inset, y1 - inset)
        found.append(ring if len(found) % 2 == 0 else _reversed(ring))
        inset += RING_STEP_M
    if not found:
        raise EyeError(f"floor: expected room to turn, got {x1 - x0:.2f} x {y1 - y0:.2f} m")
    return found


def _ring(x0: float, x1: float, y0: float, y1: float) -> Polyline:
    """Return a rectangle with rounded corners, counter-clockwise, from its lower side's start."""
    radius = max(MIN_RADIUS_M, min(0.45, (min(x1 - x0, y1 - y0)) / 2.0))
    across, up = x1 - x0 - 2.0 * radius, y1 - y0 - 2.0 * radius
    corner = Segment(radius_m=radius, angle_rad=math.pi / 2.0)
    segments = []
    for side in (across, up, across, up):
        segments += [Segment(length_m=side)] if side > 1e-6 else []
        segments.append(corner)
    line = sample(Pose2(x0 + radius, y0, 0.0), segments)
    return Polyline(line.points, line.s, line.yaw, line.curvature, closed=True)


def _reversed(line: Polyline) -> Polyline:
    back = line.s[-1] - line.s[::-1]
    bend = np.append(-line.curvature[-2::-1], -line.curvature[0])
    return Polyline(line.points[::-1], back, line.yaw[::-1] + math.pi, bend, closed=True)
