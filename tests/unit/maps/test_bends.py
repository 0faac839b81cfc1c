"""Lanes that bend more tightly than a car can turn."""

import math

import pytest

from scm.maps.bends import bends_too_tight, misfit
from scm.maps.load import load_map
from scm.records.city_map import Lane, Segment


class Road:
    """A map of one lane: straight, a bend, straight."""

    def __init__(self, radius, *angles, width=0.4):
        bend = tuple(Segment(radius_m=radius, angle_rad=angle) for angle in angles)
        straight = Segment(length_m=1.0)
        self.lanes = (
            Lane(
                name="bend",
                width_m=width,
                start=(0.0, 0.0, 0.0),
                segments=(straight, *bend, straight),
                speed_limit_mps=0.3,
            ),
        )


@pytest.mark.parametrize(
    ("radius", "angles", "fits"),
    [
        (0.5, (math.pi / 2,), True),  # cuts it 4 cm inside the lane's own line, and has 10 cm
        (0.5, (math.pi,), False),
        (0.5, (-math.pi,), False),
        (0.5, (math.pi / 2, math.pi / 2), False),  # one bend, in two arcs
        (0.5, (math.pi / 2, -math.pi / 2), True),
        (0.3, (math.pi / 2,), False),
        (0.6, (math.pi,), True),
    ],
)
def test_a_short_bend_can_be_cut_and_a_long_one_cannot(radius, angles, fits):
    found = bends_too_tight(Road(radius, *angles), radius_m=0.6, width_m=0.2)
    assert (not found) == fits
    assert all(bend.radius_m == pytest.approx(radius) for bend in found)


def test_how_far_a_car_leaves_a_bend_of_ninety_degrees():
    (bend,) = bends_too_tight(Road(0.3, math.pi / 2), radius_m=0.6, width_m=0.2)
    assert bend.outside_m == pytest.approx(0.3 * (math.sqrt(2.0) - 1.0) - 0.1)


def test_it_is_said_with_numbers():
    said = misfit(Road(0.3, math.pi / 2), 0.6, 0.2)
    assert said == (
        "it turns on a radius of 0.60 m at best: lane bend bends at 0.30 m, "
        "so it would leave it by 2 cm"
    )
    assert "0.50 m wide, wider than 1 lane" in misfit(Road(0.3, math.pi / 2), 0.6, 0.5)
    assert misfit(Road(0.6, math.pi), 0.6, 0.2) == ""


def test_the_shipped_cars_on_the_shipped_school():
    school = load_map("driving_school")
    assert misfit(school, 0.245, 0.175) == "", "a Nigel drives here"
    said = misfit(school, 0.561, 0.27)
    assert "0.27 m wide, wider than 4 lanes" in said
    assert "lane east_loop bends at 0.51 m" in said
