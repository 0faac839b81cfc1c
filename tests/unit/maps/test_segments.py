import math

import numpy as np
import pytest

from scm.maps.load import load_map
from scm.maps.segments import box_outline, wall_outlines, wall_segments
from scm.records.city_map import Box, Wall

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


def test_a_line_wall_is_its_own_face():
    wall = Wall(points=((0.0, 0.0), (1.0, 0.0)), thickness_m=0.0)
    assert wall_outlines(wall) == [((0.0, 0.0), (1.0, 0.0))]


def test_an_open_wall_is_a_ring_round_its_line():
    (ring,) = wall_outlines(Wall(points=((0.0, 0.0), (1.0, 0.0)), thickness_m=0.2))
    assert ring == ((0.0, 0.1), (1.0, 0.1), (1.0, -0.1), (0.0, -0.1), (0.0, 0.1))


def test_a_closed_wall_has_an_inner_and_an_outer_face_with_square_corners():
    inner, outer = wall_outlines(Wall(points=SQUARE, closed=True, thickness_m=0.2))
    np.testing.assert_allclose(inner[0], (0.1, 0.1))
    np.testing.assert_allclose(outer[2], (1.1, 1.1))
    assert inner[0] == inner[-1]


def test_a_point_given_twice_changes_nothing():
    repeated = Wall(points=(*SQUARE, SQUARE[0]), closed=True, thickness_m=0.2)
    assert wall_outlines(repeated) == wall_outlines(
        Wall(points=SQUARE, closed=True, thickness_m=0.2)
    )


def test_a_box_is_turned_about_its_middle():
    box = Box(name="b", x_m=1.0, y_m=2.0, yaw_rad=math.pi / 2, length_m=0.4, width_m=0.2)
    np.testing.assert_allclose(box_outline(box)[:2], [(0.9, 2.2), (0.9, 1.8)], atol=1e-12)


def test_the_driving_school_is_walled_in_along_its_floor():
    city_map = load_map("driving_school")
    segments = wall_segments(city_map)
    assert segments.shape == (8, 4)
    inner = segments[np.hypot(segments[:, 0] - 1.384, segments[:, 1] - 0.655).argsort()[:4]]
    assert inner[:, [0, 2]].min() == pytest.approx(city_map.floor.x_m[0])
    assert inner[:, [1, 3]].max() == pytest.approx(city_map.floor.y_m[1])


def test_a_map_without_walls_has_no_segments():
    city_map = load_map("driving_school")
    bare = type(city_map)(
        map=1, name="n", title="t", source="s", floor=city_map.floor, tag=city_map.tag
    )
    assert wall_segments(bare).shape == (0, 4)
