"""What a map's keys and types cannot say: every problem of its meaning, as sentences."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import msgspec

from scm.errors import nearest
from scm.geometry import wrap_angle
from scm.maps.floor_check import floor_problems
from scm.maps.neighbours_check import neighbour_problems
from scm.maps.radio_check import radio_problems
from scm.maps.route import LanePath
from scm.maps.rules_check import rule_problems
from scm.maps.vehicle_tags import LAST_TAG_ID
from scm.records.city_map import ANY_BAY, CityMap, Conflict, Group, Junction, Segment

MAX_GAP_M = 0.001  # between two lanes that follow one another
MAX_KINK_RAD = math.radians(0.1)  # between their directions

_POSITIVE = {
    "width_m", "length_m", "radius_m", "height_m", "size_m", "speed_limit_mps", "radio_range_m",
    "z_m", "width_px", "height_px", "fx_px", "fy_px", "rate_hz", "mass_kg", "gust_s", "m_per_grey",
    "value_mps", "range_m", "path_loss_exponent", "green_s",
}  # fmt: skip
_NOT_NEGATIVE = {
    "thickness_m", "noise_sigma", "tag_id", "first_vehicle_tag_id", "friction", "loss", "fading_db",
    "wall_db", "delay_ms", "jitter_ms", "data_rate_mbps", "hidden_share",
}  # fmt: skip


def problems_of(city_map: CityMap) -> list[str]:
    """Return every problem of a map, each as `key (name): expected .., got ..`; none: it is good.

    Checks that need the lanes' geometry are made only if the numbers and segments are right.
    """
    found = [*_numbers(city_map, ""), *_segments(city_map)]
    checks = (
        _unique, _outlines, floor_problems, radio_problems, neighbour_problems, _references,
        _spawns, _bays,
    )  # fmt: skip
    for check in checks:
        found += check(city_map)
    if not any(".segments" in problem for problem in found):
        found += rule_problems(city_map)
    if not found:
        paths = {lane.name: LanePath(lane) for lane in city_map.lanes}
        for geometric in (_connections, _places):
            found += geometric(city_map, paths)
    return found


def _numbers(record: object, where: str) -> Iterator[str]:
    """Doubt every number: finite, and positive where nothing else makes sense."""
    if isinstance(record, msgspec.Struct):
        for key in record.__struct_fields__:
            yield from _number(key, getattr(record, key), f"{where}.{key}".lstrip("."))
    elif isinstance(record, tuple):
        for index, item in enumerate(record):
            if isinstance(item, float) and not math.isfinite(item):
                yield f"{where}[{index}]: expected a finite number, got {item}"
            yield from _numbers(item, f"{where}[{index}]")


def _number(key: str, value: object, where: str) -> Iterator[str]:
    """Doubt one key's value."""
    if not isinstance(value, (int, float)):
        yield from _numbers(value, where)
    elif not math.isfinite(value):
        yield f"{where}: expected a finite number, got {value}"
    elif key in _POSITIVE and value <= 0:
        yield f"{where}: expected more than 0, got {value}"
    elif key in _NOT_NEGATIVE and value < 0:
        yield f"{where}: expected 0 or more, got {value}"


def _segments(city_map: CityMap) -> Iterator[str]:
    """Doubt that each piece of a lane is either a straight or an arc."""
    for index, lane in enumerate(city_map.lanes):
        if not lane.segments:
            yield f"lanes[{index}] ({lane.name}).segments: expected at least one, got none"
        for number, segment in enumerate(lane.segments):
            if not _is_straight(segment) and not _is_arc(segment):
                given = [key for key in segment.__struct_fields__ if getattr(segment, key)]
                yield (
                    f"lanes[{index}] ({lane.name}).segments[{number}]: expected length_m, or "
                    f"radius_m with an angle_rad other than 0; got {' and '.join(given) or 'none'}"
                )


def _is_straight(segment: Segment) -> bool:
    return segment.length_m is not None and segment.radius_m is None and segment.angle_rad is None


def _is_arc(segment: Segment) -> bool:
    return segment.length_m is None and segment.radius_m is not None and bool(segment.angle_rad)


