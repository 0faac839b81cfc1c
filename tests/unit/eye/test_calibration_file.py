"""A calibration as a file, and the camera that looks through it."""

import msgspec
import numpy as np
import pytest

from scm.errors import EyeError
from scm.eye.calibration import Calibration, calibrated
from scm.eye.calibration_files import load_calibration
from scm.eye.camera import camera_model
from scm.maps.load import load_map

NOISE = np.random.default_rng(0).normal(size=(9, 9))
LENS = Calibration(
    lens="pinhole", width_px=1280, height_px=720, fx_px=1151.25, fy_px=1150.0 / 3.0 + 700.0,
    cx_px=640.5, cy_px=361.0, distortion=(-0.1, 0.02, 1e-4, -2e-4, 0.01),
    covariance=tuple(map(tuple, (NOISE @ NOISE.T).tolist())), rms_px=0.12, views=14,
)  # fmt: skip


def test_a_file_comes_back_exactly(tmp_path):
    LENS.save(tmp_path / "lens.toml")
    assert load_calibration(tmp_path / "lens.toml") == LENS


def test_a_camera_takes_the_lens_and_keeps_its_place():
    camera = load_map("driving_school").cameras[0]
    model = camera_model(calibrated(camera, LENS), LENS.lens_covariance)
    assert model.camera.fx_px == LENS.fx_px
    assert model.camera.distortion == LENS.distortion
    assert (model.camera.x_m, model.camera.yaw_rad) == (camera.x_m, camera.yaw_rad)
    np.testing.assert_array_equal(model.lens_covariance, NOISE @ NOISE.T)


def test_another_frame_size_is_refused_by_both():
    other = msgspec.structs.replace(LENS, width_px=1920, height_px=1080)
    with pytest.raises(EyeError, match=r"frames of 1280 x 720 px, got one of 1920 x 1080"):
        calibrated(load_map("driving_school").cameras[0], other)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('lens = "pinhole"', 'lens = "round"', "round"),
        ("views = 14", "views = 14\nfoo = 1", "foo"),
        ("fx_px = 1151.25", "", "fx_px"),
        ("covariance = [", "covariance = [ [1.0, 2.0],", "nine rows of nine"),
        ("covariance = [", "= [", "expected a lens"),
    ],
)
def test_a_damaged_file_is_refused_with_its_name(tmp_path, old, new, said):
    path = tmp_path / "lens.toml"
    LENS.save(path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(EyeError, match=rf"lens\.toml.*{said}"):
        load_calibration(path)


@pytest.mark.parametrize(("change", "said"), [((0, 1), "symmetric"), ((0, 0), "negative variance")])
def test_a_covariance_that_cannot_be_is_refused(tmp_path, change, said):
    matrix = NOISE @ NOISE.T
    matrix[change] = -5.0 * abs(matrix[change])
    path = tmp_path / "lens.toml"
    msgspec.structs.replace(LENS, covariance=tuple(map(tuple, matrix.tolist()))).save(path)
    with pytest.raises(EyeError, match=said):
        load_calibration(path)


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(EyeError, match="found no file"):
        load_calibration(tmp_path / "none.toml")
