"""Sorted and cut short, the scan is that of every beam against every face."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from scm.vehicles.rays.cast import cast
from scm.vehicles.rays.grid import WallGrid, cell_size
from scm.vehicles.rays.scene import Scene
from tests.unit.vehicles.rays.scenes import CIRCLE, boxes, brute_force, clutter, eyes_of

NARROW = (-0.75 * np.pi, 1.5 * np.pi / 1080, 1080)
FEW = (0.2, 2.0 * np.pi / 100, 7)
NOBODY = np.zeros(0, np.int64)


def check(scene, scanners, own, bearings, farthest):
    got = cast(scene, scanners, own, bearings, farthest)
    expected = brute_force(scene, eyes_of(scanners, bearings), own, farthest)
    assert_array_equal(np.isinf(got), np.isinf(expected))
    assert_allclose(got, expected, rtol=0.0, atol=1e-9)
    assert np.isfinite(got).any()


@pytest.mark.parametrize("farthest", [0.7, 4.0, 12.0, 40.0])
@pytest.mark.parametrize("bearings", [CIRCLE, NARROW, FEW], ids=["circle", "narrow", "few"])
@pytest.mark.parametrize("seed", range(3))
def test_it_equals_brute_force(seed, bearings, farthest):
    scene, scanners = clutter(seed)
    check(scene, scanners[:20], np.arange(20), bearings, farthest)


def test_it_equals_brute_force_in_a_sparse_city_with_long_walls():
    rng = np.random.default_rng(7)
    edges = rng.uniform(-40.0, 40.0, (30, 4))
    places, yaw = rng.uniform(-40.0, 40.0, (100, 2)), rng.uniform(-4.0, 4.0, 100)
    scene = Scene(WallGrid(edges), boxes(places, yaw), np.arange(100))
    check(scene, np.column_stack((places, yaw)), np.arange(100), CIRCLE, 12.0)


def test_a_scanner_within_another_car_sees_it_from_inside():
    scene, scanners = clutter(3, cars=40, walls=5, size=0.5)
    check(scene, scanners, np.arange(40), CIRCLE, 4.0)


def test_a_scanner_on_a_border_of_cells_sees_all():
    size = cell_size(4.0)
    scene, _ = clutter(4)
    scanners = np.array([[i * size, j * size, 0.3] for i in (-2, 0, 3) for j in (-1, 0, 2)])
    check(scene, scanners, np.full(9, -1), CIRCLE, 4.0)


def test_walls_along_borders_of_cells_are_seen_from_both_sides():
    size = cell_size(4.0)
    edges = np.array([[-3.0, size, 3.0, size], [2 * size, -3.0, 2 * size, 3.0]])
    scene = Scene(WallGrid(edges), np.zeros((0, 4)), NOBODY)
    scanners = np.array([[x, y, 0.1] for x in (0.1, 2.7 * size) for y in (0.2, 1.6 * size)])
    check(scene, scanners, np.full(4, -1), CIRCLE, 4.0)


def test_each_scanner_sees_the_same_alone_and_in_company():
    scene, scanners = clutter(5)
    together = cast(scene, scanners, np.arange(60), CIRCLE, 12.0)
    alone = cast(scene, scanners[41:42], np.array([41]), CIRCLE, 12.0)
    assert_array_equal(alone[0], together[41])


def test_a_car_far_outside_all_walls_is_seen_and_sees():
    places = np.array([[500.0, 500.0], [502.0, 500.0]])
    scene = Scene(
        WallGrid(np.array([[0.0, 0.0, 1.0, 0.0]])), boxes(places, np.zeros(2)), np.arange(2)
    )
    scanners = np.column_stack((places, np.zeros(2)))
    assert cast(scene, scanners, np.arange(2), CIRCLE, 4.0)[0, 0] == pytest.approx(1.93)


def test_cars_scattered_over_any_distance_cost_no_more_memory_than_near_ones():
    places = np.array([[0.0, 0.0], [2.0, 0.0], [1e9, -1e9]])
    scene = Scene(WallGrid(np.zeros((0, 4))), boxes(places, np.zeros(3)), np.arange(3))
    scanners = np.column_stack((places, np.zeros(3)))
    ranges = cast(scene, scanners, np.arange(3), CIRCLE, 12.0)
    assert ranges[0, 0] == pytest.approx(1.93)
    assert np.isinf(ranges[2]).all()


def test_a_wall_that_runs_over_all_the_earth_is_seen():
    scene = Scene(WallGrid(np.array([[-1e6, 2.0, 1e6, 2.0]])), np.zeros((0, 4)), NOBODY)
    assert cast(scene, np.zeros((1, 3)), np.array([0]), CIRCLE, 12.0)[0, 90] == pytest.approx(2.0)


def test_a_scanner_whose_place_is_no_number_sees_nothing_and_harms_nobody():
    scene, scanners = clutter(6)
    scanners[3, 0] = np.nan
    ranges = cast(scene, scanners, np.arange(60), CIRCLE, 4.0)
    assert np.isinf(ranges[3]).all()
    assert np.isfinite(ranges[4]).any()