def _unique(city_map: CityMap) -> Iterator[str]:
    """Doubt that names, numbers and ids are given once."""
    junctions = city_map.junctions
    named: list[tuple[str, str, Sequence[Any]]] = [
        (key, "name", getattr(city_map, key))
        for key in (
            "lanes", "areas", "junctions", "crossings", "stop_lines", "crosswalks", "boxes",
            "spawns", "bays",
        )
    ]  # fmt: skip
    named += [
        ("cameras", "name", city_map.cameras),
        ("junctions", "number", junctions),
        ("lights", "light_id", city_map.lights),
        ("signs", "sign_id", city_map.signs),
        ("vehicle_tags", "vehicle", city_map.vehicle_tags),
        ("vehicle_tags", "tag_id", city_map.vehicle_tags),
    ]
    named += [
        (f"floor.{key}", "name", getattr(city_map.floor, key))
        for key in ("patches", "ramps", "plates")
    ]
    for index, junction in enumerate(junctions):
        for attribute in ("name", "number"):
            named.append((f"junctions[{index}].groups", attribute, junction.groups))
    for index, crossing in enumerate(city_map.crossings):
        named.append((f"crossings[{index}].approaches", "name", crossing.approaches))
    for key, attribute, records in named:
        seen: dict[object, int] = {}
        for index, record in enumerate(records):
            value = getattr(record, attribute)
            if value in seen:
                yield (
                    f"{key}[{index}].{attribute}: {value!r} is already that of "
                    f"{key}[{seen[value]}]; expected each once"
                )
            seen.setdefault(value, index)
    if city_map.tag.tag_id >= city_map.first_vehicle_tag_id:
        yield (
            f"first_vehicle_tag_id: expected more than tag.tag_id = {city_map.tag.tag_id}, "
            f"got {city_map.first_vehicle_tag_id}"
        )
    for index, one in enumerate(city_map.vehicle_tags):
        if one.tag_id > LAST_TAG_ID or one.tag_id == city_map.tag.tag_id:
            yield (
                f"vehicle_tags[{index}] ({one.vehicle}).tag_id: expected 0 to {LAST_TAG_ID}, and "
                f"not the map's own {city_map.tag.tag_id}, got {one.tag_id}"
            )


def _outlines(city_map: CityMap) -> Iterator[str]:
    """Doubt the extent of the floor, areas and walls."""
    for key, (low, high) in (("x_m", city_map.floor.x_m), ("y_m", city_map.floor.y_m)):
        if low >= high:
            yield f"floor.{key}: expected [low, high], got [{low}, {high}]"
    for index, wall in enumerate(city_map.walls):
        count = len(set(wall.points))
        if count < 2:
            yield f"walls[{index}].points: expected at least 2 different ones, got {count}"
    for index, area in enumerate(city_map.areas):
        count = len(area.points)
        if count < 3:
            yield f"areas[{index}] ({area.name}).points: expected at least 3, got {count}"


def _references(city_map: CityMap) -> Iterator[str]:
    """Doubt that every lane, junction and group that is named exists."""
    lanes = [lane.name for lane in city_map.lanes]
    for index, lane in enumerate(city_map.lanes):
        for name in lane.next:
            yield from _known(f"lanes[{index}] ({lane.name}).next", "lane", name, lanes)
    for index, spawn in enumerate(city_map.spawns):
        if spawn.lane is not None:
            yield from _known(f"spawns[{index}] ({spawn.name}).lane", "lane", spawn.lane, lanes)
    groups = {j.name: [group.name for group in j.groups] for j in city_map.junctions}
    for index, junction in enumerate(city_map.junctions):
        for number, group in enumerate(junction.groups):
            where = f"junctions[{index}].groups[{number}] ({group.name})"
            for key, move in _movements(group):
                yield from _known(f"{where}.{key}.lane", "lane", move.lane, lanes)
        yield from _staged(f"junctions[{index}]", junction)
    for index, line in enumerate(city_map.stop_lines):
        where = f"stop_lines[{index}] ({line.name})"
        yield from _known(f"{where}.lane", "lane", line.lane, lanes)
        yield from _known_group(where, line.junction, line.group, groups)
    for index, light in enumerate(city_map.lights):
        where = f"lights[{index}] ({light.light_id})"
        yield from _known_group(where, light.junction, light.group, groups)


def _staged(where: str, junction: Junction) -> Iterator[str]:
    """Doubt the groups of a junction's own stages."""
    groups = [group.name for group in junction.groups]
    for number, stage in enumerate(junction.stages):
        for name in stage.groups:
            what = f"group of {junction.name}"
            yield from _known(f"{where}.stages[{number}].groups", what, name, groups)


def _known_group(
    where: str, junction: str, group: str, groups: dict[str, list[str]]
) -> Iterator[str]:
    yield from _known(f"{where}.junction", "junction", junction, list(groups))
    if junction in groups:
        yield from _known(f"{where}.group", f"group of {junction}", group, groups[junction])


