"""The fisheye lens: against OpenCV, there and back, wide rays, and lenses that cannot be."""

import math

import cv2
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scm.errors import EyeError
from scm.eye.camera import camera_model
from scm.records.city_map import Camera

WIDE = Camera(
    name="wide", x_m=1.4, y_m=0.65, z_m=2.0, yaw_rad=0.3, tilt_x_rad=0.2, tilt_y_rad=-0.1,
    width_px=1280, height_px=720, fx_px=560.0, fy_px=565.0, cx_px=645.0, cy_px=352.0,
    lens="fisheye", distortion=(-0.03, 0.01, -0.004, 0.0005, 0.0),
)  # fmt: skip
BENT = msgspec.structs.replace(
    WIDE, lens="pinhole", fx_px=900.0, fy_px=905.0, distortion=(-0.38, 0.16, 1e-3, -1e-3, -0.03)
)
coefficient = st.floats(-0.05, 0.05)


def frame_of(camera):
    return np.stack(np.meshgrid(np.linspace(0, camera.width_px - 1, 33),
                                np.linspace(0, camera.height_px - 1, 19)), axis=-1)  # fmt: skip


def seen_again(model, pixels):
    ideal = model.undistort(pixels)
    rays = np.concatenate((ideal, np.ones((*ideal.shape[:-1], 1))), axis=-1) @ model.camera_R_map
    return model.project(model.position + rays)


def test_projection_equals_opencvs():
    model = camera_model(WIDE)
    points = np.random.default_rng(0).uniform((0, 0, 0), (2.8, 1.3, 0.2), (50, 3))
    turn, _ = cv2.Rodrigues(model.camera_T_map[:3, :3])
    theirs, _ = cv2.fisheye.projectPoints(
        points[:, None], turn, model.camera_T_map[:3, 3], model.matrix, model.distortion[:4]
    )
    np.testing.assert_allclose(model.project(points), theirs[:, 0], atol=1e-9)


@pytest.mark.parametrize("camera", [WIDE, BENT], ids=["fisheye", "pinhole"])
def test_every_pixel_of_the_frame_comes_back(camera):
    pixels = frame_of(camera)
    np.testing.assert_allclose(seen_again(camera_model(camera), pixels), pixels, atol=1e-6)


@given(coefficient, coefficient, st.floats(-0.01, 0.01), st.floats(0.0, 0.002))
def test_any_fisheye_brings_every_pixel_back_that_looks_forward(k1, k2, k3, k4):
    camera = msgspec.structs.replace(WIDE, distortion=(k1, k2, k3, k4, 0.0))
    pixels = frame_of(camera)
    try:
        model = camera_model(camera)
    except EyeError:
        return
    there = seen_again(model, pixels)
    shown = np.isfinite(there).all(axis=-1)
    angles = np.linspace(0.0, np.pi / 2.0, 1000)
    reach = angles * (1.0 + sum(k * angles ** (2 * n + 2) for n, k in enumerate((k1, k2, k3, k4))))
    off = (pixels - (camera.cx_px, camera.cy_px)) / (camera.fx_px, camera.fy_px)
    assert shown[np.linalg.norm(off, axis=-1) < 0.999 * reach.max()].all()
    np.testing.assert_allclose(there[shown], pixels[shown], atol=1e-6)


def test_a_pixels_ray_meets_the_plane_where_the_point_was():
    model = camera_model(WIDE)
    points = np.random.default_rng(1).uniform((0, 0, 0.1), (2.8, 1.3, 0.1), (50, 3))
    met = model.on_plane(model.undistort(model.project(points)), 0.1)
    np.testing.assert_allclose(met, points[:, :2], atol=1e-9)


def test_the_axis_is_seen_at_the_principal_point():
    model = camera_model(WIDE)
    on_axis = model.position + model.camera_R_map[2]
    np.testing.assert_allclose(model.project(on_axis), [645.0, 352.0], atol=1e-9)
    np.testing.assert_allclose(model.undistort(np.array([645.0, 352.0])), [0.0, 0.0], atol=1e-12)


def test_a_ray_beyond_ninety_degrees_is_seen_but_has_no_place_in_a_pinholes_picture():
    camera = msgspec.structs.replace(WIDE, fx_px=380.0, fy_px=380.0, distortion=(0.0,) * 5)
    model = camera_model(camera)
    ray = np.array([math.sin(1.65), 0.0, math.cos(1.65)]) @ model.camera_R_map
    pixel = model.project(model.position + ray)
    np.testing.assert_allclose(pixel, [645.0 + 380.0 * 1.65, 352.0], atol=1e-9)
    assert np.isnan(model.undistort(pixel)).all()


@pytest.mark.parametrize("bent", [(-0.4, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, -0.1, 0.0)])
def test_a_fisheye_whose_picture_folds_back_within_the_frame_is_refused(bent):
    with pytest.raises(EyeError, match=r"distortion: expected .* grows outwards .* folds back"):
        camera_model(msgspec.structs.replace(WIDE, distortion=bent))


def test_a_fifth_coefficient_of_a_fisheye_is_refused():
    with pytest.raises(EyeError, match=r"distortion\[4\]: expected 0 for a fisheye, got 0.1"):
        camera_model(msgspec.structs.replace(WIDE, distortion=(0.0, 0.0, 0.0, 0.0, 0.1)))


def test_a_moved_camera_keeps_its_lens_and_its_doubt():
    model = camera_model(WIDE, np.eye(9))
    moved = model.moved_to(model.extrinsics + 0.01)
    assert moved.camera.lens == "fisheye"
    np.testing.assert_array_equal(moved.lens_covariance, np.eye(9))


def test_a_covariance_of_another_shape_is_refused():
    with pytest.raises(EyeError, match=r"lens_covariance: expected shape \(9, 9\), got \(4, 4\)"):
        camera_model(WIDE, np.eye(4))
