import math

import numpy as np
import pytest

from scm.geometry import Pose2
from vehicle_agent.autonomy.reeds_shepp import (
    LONGEST_WORD,
    WORDS,
    lengths_m,
    sampled,
    shortest_segments,
    word,
)

RADIUS = 0.245
ROUNDING = 1e-9  # a metre's share that sums of some dozen numbers may lose


def goals(count, seed=1):
    rng = np.random.default_rng(seed)
    places = rng.uniform(-1.5, 1.5, (count, 2))
    return np.column_stack((places, rng.uniform(-math.pi, math.pi, count)))


def test_lengths_are_those_of_ompl():
    pytest.importorskip("ompl", reason="pip install ompl")
    from ompl import base

    space = base.ReedsSheppStateSpace(RADIUS)
    start, end = space.allocState(), space.allocState()
    expected = []
    ends = goals(10_000)
    for state, pose in [(start, (0.0, 0.0, 0.0)), *((end, pose) for pose in ends)]:
        state.setX(float(pose[0]))
        state.setY(float(pose[1]))
        state.setYaw(float(pose[2]))
        expected.append(space.distance(start, state))
    np.testing.assert_allclose(lengths_m(ends, RADIUS), expected[1:], atol=ROUNDING)


def test_sampled_path_ends_at_goal_with_its_length():
    start, ends = Pose2(0.3, -0.2, 1.0), goals(200)
    for end, length in zip(ends, lengths_m(ends, RADIUS), strict=True):
        goal = start @ Pose2(*map(float, end))
        segments = shortest_segments(start, goal, RADIUS)
        path = sampled(start, segments)
        np.testing.assert_allclose(
            Pose2(*path.poses[-1]).inverse() @ goal, np.zeros(3), atol=ROUNDING
        )
        assert np.abs(segments[:, 0]).sum() == pytest.approx(length)
        assert np.abs(path.curvatures).max() <= 1.0 / RADIUS + ROUNDING
        assert path.length_m <= length + ROUNDING  # chords


def test_each_word_leads_to_goal():
    sizes, sides = np.empty(LONGEST_WORD), np.empty(LONGEST_WORD)
    numbers = set()
    for end in goals(300) * (3.0, 3.0, 1.0):
        for number in range(WORDS):
            count = word(number, *end, sizes, sides)
            if count:
                numbers.add(number)
                path = sampled(
                    Pose2(0.0, 0.0, 0.0), np.column_stack((sizes, sides))[:count], spacing_m=9.0
                )
                found = Pose2(*path.poses[-1])
                np.testing.assert_allclose(
                    found.inverse() @ Pose2(*end), np.zeros(3), atol=ROUNDING
                )
    assert len(numbers) == 44  # L+R-L+ and L+R-L- share a number: 48 words


def test_length_is_the_same_there_and_back_and_mirrored():
    ends = goals(500)
    back = np.array([Pose2(*end).inverse() for end in ends])
    lengths = lengths_m(ends, RADIUS)
    np.testing.assert_allclose(lengths_m(back, RADIUS), lengths, atol=ROUNDING)
    np.testing.assert_allclose(lengths_m(ends * (1, -1, -1), RADIUS), lengths, atol=ROUNDING)
    np.testing.assert_allclose(lengths_m(ends * (-1, 1, -1), RADIUS), lengths, atol=ROUNDING)


def test_length_is_at_least_the_distance_and_the_turn():
    ends = goals(500)
    lengths = lengths_m(ends, RADIUS)
    assert (lengths >= np.hypot(ends[:, 0], ends[:, 1]) - ROUNDING).all()
    assert (lengths >= RADIUS * np.abs(ends[:, 2]) - ROUNDING).all()


def test_length_of_one_line_and_one_arc():
    ends = np.array([[1.0, 0.0, 0.0], [-0.4, 0.0, 0.0], [RADIUS, RADIUS, 0.5 * math.pi]])
    np.testing.assert_allclose(
        lengths_m(ends, RADIUS), (1.0, 0.4, RADIUS * 0.5 * math.pi), atol=ROUNDING
    )
