import itertools
import math
import re

import numpy as np
import pytest

from scm.errors import MapError
from scm.geometry import Pose2, wrap_angle
from scm.maps.load import load_map
from scm.maps.route import Path, Roads

LAP = ("crossing_south_east", "east_loop", "crossing_south_west", "west_loop")


@pytest.fixture(scope="module")
def roads():
    return Roads(load_map("driving_school"))


def test_a_lap_is_the_published_one(roads):
    path = Path.circulation(roads, LAP[0])
    assert path.lanes == LAP
    # Published: about 6.90 m, derived from a picture measured to 1 cm.
    assert path.length_m == pytest.approx(6.90, abs=0.02)


def test_the_published_start_pose_lies_on_the_lane_that_it_heads_along(roads):
    found = roads.nearest(Pose2(1.384, 0.655, math.radians(315.0)))
    assert found is not None
    assert found.lane == "crossing_south_east"
    assert found.lateral == pytest.approx(0.0, abs=1e-4)


def test_the_other_heading_in_the_middle_is_the_other_lane(roads):
    assert roads.nearest(Pose2(1.384, 0.655, math.radians(225.0))).lane == "crossing_south_west"


def test_a_car_against_the_traffic_is_on_no_lane(roads):
    spawn = roads.spawn_pose("a")
    assert roads.nearest(Pose2(spawn.x, spawn.y, spawn.yaw + math.pi)) is None


def test_the_east_loop_runs_counter_clockwise_and_the_west_loop_clockwise(roads):
    assert roads.lanes["east_loop"].curvature_at(1.0) == pytest.approx(1 / 0.5145)
    assert roads.lanes["west_loop"].curvature_at(1.0) == pytest.approx(-1 / 0.5145)


def test_circulation_repeats_for_ever(roads):
    assert tuple(itertools.islice(roads.circulate("east_loop"), 9)) == (*LAP[1:], *LAP, *LAP[:2])


def test_a_route_fills_in_the_lanes_between(roads):
    assert roads.route("east_loop", ("west_loop",)) == LAP[1:]


def test_a_route_that_starts_at_its_first_aim_counts_it_as_passed(roads):
    assert roads.route("east_loop", ("east_loop", "west_loop")) == LAP[1:]


@pytest.mark.parametrize(("via", "laps"), [((), 10**30), (("west_loop",) * 21, 20)])
def test_a_route_that_would_take_long_to_lay_is_refused(roads, via, laps):
    with pytest.raises(MapError, match="laps x via: expected at most 400"):
        roads.route("east_loop", via, laps)


def test_laps_pass_the_aims_again(roads):
    assert roads.route("east_loop", ("west_loop",), laps=2) == (*LAP[1:], *LAP)


def test_a_route_without_aims_is_the_loop(roads):
    assert roads.route(LAP[0], laps=2) == LAP * 2


def test_an_unknown_lane_is_refused_with_the_nearest_name(roads):
    with pytest.raises(MapError, match="did you mean 'west_loop'"):
        roads.route("east_loop", ("west_lop",))


def test_a_path_refuses_lanes_that_do_not_follow(roads):
    with pytest.raises(MapError, match="'west_loop' does not follow 'east_loop'"):
        Path(roads, ("east_loop", "west_loop"))


def test_a_path_knows_its_stop_lines_and_conflicts_in_driving_order(roads):
    path = Path.circulation(roads, "east_loop")
    assert [line.name for _, line in path.stop_lines] == ["south_west", "south_east"]
    for (at, _), (start, end, junction) in zip(path.stop_lines, path.conflicts, strict=True):
        assert at < start < end
        assert junction == "crossing"


def test_a_path_knows_the_lane_at_every_distance(roads):
    path = Path.circulation(roads, "east_loop")
    for s in np.linspace(-7.0, 14.0, 50):
        index, along = path.index_at(s)
        assert path.lanes[index] == path.lane_at(s)
        pose, expected = path.at(s), roads.lanes[path.lanes[index]].at(along)
        np.testing.assert_allclose(pose[:2], expected[:2], atol=1e-6)
        assert abs(wrap_angle(pose.yaw - expected.yaw)) < 1e-5


def test_a_path_over_a_crossing_is_followed_by_its_hint(roads):
    path = Path.circulation(roads, "crossing_south_east")
    s = 0.0
    for k in range(1, 1500):
        pose = path.at(0.01 * k)
        s, _ = path.project(pose.x, pose.y, s)
    assert s == pytest.approx(14.99, abs=1e-3)


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("1,2", "expected X,Y,DEG"),
        ("1,2,3,4", "expected X,Y,DEG"),
        ("1,2,east", "expected X,Y,DEG"),
        ("1,inf,0", "finite"),
        ("9.5,0.5,0", "x of '9.5,0.5,0' is 9.5 m, expected -0.116 to 2.884"),
    ],
)
def test_coordinates_that_are_no_place_are_refused_in_words(roads, place, words):
    with pytest.raises(MapError, match=re.escape(words)):
        roads.spawn_pose(place)


def test_coordinates_are_metres_and_degrees(roads):
    assert roads.spawn_pose(" 1.384, .655,315") == pytest.approx((1.384, 0.655, -math.pi / 4))


def test_an_unknown_spawn_is_refused(roads):
    with pytest.raises(MapError, match="no spawn 'z'"):
        roads.spawn_pose("z")