def _known(where: str, what: str, name: str, valid: Sequence[str]) -> Iterator[str]:
    if name not in valid:
        choice = ", ".join(valid) or "none: the map has no such thing"
        yield f"{where}: no {what} {name!r}{nearest(name, valid)}; expected one of {choice}"


def _spawns(city_map: CityMap) -> Iterator[str]:
    """Doubt that a spawn is given by lane and distance, or by pose."""
    for index, spawn in enumerate(city_map.spawns):
        on_lane = spawn.lane is not None and spawn.at_m is not None and spawn.pose is None
        by_pose = spawn.lane is None and spawn.at_m is None and spawn.pose is not None
        if not on_lane and not by_pose:
            given = [key for key in ("lane", "at_m", "pose") if getattr(spawn, key) is not None]
            yield (
                f"spawns[{index}] ({spawn.name}): expected lane and at_m, or pose alone; "
                f"got {' and '.join(given) or 'none of them'}"
            )


def _bays(city_map: CityMap) -> Iterator[str]:
    """Doubt that a bay lies on the floor, and that its name means no other place."""
    floor, spawns = city_map.floor, {spawn.name for spawn in city_map.spawns}
    for index, bay in enumerate(city_map.bays):
        where = f"bays[{index}] ({bay.name})"
        if bay.name in spawns or bay.name == ANY_BAY:
            expected = f"expected no spawn's name and not {ANY_BAY!r}"
            yield f"{where}.name: {expected}, got {bay.name!r}"
        for axis, value, (low, high) in zip("xy", bay.pose, (floor.x_m, floor.y_m), strict=False):
            if not low <= value <= high:
                yield f"{where}.pose: expected {axis} from {low} to {high}, got {value}"


def _connections(city_map: CityMap, paths: dict[str, LanePath]) -> Iterator[str]:
    """Doubt that a lane begins where, and as, the one before it ends."""
    for index, lane in enumerate(city_map.lanes):
        end = paths[lane.name].at(math.inf)
        for name in lane.next:
            start = paths[name].at(0.0)
            gap = math.hypot(start.x - end.x, start.y - end.y)
            kink = abs(wrap_angle(start.yaw - end.yaw))
            if gap > MAX_GAP_M or kink > MAX_KINK_RAD:
                yield (
                    f"lanes[{index}] ({lane.name}).next: {name!r} does not connect: the end is at "
                    f"({end.x:.4f}, {end.y:.4f}, {math.degrees(end.yaw):.2f} deg), the start of "
                    f"{name!r} at ({start.x:.4f}, {start.y:.4f}, {math.degrees(start.yaw):.2f} "
                    f"deg); expected at most {MAX_GAP_M * 1e3:.0f} mm and "
                    f"{math.degrees(MAX_KINK_RAD):.1f} deg between them"
                )


def _places(city_map: CityMap, paths: dict[str, LanePath]) -> Iterator[str]:
    """Doubt that places along lanes lie on them, and stretches run forward."""
    for index, line in enumerate(city_map.stop_lines):
        yield from _on_lane(f"stop_lines[{index}] ({line.name}).at_m", line.at_m, paths[line.lane])
    for index, spawn in enumerate(city_map.spawns):
        if spawn.lane is not None and spawn.at_m is not None:
            where = f"spawns[{index}] ({spawn.name}).at_m"
            yield from _on_lane(where, spawn.at_m, paths[spawn.lane])
    for index, junction in enumerate(city_map.junctions):
        for number, group in enumerate(junction.groups):
            where = f"junctions[{index}].groups[{number}] ({group.name})"
            for key, move in _movements(group):
                yield from _stretch(f"{where}.{key}", move, paths[move.lane])


def _movements(group: Group) -> list[tuple[str, Conflict]]:
    """Return the ways that a group releases, each with its key in the file."""
    more = [(f"more[{number}]", move) for number, move in enumerate(group.more)]
    return [("movement", group.movement), *more]


def _stretch(where: str, move: Conflict, path: LanePath) -> Iterator[str]:
    """Doubt that a movement lies on its lane and runs forward."""
    yield from _on_lane(f"{where}.from_m", move.from_m, path)
    yield from _on_lane(f"{where}.to_m", move.to_m, path)
    if move.from_m >= move.to_m:
        yield f"{where}.to_m: expected more than from_m = {move.from_m}, got {move.to_m}"


def _on_lane(where: str, at_m: float, path: LanePath) -> Iterator[str]:
    if not 0.0 <= at_m <= path.length_m:
        yield (
            f"{where}: expected 0 to {path.length_m:.4f} (the length of lane {path.name!r}), "
            f"got {at_m}"
        )
