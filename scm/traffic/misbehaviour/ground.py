"""Facts of a map by position: roads and their directions, roadside units, the Eye's view.

The result for each cell of 4 cm is cached: cars come by again.
"""

import math
from collections import defaultdict
from collections.abc import Callable

import numpy as np

from scm.geometry import wrap_angle
from scm.maps.roadside import roadside_place
from scm.maps.route import roads_of
from scm.records.city_map import Camera, CityMap, Point
from scm.v2x.etsi.convert import roadside_station

CELL_M = 0.04  # answers are cached for
POINT_STEP = 4  # every fourth point of a lane: 4 cm
BUCKET_M = 0.5  # in which points of lanes are searched
MAX_OFF_ROAD_M = 1.0  # farther off the road makes no difference
SAME_LANE_M = 0.05  # other lanes as near as that count too
VIEW_SHARE = 0.85  # of a camera's picture, in which a tag is fully visible
MAX_VIEW_RAD = math.radians(60.0)  # from a fisheye's axis

Sees = Callable[[float, float], bool]
Row = tuple[float, float, float, float]
"""A point of a lane's middle: x, y [m], yaw [rad], half the lane's width [m]."""


class Ground:
    """One map.

    Attributes:
        receivers: Where roadside units stand, by station.
        range_m: How far the radio reaches.
        spawns: Where cars come in [m].
        has_roads: Whether anything of the map says where cars may be.
    """

    def __init__(self, city_map: CityMap, sees: Sees | None = None) -> None:
        """Use a map; `sees` is what the Eye overlooks, the map's cameras if it is None."""
        roads = roads_of(city_map)
        self.range_m = city_map.radio_range_m
        self.receivers = {
            roadside_station(junction.name): roadside_place(city_map, junction.name)
            for junction in city_map.junctions
        }
        poses = [roads.spawn_pose(spawn.name) for spawn in city_map.spawns]
        self.spawns = [(pose.x, pose.y) for pose in poses]
        self.has_roads = bool(city_map.lanes)
        self._buckets: dict[tuple[int, int], list[Row]] = defaultdict(list)
        for lane in roads.lanes.values():
            rows = np.column_stack([lane.points, lane.yaw])[::POINT_STEP]
            for x, y, yaw in rows.tolist():
                row = (x, y, wrap_angle(yaw), lane.width_m / 2.0)
                self._buckets[_cell(x, y, BUCKET_M)].append(row)
        self._half_m = max((lane.width_m / 2.0 for lane in city_map.lanes), default=0.0)
        self._near: dict[tuple[int, int, int], list[Row]] = {}
        self._areas = [(_frame(area.points), area.points) for area in city_map.areas]
        self._known: dict[tuple[int, int], tuple[float, tuple[float, ...]]] = {}
        views = [_view(camera) for camera in city_map.cameras]
        self.sees: Sees = sees or (lambda x, y: any(view(x, y) for view in views))

    def off_road_m(self, x: float, y: float) -> float:
        """Return how far a point is off the road [m], `MAX_OFF_ROAD_M` at most."""
        return self._at(x, y)[0]

    def ways_at(self, x: float, y: float) -> tuple[float, ...]:
        """Return the directions of the lanes that a point lies on [rad]; none on paved areas."""
        return self._at(x, y)[1]

    def road_near(self, x: float, y: float) -> Row | None:
        """Return the nearest point of a lane's middle: x, y [m], yaw [rad], half the width [m]."""
        return min(
            self._rows(x, y, 2), key=lambda row: math.hypot(x - row[0], y - row[1]), default=None
        )

    def _at(self, x: float, y: float) -> tuple[float, tuple[float, ...]]:
        cell = _cell(x, y, CELL_M)
        known = self._known.get(cell)
        if known is None:
            middle = (cell[0] + 0.5) * CELL_M, (cell[1] + 0.5) * CELL_M
            known = self._known[cell] = self._compute(*middle)
        return known

    def _compute(self, x: float, y: float) -> tuple[float, tuple[float, ...]]:
        for (x0, y0, x1, y1), area in self._areas:
            if x0 <= x <= x1 and y0 <= y <= y1 and inside(x, y, area):
                return 0.0, ()
        for buckets in (1, 2):
            rows = self._rows(x, y, buckets)
            beside = [(math.hypot(x - row[0], y - row[1]) - row[3], row[2]) for row in rows]
            away = min((off for off, _ in beside), default=MAX_OFF_ROAD_M)
            near = max(away, 0.0) + SAME_LANE_M
            if near < buckets * BUCKET_M - self._half_m:
                break  # all other lanes are farther
        ways = tuple(dict.fromkeys(round(yaw, 1) for off, yaw in beside if off <= near))
        return min(MAX_OFF_ROAD_M, max(0.0, away)), ways

    def _rows(self, x: float, y: float, buckets: int) -> list[Row]:
        """Return the points of lanes in a point's bucket and so many around it each way."""
        i, j = _cell(x, y, BUCKET_M)
        rows = self._near.get((i, j, buckets))
        if rows is None:
            steps = range(-buckets, buckets + 1)
            cells = ((i + di, j + dj) for di in steps for dj in steps)
            rows = [row for cell in cells for row in self._buckets.get(cell, ())]
            if rows:
                self._near[i, j, buckets] = rows
        return rows


def inside(x: float, y: float, polygon: tuple[Point, ...]) -> bool:
    """Return whether a point lies in a polygon."""
    odd = False
    x0, y0 = polygon[-1]
    for x1, y1 in polygon:
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            odd = not odd
        x0, y0 = x1, y1
    return odd


def _frame(polygon: tuple[Point, ...]) -> tuple[float, float, float, float]:
    """Return the least and the greatest x and y of a polygon [m]: x0, y0, x1, y1."""
    xs, ys = zip(*polygon, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def _cell(x: float, y: float, size: float) -> tuple[int, int]:
    return math.floor(x / size), math.floor(y / size)


def _view(camera: Camera) -> Sees:
    """Return what a camera surely sees of the floor: a little less than its picture."""

    def reach(size_px: int, focal_px: float) -> float:
        half = size_px / 2.0 / focal_px
        slope = math.tan(min(half, MAX_VIEW_RAD)) if camera.lens == "fisheye" else half
        return VIEW_SHARE * camera.z_m * slope

    along, across = reach(camera.width_px, camera.fx_px), reach(camera.height_px, camera.fy_px)
    c, s = math.cos(camera.yaw_rad), math.sin(camera.yaw_rad)

    def sees(x: float, y: float) -> bool:
        dx, dy = x - camera.x_m, y - camera.y_m
        return abs(c * dx + s * dy) <= along and abs(c * dy - s * dx) <= across

    return sees
