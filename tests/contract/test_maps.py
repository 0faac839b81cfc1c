"""What every map file of the project must keep, whatever it shows."""

import itertools
import math
import xml.etree.ElementTree as ET

import msgspec
import numpy as np
import pytest

from scm.geometry import Pose2, wrap_angle
from scm.maps.conflicts import conflicting_groups
from scm.maps.draw import draw_svg
from scm.maps.load import load_map, map_names
from scm.maps.route import Path, Roads
from scm.maps.segments import wall_segments
from scm.records.city_map import CityMap

CAR = ((-0.07, -0.0875), (0.23, -0.0875), (0.23, 0.0875), (-0.07, 0.0875))
SEEN_BEYOND_FLOOR_M = 0.03


@pytest.fixture(scope="module", params=map_names())
def city_map(request):
    return load_map(request.param)


@pytest.fixture(scope="module")
def roads(city_map):
    return Roads(city_map)


def car_outline(pose):
    """Return the edge of a Nigel at a pose, a point every centimetre or so, shape (n, 2)."""
    corners = np.array([pose.apply(x, y) for x, y in CAR])
    t = np.linspace(0.0, 1.0, 31)[:, None]
    edges = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    return np.vstack([a + t * (b - a) for a, b in edges])


def distance_to_segments(points, segments):
    """Return the smallest distance between points (n, 2) and segments (m, 4) [m]."""
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    to_point = points[:, None, :] - start
    t = np.clip((to_point * along).sum(axis=2) / (along**2).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(to_point - t[..., None] * along, axis=2).min()


def pixels(camera, points, tilt_sign):
    """Return where floor points (n, 2) appear in the picture, by OpenCV's camera model."""
    c, s = math.cos(camera.yaw_rad), math.sin(camera.yaw_rad)
    to_camera = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
    ax, ay = tilt_sign * camera.tilt_x_rad, tilt_sign * camera.tilt_y_rad
    about_x = [[1, 0, 0], [0, math.cos(ax), -math.sin(ax)], [0, math.sin(ax), math.cos(ax)]]
    about_y = [[math.cos(ay), 0, math.sin(ay)], [0, 1, 0], [-math.sin(ay), 0, math.cos(ay)]]
    on_floor = np.column_stack([points, np.zeros(len(points))])
    seen = (on_floor - (camera.x_m, camera.y_m, camera.z_m)) @ (
        np.array(about_y) @ np.array(about_x) @ to_camera
    ).T
    x, y = (seen[:, :2] / seen[:, 2:]).T
    k1, k2, p1, p2, k3 = camera.distortion
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.column_stack([camera.fx_px * xd + camera.cx_px, camera.fy_px * yd + camera.cy_px])


def test_its_name_is_that_of_its_file(city_map):
    assert city_map.name in map_names()
    assert load_map(city_map.name) == city_map


def test_it_travels_as_json_unchanged(city_map):
    assert msgspec.json.decode(msgspec.json.encode(city_map), type=CityMap) == city_map


def test_lanes_connect_end_to_start(city_map, roads):
    for lane in city_map.lanes:
        end = roads.lanes[lane.name].at(math.inf)
        for name in lane.next:
            start = roads.lanes[name].at(0.0)
            assert math.hypot(end.x - start.x, end.y - start.y) < 1e-3
            assert abs(wrap_angle(end.yaw - start.yaw)) < math.radians(0.1)


def test_every_lane_leads_on_and_a_car_comes_round_from_every_spawn(city_map, roads):
    assert all(lane.next for lane in city_map.lanes)
    for lane in {spawn.lane for spawn in city_map.spawns} - {None}:
        assert Path.circulation(roads, lane).length_m > 0.0


def test_every_lane_can_be_reached_from_every_other(city_map, roads):
    for start, goal in itertools.permutations(roads.lanes, 2):
        assert roads.route(start, (goal,))[-1] == goal


def test_the_map_tag_and_the_cars_never_share_an_id(city_map):
    assert city_map.tag.tag_id < city_map.first_vehicle_tag_id


def test_the_map_tag_lies_on_the_floor_beside_the_road(city_map, roads):
    tag, floor, half = city_map.tag, city_map.floor, city_map.tag.size_m * 0.625
    assert floor.x_m[0] <= tag.x_m - half
    assert tag.x_m + half <= floor.x_m[1]
    assert floor.y_m[0] <= tag.y_m - half
    assert tag.y_m + half <= floor.y_m[1]
    for lane in roads.lanes.values():
        away = np.hypot(lane.points[:, 0] - tag.x_m, lane.points[:, 1] - tag.y_m)
        assert away.min() > lane.width_m / 2 + half


def test_stop_lines_lie_on_lanes_and_each_group_has_one(city_map, roads):
    for line in city_map.stop_lines:
        assert 0.0 <= line.at_m <= roads.lanes[line.lane].length_m
    groups = {(j.name, g.name) for j in city_map.junctions for g in j.groups}
    assert {(line.junction, line.group) for line in city_map.stop_lines} == groups


def test_movements_lie_behind_the_stop_line_on_its_lane_or_the_next(city_map, roads):
    lines = {(line.junction, line.group): line for line in city_map.stop_lines}
    for junction in city_map.junctions:
        for group in junction.groups:
            line = lines[junction.name, group.name]
            for move in group.movements:
                if line.lane == move.lane:
                    assert line.at_m < move.from_m
                else:
                    assert move.lane in roads.successors(line.lane)
                assert move.from_m < move.to_m <= roads.lanes[move.lane].length_m


def test_a_car_that_left_a_movement_is_clear_of_the_lanes_that_cross(city_map, roads):
    for junction in city_map.junctions:
        for one, other in itertools.permutations(junction.groups, 2):
            if frozenset((one.name, other.name)) not in conflicting_groups(junction, roads):
                continue
            for mine, theirs in itertools.product(one.movements, other.movements):
                if set(roads.successors(mine.lane)) & set(roads.successors(theirs.lane)):
                    continue  # they merge: who comes later follows
                lane, crossed = roads.lanes[mine.lane], roads.lanes[theirs.lane]
                tail = lane.at(mine.to_m + min(x for x, _ in CAR))
                away = np.hypot(crossed.points[:, 0] - tail.x, crossed.points[:, 1] - tail.y)
                assert away.min() >= crossed.width_m / 2


def test_lights_refer_to_groups_and_look_at_their_cars(city_map, roads):
    lines = {(line.junction, line.group): line for line in city_map.stop_lines}
    for light in city_map.lights:
        line = lines[light.junction, light.group]
        stop = roads.lanes[line.lane].at(line.at_m)
        assert abs(wrap_angle(light.yaw_rad - stop.yaw)) > math.radians(120.0)


def test_every_group_has_a_light(city_map):
    shown = {(light.junction, light.group) for light in city_map.lights}
    assert {(j.name, g.name) for j in city_map.junctions for g in j.groups} == shown


def test_cars_on_all_spawns_and_in_all_bays_keep_clear_of_each_other(city_map, roads):
    places = (*city_map.spawns, *city_map.bays)
    outlines = [car_outline(roads.spawn_pose(place.name)) for place in places]
    for one, other in itertools.combinations(outlines, 2):
        gap = np.linalg.norm(one[:, None, :] - other[None, :, :], axis=2).min()
        # 0.15 m along the lane; the inner edge of a bend is shorter.
        assert gap > 0.12


def test_cars_on_spawns_and_in_bays_keep_clear_of_walls_and_stand_on_the_floor(city_map, roads):
    segments, floor = wall_segments(city_map), city_map.floor
    for place in (*city_map.spawns, *city_map.bays):
        outline = car_outline(roads.spawn_pose(place.name))
        assert distance_to_segments(outline, segments) > 0.05
        assert floor.x_m[0] < outline[:, 0].min()
        assert outline[:, 0].max() < floor.x_m[1]
        assert floor.y_m[0] < outline[:, 1].min()
        assert outline[:, 1].max() < floor.y_m[1]


def test_no_car_is_put_into_a_junction_or_over_its_stop_line(city_map, roads):
    for spawn in city_map.spawns:
        if spawn.lane is None:
            continue
        path = Path.circulation(roads, spawn.lane)
        tail, nose = spawn.at_m - 0.07, spawn.at_m + 0.23
        for at_m, _ in path.stop_lines:
            assert (at_m - tail) % path.length_m > nose - tail
        for begin, end, _ in path.conflicts:
            assert (begin - tail) % path.length_m > nose - tail
            assert (tail - begin) % path.length_m > end - begin


def test_there_are_enough_spawns(city_map):
    assert len(city_map.spawns) >= (8 if city_map.lanes else 2)


def test_cars_on_the_road_keep_clear_of_the_walls(city_map, roads):
    segments = wall_segments(city_map)
    for lane in roads.lanes.values():
        assert distance_to_segments(lane.points[::5], segments) > lane.width_m / 2


def test_lights_and_signs_stand_beside_the_lanes(city_map, roads):
    posts = [*city_map.lights, *city_map.signs]
    for post, lane in itertools.product(posts, roads.lanes.values()):
        away = np.hypot(lane.points[:, 0] - post.x_m, lane.points[:, 1] - post.y_m)
        assert away.min() > lane.width_m / 2


def test_crosswalks_lie_across_a_lane_in_its_direction(city_map, roads):
    for crossing in city_map.crosswalks:
        on_lane = roads.nearest(Pose2(crossing.x_m, crossing.y_m, crossing.yaw_rad))
        assert on_lane is not None
        assert abs(on_lane.lateral) < 0.01


@pytest.mark.parametrize("tilt_sign", [-1.0, 1.0])
def test_each_overhead_camera_sees_the_whole_floor(city_map, tilt_sign):
    (x0, x1), (y0, y1) = city_map.floor.x_m, city_map.floor.y_m
    beyond = SEEN_BEYOND_FLOOR_M
    xs = np.linspace(x0 - beyond, x1 + beyond, 41)
    ys = np.linspace(y0 - beyond, y1 + beyond, 21)
    rim = np.vstack(
        [np.column_stack([xs, np.full(41, y)]) for y in ys[[0, -1]]]
        + [np.column_stack([np.full(21, x), ys]) for x in xs[[0, -1]]]
    )
    assert city_map.cameras
    for camera in city_map.cameras:
        u, v = pixels(camera, rim, tilt_sign).T
        assert u.min() >= 0
        assert u.max() < camera.width_px
        assert v.min() >= 0
        assert v.max() < camera.height_px


def test_a_tag_is_large_enough_in_the_picture(city_map):
    for camera in city_map.cameras:
        # Eight cells across the black edge; a cell needs over two pixels to be read.
        assert camera.fx_px * city_map.tag.size_m / camera.z_m / 8.0 > 2.0


def test_its_picture_is_drawn(city_map):
    picture = ET.fromstring(draw_svg(city_map, spawns=True))
    ids = [name for node in picture.iter() if (name := node.get("id"))]
    found = set(ids)
    assert len(found) == len(ids)
    assert {f"lane-{lane.name}" for lane in city_map.lanes} <= found
    assert {f"stop-{line.name}" for line in city_map.stop_lines} <= found
    assert {f"light-{light.light_id}" for light in city_map.lights} <= found
    assert {f"spawn-{spawn.name}" for spawn in city_map.spawns} <= found
    assert {f"bay-{bay.name}" for bay in city_map.bays} <= found
