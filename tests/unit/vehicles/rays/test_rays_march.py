"""Each beam of a moving scanner looks from its own place, at its own time."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from scm.vehicles.rays.cast import cast
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.march import march, past_poses
from scm.vehicles.rays.scene import Scene
from tests.unit.vehicles.rays.scenes import CIRCLE, brute_force, clutter, eyes_of

AGO = np.linspace(0.3, 0.0, 7)


@pytest.mark.parametrize("farthest", [1.0, 12.0])
@pytest.mark.parametrize("seed", range(3))
def test_at_rest_it_sees_what_a_still_scan_sees(seed, farthest):
    scene, scanners = clutter(seed)
    own, still = np.arange(60), np.zeros((60, 3))
    got = march(scene, scanners, still, own, CIRCLE, farthest, 1.0)
    assert_allclose(got, cast(scene, scanners, own, CIRCLE, farthest), rtol=0.0, atol=1e-9)


def test_in_motion_it_equals_brute_force_from_each_beams_own_place():
    scene, scanners = clutter(8)
    rng = np.random.default_rng(1)
    own, motion = np.arange(20), rng.normal(0.0, 1.0, (20, 3))
    got = march(scene, scanners[:20], motion, own, CIRCLE, 6.0, 0.2)
    first, step, beams = CIRCLE
    eyes = eyes_of(scanners[:20], CIRCLE)
    past = past_poses(scanners[:20], motion, (beams - 1 - np.arange(beams)) * 0.2 / beams)
    eyes = past + (0.0, 0.0, 1.0) * (first + step * np.arange(beams))[None, :, None]
    expected = brute_force(scene, eyes, own, 6.0)
    assert_array_equal(np.isinf(got), np.isinf(expected))
    assert_allclose(got, expected, rtol=0.0, atol=1e-9)


def test_driving_at_a_wall_the_first_beam_saw_it_farther_off_than_the_last():
    wall = Scene(
        WallGrid(np.array([[3.0, -9.0, 3.0, 9.0]])), np.zeros((0, 4)), np.zeros(0, np.int64)
    )
    motion = np.array([[2.0, 0.0, 0.0]])
    ranges = march(wall, np.zeros((1, 3)), motion, np.array([0]), CIRCLE, 12.0, 0.36)[0]
    assert ranges[0] == pytest.approx(3.0 + 2.0 * 0.359)
    assert ranges[359] * np.cos(np.radians(1.0)) == pytest.approx(3.0)


def test_the_past_of_a_steady_turn_is_on_its_circle():
    back = past_poses(np.array([[1.0, 2.0, 0.5]]), np.array([[0.6, 0.0, 1.2]]), AGO)[0]
    centre = np.array([1.0, 2.0]) + 0.5 * np.array([-np.sin(0.5), np.cos(0.5)])
    assert_allclose(np.hypot(*(back[:, :2] - centre).T), 0.5)
    assert_allclose(back[:, 2], 0.5 - 1.2 * AGO)
    assert_allclose(back[-1], [1.0, 2.0, 0.5])


def test_without_turning_the_past_is_a_straight_line():
    back = past_poses(np.array([[0.0, 0.0, np.pi / 2]]), np.array([[1.0, 0.5, 0.0]]), AGO)[0]
    assert_allclose(back[:, 0], 0.5 * AGO, atol=1e-15)
    assert_allclose(back[:, 1], -AGO)
