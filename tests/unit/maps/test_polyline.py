import math

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.maps.polyline import join, sample
from scm.records.city_map import Segment

STRAIGHT = Segment(length_m=1.0)
LEFT = Segment(radius_m=0.5, angle_rad=math.pi / 2)
RIGHT = Segment(radius_m=0.5, angle_rad=-math.pi / 2)


def ring():
    quarter = sample(Pose2(0.5, 0.0, math.pi / 2), (LEFT,))
    pieces = [quarter]
    for _ in range(3):
        pieces.append(sample(pieces[-1].at(math.inf), (LEFT,)))
    return join(pieces, closed=True)


def test_a_left_arc_ends_where_geometry_says():
    line = sample(Pose2(0.0, 0.0, 0.0), (STRAIGHT, LEFT))
    np.testing.assert_allclose(line.at(math.inf), (1.5, 0.5, math.pi / 2), atol=1e-12)


def test_a_right_arc_turns_the_other_way():
    line = sample(Pose2(0.0, 0.0, 0.0), (RIGHT,))
    np.testing.assert_allclose(line.at(math.inf), (0.5, -0.5, -math.pi / 2), atol=1e-12)
    assert line.curvature_at(0.1) == pytest.approx(-2.0)


def test_samples_are_at_most_a_centimetre_apart_and_on_the_true_arc():
    line = sample(Pose2(0.5, 0.0, math.pi / 2), (LEFT,))
    assert np.diff(line.s).max() <= 0.01 + 1e-12
    np.testing.assert_allclose(np.hypot(*line.points.T), 0.5, atol=1e-12)
    assert line.length_m == pytest.approx(math.pi / 4)


def test_left_of_the_line_is_positive():
    line = sample(Pose2(0.0, 0.0, 0.0), (STRAIGHT,))
    assert line.project(0.4, 0.1) == pytest.approx((0.4, 0.1))
    assert line.project(0.4, -0.1) == pytest.approx((0.4, -0.1))


@pytest.mark.parametrize("lateral", [-0.2, 0.0, 0.2])
@pytest.mark.parametrize("hint_off", [-0.3, 0.0, 0.3])
def test_a_projection_finds_the_place_again_from_a_hint_nearby(lateral, hint_off):
    line = sample(Pose2(0.0, 0.0, 0.3), (STRAIGHT, LEFT, RIGHT))
    for s in np.linspace(0.05, line.length_m - 0.05, 37):
        x, y = line.at(s).apply(0.0, lateral)
        found, beside = line.project(x, y, s + hint_off)
        # Between samples a bend is a chord: 25 um beside, and 0.4 % of 1 cm along at this offset.
        assert found == pytest.approx(s, abs=5e-3)
        assert beside == pytest.approx(lateral, abs=1e-4)


def test_a_closed_line_counts_on_through_the_laps():
    line = ring()
    s = 0.0
    for k in range(1, 1001):
        x, y = line.at(0.01 * k).apply(0.0, 0.02)
        s, _ = line.project(x, y, s)
    assert s == pytest.approx(10.0, abs=5e-3)
    assert s > 3 * line.length_m


def test_a_closed_line_goes_back_below_zero():
    line = ring()
    pose = line.at(-0.05)
    s, _ = line.project(pose.x, pose.y, 0.02)
    assert s == pytest.approx(-0.05, abs=1e-6)


def test_an_open_line_stays_at_its_ends():
    line = sample(Pose2(0.0, 0.0, 0.0), (STRAIGHT,))
    assert line.at(-1.0).x == 0.0
    assert line.at(7.0).x == pytest.approx(1.0)
    assert line.project(7.0, 0.0, 0.9)[0] == pytest.approx(1.0)


def test_a_line_may_pass_the_same_piece_twice():
    quarter = sample(Pose2(0.0, 0.0, 0.0), (STRAIGHT,))
    back = sample(Pose2(1.0, 0.0, 0.0), (STRAIGHT,))
    line = join([quarter, back, quarter])
    assert np.all(np.diff(line.s) > 0.0)
    assert line.length_m == pytest.approx(3.0)


def test_the_direction_alone_is_that_of_the_pose():
    line = sample(Pose2(1.0, 2.0, 3.0), [Segment(radius_m=0.5, angle_rad=2.0)])
    for s in np.linspace(-0.5, 1.5, 41):
        assert line.yaw_at(s) == line.at(s).yaw


def test_yaw_is_continuous_over_a_join():
    line = ring()
    assert np.abs(np.diff(line.yaw)).max() < 0.03
    assert line.yaw[-1] - line.yaw[0] == pytest.approx(math.tau)
