"""The picture of a map: one SVG in map metres, for the dashboard, the docs and `scm show map`.

Things that change have ids: `light-1` with its lamps `light-1-red`, `light-1-yellow` and
`light-1-green`, `movement-<junction>-<group>`, `stop-<name>`, `lane-<name>`, `spawn-<name>`,
`bay-<name>`.
"""

import itertools
import math
from xml.sax.saxutils import escape

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.maps import furniture
from scm.maps.floor_draw import floor_layers, wind_arrow
from scm.maps.names_draw import SPAWN_NAME_AT_M, SPAWN_NAME_M, name_layers
from scm.maps.route import LanePath, Roads
from scm.maps.segments import box_outline, wall_outlines
from scm.maps.signs import precedence_at
from scm.maps.svg import element, label, lane_data, layer, number, outline, placed
from scm.records.city_map import Approach, Bay, CityMap, Crosswalk, Wall

MARGIN_M = 0.06
STRIP_M = 0.17
EDGE_M = 0.011
STRIPE_M = 0.022
ARROW_EVERY_M = 0.42
BLOCK_M = 0.2
GREY = "#7f8792"

ASPHALT, PAINT, INK = "#474b53", "#f4f3ee", "#23272e"
WALL, WALL_EDGE, BOX, BOX_EDGE = "#cfc6b4", "#9c9280", "#d9904a", "#8d5a28"

CAR_OUTLINE = ((-0.07, -0.0875), (0.23, -0.0875), (0.23, 0.0875), (-0.07, 0.0875))
CAR_MIDDLE_M = 0.08  # of that outline, ahead of the rear axle


def draw_svg(
    city_map: CityMap, *, names: bool = False, spawns: bool = False, movable: bool = True
) -> str:
    """Return the map as one self-contained SVG whose units are map metres, y negated.

    Args:
        city_map: The map.
        names: Also write the names of lanes, junctions and crossings.
        spawns: Also draw the places where cars may be put, with their names.
        movable: Also draw boxes that can be pushed, where the map has them.
    """
    x_low, y_low, x_high, y_high = bounds(city_map)
    width, height = x_high - x_low + 2 * MARGIN_M, y_high - y_low + 2 * MARGIN_M + STRIP_M
    box = (x_low - MARGIN_M, -y_high - MARGIN_M, width, height)
    roads = Roads(city_map)
    layers = [
        _ground(city_map),
        _road(city_map),
        floor_layers(city_map),
        _paint(city_map, roads),
        layer("bays", map(_bay, city_map.bays)),
        _walls(city_map, movable=movable),
        _tag(city_map),
        layer("spawns", _spawns(city_map, roads) if spawns else ()),
        layer("signs", map(furniture.sign, city_map.signs)),
        layer("lights", map(furniture.light, city_map.lights)),
        name_layers(city_map, roads) if names else "",
        _scale(city_map, x_low, x_high, y_low),
        wind_arrow(city_map, x_high - 1.2, y_low - MARGIN_M / 2.0 - STRIP_M / 2.0),
    ]
    return element(
        "svg",
        element("title", escape(city_map.title)),
        "\n",
        *layers,
        xmlns="http://www.w3.org/2000/svg",
        viewBox=" ".join(number(value) for value in box),
        class_="city-map",
        role="img",
    )


def bounds(city_map: CityMap) -> tuple[float, float, float, float]:
    """Return x low, y low, x high, y high of floor and walls [m]."""
    xs, ys = list(city_map.floor.x_m), list(city_map.floor.y_m)
    for wall in city_map.walls:
        for line in wall_outlines(wall):
            xs += [x for x, _ in line]
            ys += [y for _, y in line]
    return min(xs), min(ys), max(xs), max(ys)


def _ground(city_map: CityMap) -> str:
    (x0, x1), (y0, y1) = city_map.floor.x_m, city_map.floor.y_m
    fill = city_map.floor.colour
    return element("rect", class_="floor", x=x0, y=-y1, width=x1 - x0, height=y1 - y0, fill=fill)


