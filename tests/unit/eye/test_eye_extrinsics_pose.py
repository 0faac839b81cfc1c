"""Where the camera is, and where cars are, from exact and from shifted corners."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scm.eye.camera import camera_model
from scm.eye.extrinsics import ExtrinsicsEstimator, Tolerance
from scm.eye.pose import car_pose, car_poses
from scm.eye.render.car import tag_on_roof
from scm.maps.load import load_map
from scm.scenery.bodies import NIGEL
from scm.scenery.tags import tag_corners
from scm.v2x.messages.world_snapshot import SnapshotVehicle

CITY = load_map("driving_school")
TRUE = camera_model(CITY.cameras[0])
FLOOR_TAG = np.column_stack((tag_corners(CITY.tag.size_m), np.zeros(4)))


def car(x, y, yaw, **more):
    return SnapshotVehicle(
        vehicle="n1", kind="hosted", car="nigel", tag_id=1, x_m=x, y_m=y, yaw_rad=yaw,
        speed_mps=0.0, steering_rad=0.0, **more,
    )  # fmt: skip


@given(st.floats(0.0, 2.7), st.floats(0.0, 1.3), st.floats(-math.pi, math.pi))
def test_exact_corners_give_the_exact_pose(x, y, yaw):
    corners = TRUE.project(tag_on_roof(car(x, y, yaw)))
    pose = car_pose(ExtrinsicsEstimator(TRUE, CITY.tag), NIGEL, corners).pose
    assert (pose.x, pose.y) == pytest.approx((x, y), abs=1e-7)
    assert math.remainder(pose.yaw - yaw, math.tau) == pytest.approx(0.0, abs=1e-6)


def test_a_covariance_is_symmetric_and_positive():
    corners = TRUE.project(tag_on_roof(car(0.4, 1.0, 2.0)))
    covariance = car_pose(ExtrinsicsEstimator(TRUE, CITY.tag), NIGEL, corners).covariance
    np.testing.assert_array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() > 0.0


def test_a_map_tag_makes_the_camera_less_doubtful():
    estimator = ExtrinsicsEstimator(TRUE, CITY.tag)
    before = estimator.covariance.copy()
    estimator.see(TRUE.project(FLOOR_TAG), 0)
    assert np.linalg.eigvalsh(before - estimator.covariance).min() > -1e-15
    assert estimator.covariance[0, 0] < 0.5 * before[0, 0]


def test_exact_corners_of_the_map_tag_leave_a_right_calibration_alone():
    estimator = ExtrinsicsEstimator(TRUE, CITY.tag)
    estimator.see(TRUE.project(FLOOR_TAG), 0)
    np.testing.assert_allclose(estimator.model.extrinsics, TRUE.extrinsics, atol=1e-9)


def test_a_shifted_calibration_is_put_right_at_the_map_tag():
    off = np.array([0.006, -0.005, 0.0, 0.0, 0.0, 0.0])
    estimator = ExtrinsicsEstimator(TRUE.moved_to(TRUE.extrinsics + off), CITY.tag)
    estimator.see(TRUE.project(FLOOR_TAG), 0)
    misfit = np.abs(estimator.model.project(FLOOR_TAG) - TRUE.project(FLOOR_TAG)).max()
    assert misfit < 0.1


def test_a_lost_map_tag_keeps_the_last_correction_and_grows_old():
    estimator = ExtrinsicsEstimator(
        TRUE.moved_to(TRUE.extrinsics + np.array([0.005, 0, 0, 0, 0, 0])), CITY.tag
    )
    estimator.see(TRUE.project(FLOOR_TAG), 1_000_000)
    corrected = estimator.model
    estimator.see(None, 251_000_000)
    assert estimator.model is corrected
    assert estimator.age_ms(251_000_000) == 250.0


def test_a_map_tag_never_seen_ages_from_the_first_frame():
    estimator = ExtrinsicsEstimator(TRUE, CITY.tag)
    estimator.see(None, 1_000_000_000)
    estimator.see(None, 3_000_000_000)
    assert estimator.age_ms(3_000_000_000) == 2000.0


def test_a_knocked_camera_is_believed_and_logged(caplog):
    knocked = TRUE.moved_to(TRUE.extrinsics + np.array([0.05, -0.04, 0.0, 0.01, 0.0, 0.0]))
    estimator = ExtrinsicsEstimator(TRUE, CITY.tag)
    for tick in range(3):
        estimator.see(TRUE.project(FLOOR_TAG), tick)
    with caplog.at_level("INFO"):
        estimator.see(knocked.project(FLOOR_TAG), 3)
    assert np.hypot(*(estimator.model.position - knocked.position)[:2]) < 0.03
    assert estimator.covariance[0, 0] > Tolerance().position_m ** 2
    assert "eye_camera_moved" in caplog.text


def test_badly_found_corners_are_not_taken_for_a_knock(caplog):
    estimator = ExtrinsicsEstimator(TRUE, CITY.tag)
    blurred = 0.5 * np.random.default_rng(1).standard_normal((4, 2))
    with caplog.at_level("INFO"):
        estimator.see(TRUE.project(FLOOR_TAG) + blurred, 0)
    assert caplog.text == ""


def test_noise_of_a_still_tag_is_averaged_away():
    rng = np.random.default_rng(0)
    estimator = ExtrinsicsEstimator(TRUE, CITY.tag)
    places = []
    for tick in range(60):
        estimator.see(TRUE.project(FLOOR_TAG) + 0.05 * rng.standard_normal((4, 2)), tick)
        places.append(estimator.model.position[:2])
    assert np.std(places[40:], axis=0).max() < 0.5 * np.std(places[:5], axis=0).max()


def test_a_corner_far_off_the_square_is_left_out():
    corners = TRUE.project(tag_on_roof(car(1.0, 0.5, 0.4)))
    corners[2] += (3.0, -2.0)
    found = car_pose(ExtrinsicsEstimator(TRUE, CITY.tag), NIGEL, corners)
    assert (found.pose.x, found.pose.y) == pytest.approx((1.0, 0.5), abs=1e-6)
    assert found.misfit < 0.1


def test_a_spoiled_corner_among_noisy_ones_is_left_out_too():
    rng, estimator = np.random.default_rng(5), ExtrinsicsEstimator(TRUE, CITY.tag)
    for spoiled in range(4):
        corners = TRUE.project(tag_on_roof(car(1.0, 0.5, 0.4)))
        corners += 0.02 * rng.standard_normal((4, 2))
        corners[spoiled] += (1.5, -1.0)
        found = car_pose(estimator, NIGEL, corners)
        assert (found.pose.x, found.pose.y) == pytest.approx((1.0, 0.5), abs=2e-4)
        assert found.misfit < 2.0


@pytest.mark.parametrize("scale", [0.6, 0.95, 0.98, 1.02, 1.05, 1.5])
def test_a_print_of_another_size_gives_the_pose_and_the_size_that_would_fit(scale):
    exact = TRUE.project(tag_on_roof(car(0.8, 0.5, 0.4)))
    found = car_pose(
        ExtrinsicsEstimator(TRUE, CITY.tag),
        NIGEL,
        TRUE.project(tag_on_roof(car(0.8, 0.5, 0.4), scale)),
    )
    right = car_pose(ExtrinsicsEstimator(TRUE, CITY.tag), NIGEL, exact)
    assert not found.is_refused
    assert found.size_ratio == pytest.approx(scale, abs=1e-4)
    assert found.is_other_size == (abs(scale - 1.0) > 0.025)
    assert tuple(found.pose) == pytest.approx(tuple(right.pose), abs=1e-6)


def test_a_roof_that_may_be_higher_instead_widens_the_covariance_away_from_the_camera():
    tag = tag_on_roof(car(0.2, 0.2, 0.4), 1.05)
    found = car_pose(ExtrinsicsEstimator(TRUE, CITY.tag), NIGEL, TRUE.project(tag))
    at = tag.mean(axis=0)
    by_height = np.hypot(*(TRUE.position - at)[:2]) * (1.0 - 1.0 / 1.05)
    deviation = math.sqrt(np.linalg.eigvalsh(found.shared[:2, :2])[-1])
    assert deviation == pytest.approx(by_height / 2.0, rel=0.05)


def test_a_misfit_widens_the_covariance_and_corners_that_are_no_square_are_refused():
    exact = TRUE.project(tag_on_roof(car(1.0, 0.5, 0.4)))
    middle = exact.mean(axis=0)
    estimator = ExtrinsicsEstimator(TRUE, CITY.tag)
    good, large = (
        car_pose(estimator, NIGEL, middle + scale * (exact - middle)) for scale in (1.0, 1.02)
    )
    assert large.covariance[2, 2] - large.shared[2, 2] > 4.0 * (
        good.covariance[2, 2] - good.shared[2, 2]
    )
    oblong = car_pose(estimator, NIGEL, middle + (1.2, 0.9) * (exact - middle))
    assert (good.is_refused, large.is_refused, oblong.is_refused) == (False, False, True)


def test_cars_solved_together_are_those_solved_one_by_one():
    corners = np.array([TRUE.project(tag_on_roof(car(x, 0.5, x))) for x in (0.4, 1.4, 2.4)])
    estimator = ExtrinsicsEstimator(TRUE, CITY.tag)
    for one, found in zip(corners, car_poses(estimator, [NIGEL] * 3, corners), strict=True):
        alone = car_pose(estimator, NIGEL, one)
        assert found.pose == pytest.approx(alone.pose)
        np.testing.assert_allclose(found.covariance, alone.covariance)
