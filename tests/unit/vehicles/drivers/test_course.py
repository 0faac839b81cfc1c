"""Where cars begin, and where they are along their lanes."""

import math

import numpy as np
import pytest

from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.vehicles.drivers.course import (
    AHEAD_M,
    BENDS,
    BESIDE_M,
    DONE_M,
    LIMIT_MPS,
    TURNED_RAD,
    Course,
)

MAP = load_map("driving_school")
ROUND_M = 6.92  # the only way round


def begun(draws, beside_m=0.0, turned_rad=0.0, lanes=(), city_map=MAP):
    course = Course(city_map, len(draws), lanes)
    poses = course.begin(np.arange(len(draws)), np.array(draws), beside_m, turned_rad)
    course.follow(*poses.T)
    return course, poses


def test_cars_begin_on_the_lanes_evenly_and_know_where_they_are():
    draws = [[share, 0.5, 0.5, 0.0] for share in np.linspace(0.0, 0.999, 50)]
    course, poses = begun(draws)
    gaps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert gaps == pytest.approx(ROUND_M / 49, rel=0.02)  # a chord of an arc is shorter
    roads = Roads(MAP)
    for x, y, yaw in poses.tolist():
        place = roads.nearest(Pose2(x, y, yaw))
        assert abs(place.lateral) < 1e-4
    assert np.abs(course.known[:, [BESIDE_M, TURNED_RAD, DONE_M]]).max() < 1e-9
    assert course.known[:, LIMIT_MPS] == pytest.approx(0.25)
    assert course.half_width == pytest.approx(0.1285)


@pytest.mark.parametrize(("draw", "sign"), [(0.0, -1.0), (1.0, 1.0)])
def test_cars_begin_beside_the_middle_and_turned_as_far_as_they_may(draw, sign):
    course, _ = begun([[0.1, draw, draw, 0.0], [0.7, draw, draw, 0.0]], 0.04, 0.3)
    assert course.known[:, BESIDE_M] == pytest.approx(sign * 0.04, abs=1e-9)
    assert course.known[:, TURNED_RAD] == pytest.approx(sign * 0.3, abs=1e-9)


def test_way_is_that_along_the_lanes_and_bends_ahead_are_those_to_come():
    course, poses = begun([[0.0, 0.5, 0.5, 0.0]])
    along = [begun([[share % 1.0, 0.5, 0.5, 0.0]])[1][0] for share in np.linspace(0.0, 1.3, 200)]
    yaw = np.unwrap([one[2] for one in along])
    steps_m = np.linspace(0.0, 1.3 * ROUND_M, 200)
    for pose, done in zip(along, steps_m, strict=True):
        course.follow(*np.array([pose]).T)
        assert course.known[0, DONE_M] == pytest.approx(done, abs=0.02)
    begun_again, _ = begun([[0.0, 0.5, 0.5, 0.0]])
    turns = [np.interp(ahead, steps_m, yaw) - yaw[0] for ahead in AHEAD_M]
    assert begun_again.known[0, BENDS:] == pytest.approx(turns, abs=0.02)
    assert math.hypot(*poses[0, :2]) > 0.0


def test_only_lanes_that_were_chosen_are_begun_on():
    draws = [[share, 0.5, 0.5, 0.0] for share in np.linspace(0.0, 0.99, 20)]
    _, poses = begun(draws, lanes=("east_loop",))
    assert (poses[:, 0] > 1.4).all()
    with pytest.raises(MapError, match=r"east_lop.*east_loop"):
        Course(MAP, 1, ("east_lop",))


def test_where_lanes_branch_the_draw_decides():
    town = load_map("market_town")
    course = Course(town, 8, ("west_outer",))
    draws = np.array([[0.99, 0.5, 0.5, k / 8] for k in range(8)])
    course.begin(np.arange(8), draws, 0.0, 0.0)
    following = course._state.lane_window[:, 2]
    assert len(set(following.tolist())) == 2


def test_pose_that_is_no_number_changes_nothing():
    course, poses = begun([[0.2, 0.5, 0.5, 0.0]])
    before = course.known.copy()
    course.follow(np.array([math.nan]), poses[:, 1], poses[:, 2])
    assert np.array_equal(course.known, before)
