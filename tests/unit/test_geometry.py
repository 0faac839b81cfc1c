"""Poses and angles: wrapped once, chained in the order of their names."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scm.geometry import TAU, Pose2, wrap_angle

METRES = st.floats(-100.0, 100.0)
ANGLES = st.floats(-math.pi, math.pi, exclude_min=True)
POSES = st.builds(Pose2, METRES, METRES, ANGLES)


def same(a, b):
    return (
        math.hypot(a.x - b.x, a.y - b.y) < 1e-9 and abs(math.remainder(a.yaw - b.yaw, TAU)) < 1e-9
    )


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [(0.0, 0.0), (math.pi, math.pi), (-math.pi, math.pi), (3 * math.pi, math.pi), (TAU, 0.0)],
)
def test_half_a_turn_is_plus_pi_from_both_sides(angle, wrapped):
    assert wrap_angle(angle) == pytest.approx(wrapped)


@given(st.floats(-1e6, 1e6))
def test_a_wrapped_angle_points_the_same_way(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


def test_a_quarter_turn_left_takes_ahead_to_the_left():
    assert Pose2(1.0, 2.0, math.pi / 2).apply(1.0, 0.0) == pytest.approx((1.0, 3.0))


def test_chaining_reads_from_left_to_right():
    world_t_body = Pose2(1.0, 0.0, math.pi / 2)
    body_t_tag = Pose2(0.5, 0.0, 0.0)
    assert same(world_t_body @ body_t_tag, Pose2(1.0, 0.5, math.pi / 2))


@given(POSES)
def test_a_pose_and_its_inverse_cancel(pose):
    assert same(pose @ pose.inverse(), Pose2(0.0, 0.0, 0.0))
    assert same(pose.inverse() @ pose, Pose2(0.0, 0.0, 0.0))


@given(POSES, POSES, POSES)
def test_chaining_is_associative(a, b, c):
    assert same((a @ b) @ c, a @ (b @ c))


@given(POSES, METRES, METRES)
def test_a_point_through_a_pose_is_the_origin_of_a_chained_one(pose, x, y):
    chained = pose @ Pose2(x, y, 0.0)
    assert pose.apply(x, y) == pytest.approx((chained.x, chained.y))
