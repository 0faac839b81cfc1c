"""Calibrating on exact corners with known noise: the lens, its honesty, refusals, blunders."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from scm.errors import EyeError
from scm.eye.calibrate.assessment import assess
from scm.eye.calibrate.board import View, chessboard_corners
from scm.eye.calibrate.solve import Lens, solve
from scm.eye.calibrate.summary import report
from scm.scenery.board import Board

SIZE = (1280, 720)
EVERY = np.ones(9, dtype=bool)
PINHOLE = Lens("pinhole", np.array([1150, 1155, 643, 357, -0.12, 0.03, 4e-4, -3e-4, 0.01]), EVERY)
FISHEYE = Lens(
    "fisheye", np.array([420, 421, 645, 352, -0.03, 0.01, -0.004, 5e-4, 0]), np.arange(9) < 8
)
NARROW = Lens("pinhole", np.array([3156.7, 3129.5, 643, 357, 0, 0, 0, 0, 0]), EVERY)
FLAT = chessboard_corners(Board("chessboard", 10, 7, 0.025))
POINTS = np.column_stack((FLAT, np.zeros(len(FLAT))))


def views_through(lens, count, seed, tilt=0.6, fill=(0.25, 0.6), place=(0.15, 0.85), noise=0.1):
    """Views of boards anywhere in the frame, each leaning by up to `tilt` to some side."""
    rng, views = np.random.default_rng(seed), []
    while len(views) < count:
        pixel = rng.uniform(place[0], place[1], 2) * SIZE
        far = lens.values[0] * np.ptp(FLAT[:, 0]) / (rng.uniform(*fill) * SIZE[0])
        side, lean = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, tilt)
        turn = cv2.Rodrigues(lean * np.array([np.cos(side), np.sin(side), 0.0]))[0]
        turn = turn @ cv2.Rodrigues(np.array([0.0, 0.0, rng.uniform(-0.5, 0.5)]))[0]
        ray = np.append((pixel - lens.values[2:4]) / lens.values[:2], 1.0)
        if lens.kind == "fisheye":
            angle = np.hypot(*ray[:2])
            ray[:2] *= np.tan(min(angle, 1.2)) / angle
            ray /= np.linalg.norm(ray)
        shift = ray * far - turn @ POINTS.mean(axis=0)
        seen = lens.see(POINTS, np.concatenate((cv2.Rodrigues(turn)[0].ravel(), shift)))[0]
        ahead = (POINTS @ turn.T + shift)[:, 2].min() > 0.02
        if ahead and (seen >= 0).all() and (seen <= np.array(SIZE) - 1).all():
            noisy = seen + rng.normal(0.0, noise, seen.shape)
            views.append(View(f"view {len(views)}", POINTS, noisy))
    return views


@pytest.mark.parametrize("truth", [PINHOLE, FISHEYE], ids=lambda lens: lens.kind)
def test_the_jacobians_are_the_changes_of_the_pixels(truth):
    pose = np.array([0.3, 0.2, 0.1, -0.1, -0.05, 0.4])
    _, by_lens, by_pose = truth.see(POINTS, pose)
    for i, step in enumerate(np.diag(np.maximum(np.abs(truth.values), 1.0) * 1e-5)):
        up, down = (
            replace(truth, values=truth.values + s).see(POINTS, pose)[0] for s in (step, -step)
        )
        np.testing.assert_allclose(by_lens[:, i], (up - down).ravel() / 2 / step[i], atol=1e-2)
    for i, step in enumerate(np.eye(6) * 1e-6):
        up, down = (truth.see(POINTS, pose + s)[0] for s in (step, -step))
        np.testing.assert_allclose(by_pose[:, i], (up - down).ravel() / 2e-6, atol=1e-2)


@pytest.mark.parametrize("truth", [PINHOLE, FISHEYE], ids=lambda lens: lens.kind)
def test_the_stated_covariance_is_honest_over_many_sets(truth):
    normalised = []
    for seed in range(20):
        solution = solve(views_through(truth, 12, seed), SIZE, truth.kind == "fisheye")
        free = solution.lens.free
        off = (solution.lens.values - truth.values)[free]
        normalised.append(off @ np.linalg.solve(solution.covariance[np.ix_(free, free)], off))
        assert solution.corner_std_px == pytest.approx(0.1, rel=0.15)
    # the sum of 20 of them is chi-square with 20 * free degrees: its 99.9 % band
    degrees = 20 * truth.free.sum()
    spread = 3.3 * np.sqrt(2 * degrees)
    assert degrees - spread < np.sum(normalised) < degrees + spread


@pytest.mark.parametrize("truth", [PINHOLE, FISHEYE], ids=lambda lens: lens.kind)
def test_exact_corners_give_the_lens_exactly(truth):
    solution = solve(views_through(truth, 12, 0, noise=0.0), SIZE, truth.kind == "fisheye")
    np.testing.assert_allclose(solution.lens.values, truth.values, atol=1e-3)
    assert solution.rms_px < 1e-5


@pytest.mark.parametrize("truth", [PINHOLE, FISHEYE], ids=lambda lens: lens.kind)
def test_a_healthy_set_is_accepted(truth):
    views = views_through(truth, 12, 0, place=(0.05, 0.95), fill=(0.15, 0.6))
    assessment = assess(solve(views, SIZE, truth.kind == "fisheye"))
    assert assessment.refused == ()
    assert assessment.ray_std_px.max() < 1.0


@pytest.mark.parametrize(
    ("truth", "tilt"), [(PINHOLE, 0.02), (PINHOLE, 0.09), (NARROW, 0.1), (FISHEYE, 0.02)]
)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_boards_parallel_to_the_picture_are_refused_for_focus_and_distance(truth, tilt, seed):
    views = views_through(truth, 12, seed, tilt=tilt, fill=(0.3, 0.35))
    solution = solve(views, SIZE, truth.kind == "fisheye")
    assessment = assess(solution)
    assert "focal length and distance cannot be separated" in assessment.refused[0]
    assert "parallel to the picture" in assessment.refused[0]
    assert solution.depth_correlation > 0.99
    assert any("by 35 deg" in shot for shot in assessment.shots)


def test_a_refused_set_with_the_leaning_boards_added_is_accepted():
    flat = views_through(PINHOLE, 12, 0, tilt=0.02)
    more = [replace(view, name=f"more {view.name}") for view in views_through(PINHOLE, 8, 1)]
    assert assess(solve(flat, SIZE)).refused
    assert assess(solve([*flat, *more], SIZE)).refused == ()


def test_points_in_one_corner_are_refused_for_the_rest_of_the_frame():
    views = views_through(PINHOLE, 12, 0, fill=(0.2, 0.25), place=(0.15, 0.3))
    assessment = assess(solve(views, SIZE))
    assert any("of the frame (at least" in one for one in assessment.refused)
    assert any("lower right is known to" in one for one in assessment.refused)
    assert (assessment.cover[3:] == 0).all()


def test_too_few_views_are_refused_by_their_number():
    assessment = assess(solve(views_through(PINHOLE, 4, 0), SIZE))
    assert assessment.refused[0] == "too few views: expected at least 5, got 4"
    assert assessment.shots


def test_a_wide_lens_taken_for_a_pinhole_is_refused():
    wide = views_through(FISHEYE, 12, 0)
    assert any("--fisheye" in one for one in assess(solve(wide, SIZE, fisheye=False)).refused)


def test_points_and_a_view_that_are_far_off_are_taken_out_and_said():
    views = views_through(PINHOLE, 14, 3)
    pixels = views[2].pixels.copy()
    pixels[[5, 9]] += (6.0, -4.0)
    views[2] = replace(views[2], pixels=pixels)
    bent = views[7].points[:, 0] ** 2 * 900.0
    views[7] = replace(views[7], pixels=views[7].pixels + np.column_stack((bent, -bent)))
    solution = solve(views, SIZE)
    assert any(one.startswith("view 2: 2 points removed") for one in solution.remarks)
    assert any(one.startswith("view 7: the whole view is an outlier") for one in solution.remarks)
    assert len(solution.views) == 13
    off = np.abs(solution.lens.values - PINHOLE.values) / np.sqrt(np.diag(solution.covariance))
    assert off.max() < 4.0


def test_sets_of_two_different_lenses_are_refused():
    mixed = [*views_through(PINHOLE, 6, 0), *views_through(NARROW, 6, 1)]
    with pytest.raises(EyeError, match="do not fit one lens"):
        solve(mixed, SIZE)


def test_a_term_that_the_views_cannot_tell_is_left_out_and_said():
    solution = solve(views_through(NARROW, 12, 0), SIZE)
    assert solution.lens.values[8] == 0.0
    assert "distortion k3 left out" in solution.remarks[0]
    assert assess(solution).refused == ()


def test_the_report_says_numbers_doubt_and_map():
    solution = solve(views_through(PINHOLE, 12, 1), SIZE)
    text = report(solution, assess(solution))
    assert f"fx {solution.lens.values[0]:10.2f} +-" in text
    assert "points seen" in text
    assert "from 12 views with 648 points" in text
