"""Plausibilities and outlines."""

import math

import pytest
from numpy.testing import assert_allclose

from scm.traffic.misbehaviour.likely import LEAST, at_most, of_number, of_place, overlap_m

CAR = (0.0, 0.0, 0.0, 0.3, 0.175)


def test_within_the_tolerance_everything_is_ordinary():
    assert of_number(-0.1, 0.1, 0.01) == at_most(0.1, 0.1, 0.01) == of_place(0.1, 0.1, 0.01) == 1.0


def test_beyond_it_plausibility_is_the_tail_of_the_normal_distribution():
    assert_allclose(of_number(0.1 + 1.96 * 0.01, 0.1, 0.01), 0.05, rtol=1e-2)
    assert_allclose(at_most(0.1 + 2.576 * 0.01, 0.1, 0.01), 0.01, rtol=1e-2)


def test_a_place_has_the_tail_of_two_dimensions():
    assert_allclose(of_place(0.1 + 0.02, 0.1, 0.01), math.exp(-2.0))


def test_the_absurd_is_still_a_number_above_zero():
    assert LEAST <= of_number(1e9, 0.0, 1e-3) <= 1e-6
    assert LEAST <= of_place(1e9, 0.0, 1e-3) <= 1e-6


@pytest.mark.parametrize(
    ("other", "depth_m"),
    [
        ((0.0, 0.0, 0.0, 0.3, 0.175), 0.175),  # the least way out is sideways
        ((0.28, 0.0, 0.0, 0.3, 0.175), 0.02),
        ((0.0, 0.16, 0.0, 0.3, 0.175), 0.015),
        ((0.0, 0.16, math.pi, 0.3, 0.175), 0.015),
        ((0.31, 0.0, 0.0, 0.3, 0.175), 0.0),
        ((0.23, 0.0, math.pi / 2, 0.3, 0.175), 0.0075),
        ((0.25, 0.25, math.pi / 4, 0.3, 0.175), 0.0),  # corners near, outlines apart
    ],
)
def test_overlap_is_the_least_way_to_part_two_cars(other, depth_m):
    assert_allclose(overlap_m(CAR, other), depth_m, atol=1e-9)
    assert_allclose(overlap_m(other, CAR), depth_m, atol=1e-9)
