"""What the map says of places."""

import math

import numpy as np
from numpy.testing import assert_allclose

from scm.geometry import wrap_angle
from scm.maps.route import Roads
from scm.traffic.misbehaviour.ground import (
    CELL_M,
    MAX_OFF_ROAD_M,
    POINT_STEP,
    SAME_LANE_M,
    Ground,
    inside,
)
from tests.unit.traffic.misbehaviour.claims import LANE, MAP, ground


def test_the_middle_of_a_lane_is_on_the_road_and_a_metre_off_is_not():
    known, pose = ground(), LANE.at(0.2)
    assert known.off_road_m(pose.x, pose.y) == 0.0
    assert_allclose(known.off_road_m(-1.0, -1.0), 1.0)


def test_beside_the_road_the_distance_is_that_to_its_edge():
    known, pose = ground(), LANE.at(0.1)
    x, y = pose.x - 0.3 * math.sin(pose.yaw), pose.y + 0.3 * math.cos(pose.yaw)
    assert_allclose(known.off_road_m(x, y), 0.3 - LANE.width_m / 2.0, atol=CELL_M)


def test_a_lane_has_one_direction_and_paved_ground_has_none():
    known, pose = ground(), LANE.at(0.1)
    ways = known.ways_at(pose.x, pose.y)
    assert ways
    assert all(abs(math.remainder(way - pose.yaw, math.tau)) < 0.6 for way in ways)
    assert known.ways_at(1.384, 0.655) == ()


def test_a_point_is_inside_a_polygon_or_not():
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    assert inside(0.5, 0.5, square)
    assert not inside(1.5, 0.5, square)
    assert not inside(0.5, -0.5, square)


def test_the_eye_overlooks_what_the_cameras_of_the_map_see():
    known = Ground(MAP)
    assert known.sees(1.384, 0.655)
    assert not known.sees(30.0, 0.0)


def test_what_is_near_is_found_as_if_all_lanes_were_looked_at():
    known, roads = ground(), Roads(MAP)
    rows = [
        (x, y, wrap_angle(yaw), lane.width_m / 2.0)
        for lane in roads.lanes.values()
        for x, y, yaw in np.column_stack([lane.points, lane.yaw])[::POINT_STEP].tolist()
    ]
    paved = 0
    for i in range(-30, 120, 3):
        for j in range(-30, 120, 3):
            x, y = (i + 0.5) * CELL_M, (j + 0.5) * CELL_M
            off, ways = known.off_road_m(x, y), known.ways_at(x, y)
            if any(inside(x, y, area.points) for area in MAP.areas):
                paved += 1
                assert (off, ways) == (0.0, ())
                continue
            beside = [(math.hypot(x - row[0], y - row[1]) - row[3], row[2]) for row in rows]
            away = min(beside)[0]
            near = max(away, 0.0) + SAME_LANE_M
            assert off == min(MAX_OFF_ROAD_M, max(0.0, away))
            if away < MAX_OFF_ROAD_M - 0.25:  # farther off not all lanes are asked
                assert set(ways) == {round(yaw, 1) for beyond, yaw in beside if beyond <= near}
    assert paved > 10
