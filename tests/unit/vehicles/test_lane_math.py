"""The straight-line functions against the library's, over the whole range they state."""

import math

import numpy as np
import pytest

from scm.vehicles import lane_math

MANY = np.concatenate([[0.0, 1e-300, 1e-12, 1e-6], np.geomspace(1e-5, 1.0, 400)])


def worst(own, exact, points, relative):
    gaps = [
        abs(own(float(x)) - exact(float(x))) / (abs(exact(float(x))) or 1.0 if relative else 1.0)
        for x in points
    ]
    return max(gaps)


@pytest.mark.parametrize(
    ("name", "exact", "reach", "relative", "bound"),
    [
        ("exp_neg", lambda x: math.exp(-x), 50.0, False, 1e-15),
        ("expm1_neg", lambda x: math.expm1(-x), 50.0, True, 2e-14),
        ("tanh", math.tanh, 30.0, True, 2e-14),
        ("tan_small", math.tan, 1.2, True, 1e-14),
        ("atan_small", math.atan, 0.4142, False, 1e-15),
        ("atan", math.atan, 1e6, False, 1e-15),
        ("soft_sign", lambda x: x / math.hypot(1.0, x), 1e6, True, 1e-15),
    ],
)
def test_a_function_is_as_near_as_it_states(name, exact, reach, relative, bound):
    assert worst(getattr(lane_math, name), exact, reach * MANY, relative) < bound


def test_sine_and_cosine_are_near_at_any_angle():
    for x in (*(20.0 * MANY), *(-20.0 * MANY), *(k * math.pi / 4 for k in range(-40, 40)), 9e5):
        s, c = lane_math.sin_cos(float(x))
        assert abs(s - math.sin(x)) < 2e-15, x
        assert abs(c - math.cos(x)) < 2e-15, x


@pytest.mark.parametrize("name", ["tanh", "tan_small", "atan_small", "atan", "soft_sign"])
def test_odd_functions_are_odd_bit_for_bit_and_nothing_at_nothing(name):
    function = getattr(lane_math, name)
    assert function(0.0) == 0.0
    for x in (1e-9, 0.01, 0.3, 0.41):
        assert function(-x) == -function(x)


def test_saturating_functions_end_at_one():
    for function in (lane_math.tanh, lane_math.soft_sign):
        assert function(1e300) == pytest.approx(1.0, abs=1e-15)
        assert function(-math.inf) == pytest.approx(-1.0, abs=1e-15)
    assert lane_math.exp_neg(0.0) == 1.0
    assert lane_math.exp_neg(-3.0) == 1.0
    assert lane_math.exp_neg(1e300) == pytest.approx(0.0, abs=1e-15)
