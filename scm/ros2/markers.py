"""Markers for RViz and Foxglove: lanes and walls once; cars, boxes and signals repeatedly."""

import itertools
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.maps.segments import wall_segments
from scm.records.boxes import SnapshotBox
from scm.records.city_map import Box, CityMap
from scm.ros2.frames import MAP, header, point, pose, vector
from scm.ros2.types import constant, ros
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from scm.vehicles.car import Car

LASTS_NS = 500 * NS_PER_MS
FLASH_NS = 500 * NS_PER_MS
LAMP_M = 0.05
LOWEST_LAMP_M = 0.16
CAR_HEIGHT_M = 0.12
LINE_M = 0.008
COLOURS = {
    "red": (0.9, 0.1, 0.1), "yellow": (0.95, 0.8, 0.1), "green": (0.1, 0.8, 0.3),
    "flashing_red": (0.9, 0.1, 0.1), "dark": (0.2, 0.2, 0.2),
    "hosted": (0.2, 0.5, 0.9), "remote": (0.9, 0.5, 0.1), "real": (0.8, 0.2, 0.8),
}  # fmt: skip
_LAMPS = {"green": 0, "yellow": 1}  # any other colour is the top lamp
_GREY = (0.6, 0.6, 0.6)
_WHITE = (1.0, 1.0, 1.0)

Colour = tuple[float, float, float]


def roads(city_map: CityMap, t_ns: int) -> Any:
    """Return a `MarkerArray` of lane edges and walls, which stays until replaced."""
    lanes = Roads(city_map)
    edges = []
    for lane in city_map.lanes:
        line, half = lanes.lane(lane.name), 0.5 * lane.width_m
        stations = [Pose2(x, y, yaw) for (x, y), yaw in zip(line.points, line.yaw, strict=True)]
        for side in (half, -half):
            rim = [at.apply(0.0, side) for at in stations]
            edges += [p for pair in itertools.pairwise(rim) for p in pair]
    walls = [end for x0, y0, x1, y1 in wall_segments(city_map) for end in ((x0, y0), (x1, y1))]
    drawn = (("lanes", edges, _WHITE), ("walls", walls, _GREY))
    return _array(_lines(name, ends, colour, t_ns) for name, ends, colour in drawn if ends)


def moving(
    city_map: CityMap,
    snapshot: WorldSnapshot,
    spats: Mapping[str, Spat],
    cars: Mapping[str, Car],
) -> Any:
    """Return a `MarkerArray` of cars with names, boxes, and the lit lamp of each signal head.

    Args:
        city_map: Has the signal heads and the size of boxes.
        snapshot: The newest; all markers have its time.
        spats: The newest of each junction.
        cars: Car files by name; a car without one is not drawn.
    """
    out = []
    for number, row in enumerate(snapshot.vehicles):
        if row.car in cars:
            out += _car(number, row, cars[row.car], snapshot.t_ns)
    sizes = {box.name: box for box in city_map.boxes}
    moved = [(row, sizes[row.name]) for row in snapshot.boxes if row.name in sizes]
    out += [_box(number, row, box, snapshot.t_ns) for number, (row, box) in enumerate(moved)]
    return _array(out + _heads(city_map, spats, snapshot.t_ns))


def _car(number: int, row: SnapshotVehicle, car: Car, t_ns: int) -> list[Any]:
    rear, front = car.vector("body.footprint_x_m")
    right, left = car.vector("body.footprint_y_m")
    at = Pose2(row.x_m, row.y_m, row.yaw_rad) @ Pose2(
        0.5 * (rear + front), 0.5 * (right + left), 0.0
    )
    colour = COLOURS.get(row.kind, _GREY)
    size = (front - rear, left - right, CAR_HEIGHT_M)
    body = _marker("cars", number, "CUBE", t_ns, at, 0.5 * CAR_HEIGHT_M, size, colour)
    above = (0.0, 0.0, CAR_HEIGHT_M)
    name = _marker("names", number, "TEXT_VIEW_FACING", t_ns, at, 2.0 * CAR_HEIGHT_M, above, _WHITE)
    name.text = row.vehicle
    return [body, name]


def _box(number: int, row: SnapshotBox, box: Box, t_ns: int) -> Any:
    size = (box.length_m, box.width_m, box.height_m)
    at = Pose2(row.x_m, row.y_m, row.yaw_rad)
    return _marker("boxes", number, "CUBE", t_ns, at, 0.5 * box.height_m, size, _GREY)


def _heads(city_map: CityMap, spats: Mapping[str, Spat], t_ns: int) -> list[Any]:
    shown = {(s.junction, g.group): g.colour for s in spats.values() for g in s.groups}
    out = []
    for light in city_map.lights:
        colour = shown.get((light.junction, light.group), "dark")
        if colour == "flashing_red" and t_ns // FLASH_NS % 2:
            continue
        height = LOWEST_LAMP_M + LAMP_M * _LAMPS.get(colour, 2)
        at, size = Pose2(light.x_m, light.y_m, light.yaw_rad), (LAMP_M, LAMP_M, LAMP_M)
        rgb = COLOURS[colour]
        out.append(_marker("signals", light.light_id, "SPHERE", t_ns, at, height, size, rgb))
    return out


def _lines(name: str, ends: list[tuple[float, float]], colour: Colour, t_ns: int) -> Any:
    origin, thin = Pose2(0.0, 0.0, 0.0), (LINE_M, 0.0, 0.0)
    marker = _marker(name, 0, "LINE_LIST", t_ns, origin, 0.0, thin, colour, lasts_ns=0)
    marker.points = [point(float(x), float(y)) for x, y in ends]
    return marker


def _marker(
    space: str,
    number: int,
    shape: str,
    t_ns: int,
    at: Pose2,
    height: float,
    size: tuple[float, float, float],
    colour: Colour,
    lasts_ns: int = LASTS_NS,
) -> Any:
    red, green, blue = colour
    kind = "visualization_msgs/Marker"
    nothing = header(0, "")
    return ros(
        kind,
        header=header(t_ns, MAP),
        ns=space,
        id=number,
        type=constant(kind, shape),
        action=constant(kind, "ADD"),
        pose=pose(at, height),
        scale=vector(*size),
        color=ros("std_msgs/ColorRGBA", r=red, g=green, b=blue, a=1.0),
        lifetime=ros("builtin_interfaces/Duration", sec=0, nanosec=lasts_ns),
        frame_locked=False,
        points=[],
        colors=[],
        texture_resource="",
        texture=ros(
            "sensor_msgs/CompressedImage", header=nothing, format="", data=np.zeros(0, np.uint8)
        ),
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=ros("visualization_msgs/MeshFile", filename="", data=np.zeros(0, np.uint8)),
        mesh_use_embedded_materials=False,
    )


def _array(markers: Iterable[Any]) -> Any:
    return ros("visualization_msgs/MarkerArray", markers=list(markers))
