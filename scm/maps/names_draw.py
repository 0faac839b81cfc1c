"""The names on a map's picture: of lanes along their way, of junctions and crossings amid them.

Every name is there. A lane's stands where it covers the least of other names, signals and spawn
places, and among equal places nearest to the lane's middle.
"""

import math
from collections.abc import Iterable, Iterator

from scm.geometry import Pose2
from scm.maps.route import LanePath, Roads
from scm.maps.svg import label, layer
from scm.records.city_map import CityMap, Conflict

SHARES = sorted((k / 20.0 for k in range(3, 18)), key=lambda share: abs(share - 0.5))
"""Of a lane's length: where its name may stand, the best first."""
LETTER = 0.55  # width of a letter, of its height
LANE, JUNCTION, RIM = "#fff3c4", "#ffd166", "#14181e"
LANE_HEIGHT = 0.22  # of the lane's width, where the lane is long enough
JUNCTION_HEIGHT_M = 0.075
SPAWN_NAME_AT_M, SPAWN_NAME_M = 0.08, 0.07  # ahead of the rear axle, and how large
CELL_M = 0.04

Cells = set[tuple[int, int]]


def name_layers(city_map: CityMap, roads: Roads) -> str:
    """Return the names of lanes, junctions and crossings as layers of a picture."""
    covered = {_cell(light.x_m, light.y_m) for light in city_map.lights}
    for spawn in city_map.spawns:
        x, y = roads.spawn_pose(spawn.name).apply(SPAWN_NAME_AT_M, 0.0)
        covered |= _cells(spawn.name, Pose2(x, y, 0.0), SPAWN_NAME_M)
    junctions = [_junction(name, ways, roads, covered) for name, ways in _junctions(city_map)]
    lanes = [_lane(lane, covered) for lane in roads.lanes.values()]
    return layer("lane-names", lanes) + layer("junction-names", junctions)


def _junctions(city_map: CityMap) -> Iterator[tuple[str, list[Conflict]]]:
    """Return the name of each junction and crossing, and the ways over it."""
    for junction in city_map.junctions:
        yield junction.name, [way for group in junction.groups for way in group.movements]
    for crossing in city_map.crossings:
        yield crossing.name, [way for approach in crossing.approaches for way in approach.ways]


def _junction(name: str, ways: Iterable[Conflict], roads: Roads, covered: Cells) -> str:
    middles = [roads.lanes[way.lane].at((way.from_m + way.to_m) / 2.0) for way in ways]
    x, y = (sum(pose[i] for pose in middles) / len(middles) for i in (0, 1))
    covered |= _cells(name, Pose2(x, y, 0.0), JUNCTION_HEIGHT_M)
    return _text(name, Pose2(x, y, 0.0), JUNCTION_HEIGHT_M, JUNCTION)


def _lane(lane: LanePath, covered: Cells) -> str:
    """Return a lane's name at a free place, as large as its length and width allow."""
    height = min(LANE_HEIGHT * lane.width_m, 0.9 * lane.length_m / (LETTER * len(lane.name)))
    places = (lane.at(share * lane.length_m) for share in SHARES)
    pose = min(places, key=lambda place: len(covered & _cells(lane.name, place, height)))
    covered |= _cells(lane.name, pose, height)
    return _text(lane.name, pose, height, LANE)


def _cells(name: str, pose: Pose2, height: float) -> Cells:
    """Return the cells of the floor that a name covers."""
    half = LETTER * height * len(name) / 2.0
    steps = max(1, math.ceil(2.0 * half / CELL_M))
    return {
        _cell(*pose.apply(half * (2.0 * k / steps - 1.0), across))
        for k in range(steps + 1)
        for across in (-height / 2.0, 0.0, height / 2.0)
    }


def _cell(x: float, y: float) -> tuple[int, int]:
    return math.floor(x / CELL_M), math.floor(y / CELL_M)


def _text(name: str, pose: Pose2, height: float, fill: str) -> str:
    """Return a name that is read from below or from the right, with a dark rim."""
    yaw = pose.yaw - math.pi * round(pose.yaw / math.pi - 1e-3)  # never upside down
    return label(
        name, pose.x, pose.y, height, yaw_rad=yaw, fill=fill, font_weight="600",
        stroke=RIM, stroke_width=180.0 * height, stroke_linejoin="round", paint_order="stroke",
    )  # fmt: skip