def _road(city_map: CityMap) -> str:
    """Return the asphalt with a painted line along every edge that is not crossed.

    Lanes are laid down white, then areas with a white rim, then the lanes' asphalt a little
    narrower: what stays white is the outline of all of them together.
    """
    ways = [(lane, lane_data(lane)) for lane in city_map.lanes]
    rim = [
        element("path", d=data, stroke_width=lane.width_m, fill="none", stroke=PAINT)
        for lane, data in ways
    ]
    areas = []
    for index, area in enumerate(city_map.areas):
        data, clip = outline(area.points, closed=True), f"area-{index}-clip"
        areas.append(element("clipPath", element("path", d=data), id=clip))
        areas.append(
            element(
                "path",
                d=data,
                clip_path=f"url(#{clip})",
                fill=ASPHALT,
                stroke=PAINT,
                stroke_width=2 * EDGE_M,
                class_="area",
            )
        )
    asphalt = [
        element(
            "path",
            id=f"lane-{lane.name}",
            class_="lane",
            d=data,
            fill="none",
            stroke=ASPHALT,
            stroke_width=lane.width_m - 2 * EDGE_M,
        )
        for lane, data in ways
    ]
    return layer("road-edge", rim) + layer("areas", areas) + layer("road", asphalt)


def _paint(city_map: CityMap, roads: Roads) -> str:
    """Return what is painted on the road: arrows, crosswalks, stop lines."""
    crossings = [(walk.x_m, walk.y_m, walk.length_m) for walk in city_map.crosswalks]
    clear_areas = np.array(crossings, np.float64).reshape(-1, 3)
    arrows = [arrow for lane in roads.lanes.values() for arrow in _arrows(lane, roads, clear_areas)]
    stops = []
    for line in city_map.stop_lines:
        lane = roads.lanes[line.lane]
        half = lane.width_m / 2.0 - EDGE_M
        stops.append(
            element(
                "path",
                id=f"stop-{line.name}",
                class_="stop-line",
                d=f"M0 {-half:.4f}V{half:.4f}",
                transform=placed(lane.at(line.at_m)),
                stroke=PAINT,
                stroke_width=0.022,
            )
        )
    stops += [
        _give_way_line(f"{crossing.name}-{approach.name}", roads, approach)
        for crossing in city_map.crossings
        for approach in crossing.approaches
    ]
    return (
        layer("movements", _movements(roads))
        + layer("direction", arrows)
        + layer("crosswalks", map(_crosswalk, city_map.crosswalks))
        + layer("stop-lines", stops)
    )


def _give_way_line(name: str, roads: Roads, approach: Approach) -> str:
    """Return a line without lights: unbroken where one must stop, else dashed."""
    lane = roads.lanes[approach.lane]
    half = lane.width_m / 2.0 - EDGE_M
    must_stop = precedence_at(roads.signs.get(approach.lane, ()), approach.at_m) == "stop"
    return element(
        "path",
        id=f"line-{name}",
        class_="stop-line" if must_stop else "give-way-line",
        d=f"M0 {-half:.4f}V{half:.4f}",
        transform=placed(lane.at(approach.at_m)),
        stroke=PAINT,
        stroke_width=0.022,
        stroke_dasharray=None if must_stop else "0.025 0.018",
    )


def _movements(roads: Roads) -> list[str]:
    """Return each group's way through its junction as a faint dashed guide."""
    ways = (
        (junction.name, group.name, count, move)
        for junction in roads.city_map.junctions
        for group in junction.groups
        for count, move in enumerate(group.movements)
    )
    drawn = []
    for junction, group, count, move in ways:
        lane = roads.lanes[move.lane]
        inside = lane.points[(lane.s >= move.from_m) & (lane.s <= move.to_m)]
        points = [(float(x), float(y)) for x, y in inside[::2]]
        drawn.append(
            element(
                "path",
                id=f"movement-{junction}-{group}" + (f"-{count}" if count else ""),
                class_="movement",
                fill="none",
                d=outline(points, closed=False),
                stroke=PAINT,
                stroke_opacity=0.35,
                stroke_width=0.008,
                stroke_dasharray="0.03 0.03",
                data_group=group,
                data_junction=junction,
            )
        )
    return drawn


