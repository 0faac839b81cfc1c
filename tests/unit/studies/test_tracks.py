"""Tracks that nobody trained on, and the lanes of a map the other way round."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

from scm.camera.optics import fitted
from scm.maps.check import problems_of
from scm.maps.load import load_map
from scm.maps.route import Path, roads_of
from studies.cloning import BOX_M, lanes_only, with_boxes
from studies.tracks import TIGHTEST_M, track


@pytest.mark.parametrize("seed", range(1, 7))
def test_track_is_closed_and_inside_its_walls(seed):
    city_map = track(seed)
    assert problems_of(city_map) == []
    path = Path.circulation(roads_of(city_map), "track")
    begin, end = path.at(0.0), path.at(path.length_m - 1e-6)
    assert math.dist(begin[:2], end[:2]) < 1e-4
    assert math.cos(begin.yaw - end.yaw) == pytest.approx(1.0)
    radii = [one.radius_m for one in city_map.lanes[0].segments if one.radius_m]
    assert min(radii) >= TIGHTEST_M
    turned = sum(one.angle_rad or 0.0 for one in city_map.lanes[0].segments)
    assert turned == pytest.approx(math.copysign(math.tau, 1 if seed % 2 else -1))


def test_track_is_the_same_for_the_same_seed():
    assert track(3) == track(3)
    assert track(3) != track(4)


def test_lanes_lead_back_over_the_same_floor():
    there, back = (
        Path.circulation(roads_of(one), one.lanes[0].name)
        for one in (lanes_only(load_map("driving_school"), back=way) for way in (False, True))
    )
    assert back.length_m == pytest.approx(there.length_m)
    for at_m in (0.3, 1.7, 4.4):
        pose = back.at(at_m)
        candidates = [0.01 * k for k in range(round(100 * there.length_m))]
        near = [s for s in candidates if math.dist(there.at(s)[:2], pose[:2]) < 0.011]
        assert any(math.cos(there.at(s).yaw - pose.yaw) < -0.999 for s in near)


def test_boxes_stand_beside_the_lane():
    school = lanes_only(load_map("driving_school"))
    city_map = replace(school, boxes=with_boxes(school, 20, np.random.default_rng(0)))
    boxes = city_map.boxes[len(school.boxes) :]
    assert len(boxes) == 20
    assert problems_of(city_map) == []
    way = Path.circulation(roads_of(city_map), city_map.lanes[0].name)
    beside = [abs(way.project(box.x_m, box.y_m)[1]) for box in boxes]
    assert min(beside) > 0.5 * (city_map.lanes[0].width_m + BOX_M)


def test_smaller_camera_sees_the_same():
    optics = fitted("nigel")["front"]
    half = optics.of_width(640)
    assert (half.width_px, half.height_px) == (640, 360)
    assert half.focal_px / half.width_px == pytest.approx(optics.focal_px / optics.width_px)
