"""The lens: signs, distortion against OpenCV, and cameras that cannot be."""

import math

import cv2
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scm.errors import EyeError
from scm.eye.camera import camera_model
from scm.maps.load import load_map
from scm.records.city_map import Camera

PLAIN = Camera(
    name="top", x_m=1.4, y_m=0.65, z_m=2.8, width_px=1280, height_px=720,
    fx_px=1150.0, fy_px=1160.0, cx_px=640.0, cy_px=360.0,
)  # fmt: skip
REAL = msgspec.structs.replace(
    PLAIN,
    yaw_rad=0.3,
    tilt_x_rad=0.05,
    tilt_y_rad=-0.04,
    distortion=(-0.2, 0.05, 1e-3, -2e-3, 0.01),
)


def test_a_level_camera_sees_map_x_to_the_right_and_map_y_to_the_top():
    pixels = camera_model(PLAIN).project(
        np.array([[1.4, 0.65, 0.0], [1.5, 0.65, 0.0], [1.4, 0.75, 0]])
    )
    scale = 0.1 / 2.8
    expected = [[640.0, 360.0], [640.0 + 1150.0 * scale, 360.0], [640.0, 360.0 - 1160.0 * scale]]
    np.testing.assert_allclose(pixels, expected, atol=1e-9)


def test_yaw_turns_the_pictures_right_edge_over_the_floor():
    turned = camera_model(msgspec.structs.replace(PLAIN, yaw_rad=math.pi / 2))
    pixel = turned.project(np.array([1.4, 0.75, 0.0]))
    np.testing.assert_allclose(pixel, [640.0 + 1150.0 * 0.1 / 2.8, 360.0], atol=1e-9)


def test_a_tilt_about_the_pictures_x_looks_towards_its_top():
    tilted = camera_model(msgspec.structs.replace(PLAIN, tilt_x_rad=0.05))
    middle = tilted.on_plane(np.zeros((1, 2)), 0.0)[0]
    np.testing.assert_allclose(middle, [1.4, 0.65 + 2.8 * math.tan(0.05)], atol=1e-9)


def test_height_moves_a_point_away_from_the_foot_of_the_camera():
    low, high = camera_model(PLAIN).project(np.array([[2.4, 0.65, 0.0], [2.4, 0.65, 0.129]]))
    assert high[0] - low[0] == pytest.approx(1150.0 * (1.0 / (2.8 - 0.129) - 1.0 / 2.8))


def test_projection_equals_opencvs():
    model = camera_model(REAL)
    points = np.random.default_rng(0).uniform((0, 0, 0), (2.8, 1.3, 0.2), (50, 3))
    rotation, _ = cv2.Rodrigues(model.camera_T_map[:3, :3])
    shift = model.camera_T_map[:3, 3]
    theirs, _ = cv2.projectPoints(points, rotation, shift, model.matrix, model.distortion)
    np.testing.assert_allclose(model.project(points), theirs[:, 0], atol=1e-9)


@given(st.floats(0.0, 2.8), st.floats(0.0, 1.3), st.floats(0.0, 0.2))
def test_a_pixels_ray_meets_the_plane_where_the_point_was(x, y, z):
    model = camera_model(REAL)
    pixel = model.project(np.array([x, y, z]))
    np.testing.assert_allclose(model.on_plane(model.undistort(pixel), z), [x, y], atol=1e-8)


def test_moved_to_its_own_place_is_the_same_camera():
    model = camera_model(REAL)
    same = model.moved_to(model.extrinsics)
    assert same.camera == model.camera
    np.testing.assert_array_equal(same.camera_T_map, model.camera_T_map)


@pytest.mark.parametrize(
    ("key", "value"),
    [("fx_px", 0.0), ("z_m", -1.0), ("cx_px", 1300.0), ("tilt_y_rad", 1.2), ("rate_hz", 0.0),
     ("width_px", 3), ("noise_sigma", -1.0), ("fy_px", math.nan)],
)  # fmt: skip
def test_a_camera_that_cannot_be_is_refused_by_key(key, value):
    with pytest.raises(EyeError, match=f"'top'.*{key}: expected .*, got {value}"):
        camera_model(msgspec.structs.replace(PLAIN, **{key: value}))


def test_all_faults_of_a_camera_are_named_at_once():
    with pytest.raises(EyeError, match=r"fx_px.*z_m"):
        camera_model(msgspec.structs.replace(PLAIN, fx_px=-1.0, z_m=0.0))


def test_a_lens_whose_picture_folds_back_is_refused():
    with pytest.raises(EyeError, match=r"distortion: expected .* grows outwards .* folds back"):
        camera_model(msgspec.structs.replace(PLAIN, distortion=(-1.2, 0.0, 0.0, 0.0, 0.0)))


@pytest.mark.parametrize("name", ["Over Head", "", "pose", "a/b"])
def test_a_camera_whose_name_cannot_stand_in_a_key_is_refused(name):
    camera = msgspec.structs.replace(load_map("driving_school").cameras[0], name=name)
    with pytest.raises(EyeError, match=r"name: expected 1 to 32 of a-z 0-9 _ -, and not pose, got"):
        camera_model(camera)
