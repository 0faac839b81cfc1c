"""Pictures of the manual: honest axes, the same text for the same numbers."""

import re

import numpy as np

from scm.vehicles.car import load_car
from scm.vehicles.manual.line_svg import Line, draw_lines
from scm.vehicles.manual.picture import draw_term
from scm.vehicles.manual.shown import shown_of
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term

X = np.linspace(0.0, 2.0, 50)


def ticks(picture):
    return [float(text) for text in re.findall(r">(-?[\d.]+(?:e-?\d+)?)</text>", picture)]


def test_ticks_are_round_and_cover_the_curve():
    picture = draw_lines([Line("a", X, X**2)], "x", "y")
    assert {0.0, 0.5, 1.0, 1.5, 2.0} <= set(ticks(picture))
    assert max(ticks(picture)) == 4.0


def test_a_flat_line_has_room_around_it():
    picture = draw_lines([Line("rest", X, 0.0 * X)], "x", "y")
    assert "nan" not in picture
    assert 'stroke="#8b93a1"' in picture


def test_on_a_floor_a_metre_is_as_long_both_ways():
    picture = draw_lines([Line("a", X, 0.1 * X)], "x", "y", equal_scale=True)
    points = re.search(r"M([\d.]+) ([\d.]+)L.*L([\d.]+) ([\d.]+)\" fill", picture)
    x0, y0, x1, y1 = map(float, points.groups())
    assert abs((y0 - y1) / (x1 - x0) - 0.1) < 0.01


def test_labels_are_escaped():
    assert "a &lt; b" in draw_lines([Line("a < b", X, X)], "x", "y")


def test_the_same_effect_is_drawn_the_same_every_time():
    drag = next(term for term in load_car("f1tenth").terms if term.name == "yaw_drag")
    assert draw_term(drag) == draw_term(drag)


def drag_of_mine(vx: float, size: float) -> float:
    return -size * vx


def test_an_effect_that_nobody_chose_a_picture_for_is_shown_far_out_in_its_prior():
    size = Param("size", 0.0, "N", "mine.size_n", (0.0, 3.0), "how much", LogNormal(1.0, 1.0))
    term = Term(drag_of_mine, Per.BODY, adds="force_x", neutral={"size": 0.0}, params=(size,))
    assert shown_of(term).numbers == {"mine.size_n": 3.0}
    assert shown_of(term).see == "speed"