def _arrows(lane: LanePath, roads: Roads, clear_areas: Floats) -> list[str]:
    """Return arrows along a lane, none on its crosswalks, stop lines or conflict stretches."""
    stretches = [(move.from_m - 0.12, move.to_m) for _, move in roads.movements_on(lane.name)]
    count = max(1, round(lane.length_m / ARROW_EVERY_M))
    arrows = []
    for k in range(count):
        s = (k + 0.5) * lane.length_m / count
        pose = lane.at(s)
        in_conflict = any(low <= s <= high for low, high in stretches)
        x, y, reach = clear_areas.T
        on_stripes = bool((np.hypot(pose.x - x, pose.y - y) < reach + 0.06).any())
        if not in_conflict and not on_stripes:
            arrows.append(_arrow(pose))
    return arrows


def _arrow(pose: Pose2) -> str:
    """Return a dashed arrow, 0.16 m long, about a pose."""
    shaft = element(
        "path", d="M-0.08 0H0.05", stroke=PAINT, stroke_width=0.011, stroke_dasharray="0.03 0.02"
    )
    head = element("path", d="M0.04 -0.026L0.085 0L0.04 0.026Z", fill=PAINT)
    return element("g", shaft, head, transform=placed(pose), opacity=0.75, class_="arrow")


def _crosswalk(crossing: Crosswalk) -> str:
    """Return stripes along the lane's direction, over the lane's width."""
    count = max(1, int((crossing.width_m / STRIPE_M + 1.0) / 2.0))
    step = crossing.width_m / count
    first = (step - crossing.width_m - STRIPE_M) / 2.0
    size = {"width": crossing.length_m, "height": STRIPE_M}
    bars = [
        element("rect", x=-crossing.length_m / 2.0, y=first + k * step, **size)
        for k in range(count)
    ]
    pose = Pose2(crossing.x_m, crossing.y_m, crossing.yaw_rad)
    return element(
        "g",
        *bars,
        id=f"crosswalk-{crossing.name}",
        transform=placed(pose),
        fill=PAINT,
        class_="crosswalk",
    )


def _bay(bay: Bay) -> str:
    """Return a bay's marking, open where cars drive in, with its name."""
    half, front = bay.width_m / 2.0, CAR_MIDDLE_M + bay.length_m / 2.0
    rear = front - bay.length_m
    sides = ((rear, half), (front, half), (front, -half), (rear, -half))
    lines = element(
        "path",
        d=outline(sides, closed=False),
        fill="none",
        stroke=PAINT,
        stroke_width=EDGE_M,
        transform=placed(Pose2(*bay.pose)),
    )
    x, y = Pose2(*bay.pose).apply(CAR_MIDDLE_M, 0.0)
    name = label(bay.name, x, y, SPAWN_NAME_M, fill=PAINT, fill_opacity=0.6, font_weight="600")
    return element("g", lines, name, id=f"bay-{bay.name}", class_="bay")


def _walls(city_map: CityMap, *, movable: bool) -> str:
    walls = [_wall(wall) for wall in city_map.walls]
    boxes = [
        element(
            "path",
            id=f"box-{box.name}",
            class_="box" if box.mass_kg is None else "box movable",
            d=outline(box_outline(box)[:-1], closed=True),
            fill=BOX,
            stroke=BOX_EDGE,
            stroke_width=0.008,
            stroke_linejoin="round",
        )
        for box in city_map.boxes
        if movable or box.mass_kg is None
    ]
    return layer("walls", walls) + layer("boxes", boxes)


def _wall(wall: Wall) -> str:
    outlines = wall_outlines(wall)
    if wall.thickness_m == 0.0:
        return element(
            "path",
            d=outline(outlines[0], closed=wall.closed),
            class_="wall",
            fill="none",
            stroke=INK,
            stroke_width=0.02,
            stroke_linejoin="round",
            stroke_linecap="round",
        )
    body = element(
        "path",
        d="".join(outline(line[:-1], closed=True) for line in outlines),
        class_="wall",
        fill=WALL,
        fill_rule="evenodd",
        stroke=WALL_EDGE,
        stroke_width=0.006,
        stroke_linejoin="round",
    )
    if wall.thickness_m < BLOCK_M / 2.0:
        return body
    joints = element(
        "path",
        d=_sides(wall),
        fill="none",
        stroke=WALL_EDGE,
        stroke_width=wall.thickness_m,
        stroke_opacity=0.5,
        stroke_dasharray=f"0.004 {number(BLOCK_M - 0.004)}",
        class_="joints",
    )
    return body + joints


def _sides(wall: Wall) -> str:
    """Return path data of a wall's straight pieces, each half the thickness short at its ends."""
    points = [*wall.points, wall.points[0]] if wall.closed else list(wall.points)
    data = []
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        length = math.hypot(x1 - x0, y1 - y0)
        t = min(wall.thickness_m / 2.0 / length, 0.5) if length else 0.0
        dx, dy = t * (x1 - x0), t * (y1 - y0)
        data.append(outline([(x0 + dx, y0 + dy), (x1 - dx, y1 - dy)], closed=False))
    return "".join(data)


def _tag(city_map: CityMap) -> str:
    """Return the map's tag: its black edge on white paper, and its id."""
    tag = city_map.tag
    paper = tag.size_m * 1.25
    return element(
        "g",
        element("rect", x=-paper / 2, y=-paper / 2, width=paper, height=paper, fill="#ffffff"),
        element(
            "rect",
            x=-tag.size_m / 2,
            y=-tag.size_m / 2,
            width=tag.size_m,
            height=tag.size_m,
            fill="#111111",
        ),
        label(str(tag.tag_id), 0.0, 0.0, tag.size_m * 0.6, fill="#ffffff", font_weight="700"),
        id="map-tag",
        class_="tag",
        transform=placed(Pose2(tag.x_m, tag.y_m, tag.yaw_rad)),
    )


def _spawns(city_map: CityMap, roads: Roads) -> list[str]:
    """Return a dashed car at every spawn place, with its name."""
    drawn = []
    for spawn in city_map.spawns:
        pose = roads.spawn_pose(spawn.name)
        body = element(
            "path",
            d=outline(CAR_OUTLINE, closed=True),
            fill="#ffffff",
            fill_opacity=0.12,
            stroke="#8ecbff",
            stroke_width=0.008,
            stroke_dasharray="0.025 0.015",
            transform=placed(pose),
        )
        x, y = pose.apply(SPAWN_NAME_AT_M, 0.0)
        name = label(spawn.name, x, y, SPAWN_NAME_M, fill="#d8eeff", font_weight="600")
        drawn.append(element("g", body, name, id=f"spawn-{spawn.name}", class_="spawn"))
    return drawn


def _scale(city_map: CityMap, x_low: float, x_high: float, y_low: float) -> str:
    """Return the strip below the map: its title on the left, a bar of round length on the right."""
    long_m = 0.5 if x_high - x_low < 6.0 else 1.0
    y = y_low - MARGIN_M / 2.0 - STRIP_M / 2.0
    left, middle = x_high - long_m, x_high - long_m / 2.0
    half = element("rect", x=left, y=-y, width=long_m / 2.0, height=0.022, fill=GREY)
    bar = element(
        "rect",
        x=left,
        y=-y,
        width=long_m,
        height=0.022,
        fill="none",
        stroke=GREY,
        stroke_width=0.006,
    )
    return element(
        "g",
        half,
        bar,
        label(f"{long_m:g} m", middle, y + 0.045, 0.055, fill=GREY),
        label(city_map.title, x_low, y, 0.075, text_anchor="start", font_weight="600", fill=GREY),
        class_="scale",
    )
