"""Calibrations of ROS and OpenCV, read and written."""

import cv2
import numpy as np
import pytest
import yaml

from scm.__main__ import main
from scm.errors import EyeError
from scm.eye.calibration import Calibration
from scm.eye.calibration_files import load_calibration, read_calibration, write_calibration
from scm.eye.camera import camera_model

K = [910.5, 0.0, 641.25, 0.0, 912.75, 358.5, 0.0, 0.0, 1.0]
D = [-0.31, 0.12, 1e-05, -0.0004, -0.02]
ROS = """image_width: 1280
image_height: 720
camera_name: narrow
camera_matrix:
  rows: 3
  cols: 3
  data: [910.5, 0., 641.25, 0., 912.75, 358.5, 0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.31, 0.12, 1e-05, -0.0004, -0.02]
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [900, 0, 640, 0, 0, 900, 360, 0, 0, 0, 1, 0]}
"""
ECHOED = """header:
  frame_id: cam
height: 720
width: 1280
distortion_model: plumb_bob
d: [-0.31, 0.12, 1.0e-05, -0.0004, -0.02]
k: [910.5, 0.0, 641.25, 0.0, 912.75, 358.5, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
binning_x: 0
---
height: 720
"""
OPENCV = """%YAML:1.0
---
calibration_time: "Wed 25 Nov 2026 10:00:00"
nframes: 17
image_width: 1280
image_height: 720
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 9.1050000000000000e+02, 0., 6.4125000000000000e+02, 0.,
       9.1275000000000000e+02, 3.5850000000000000e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.31, 0.12, 1e-05, -0.0004, -0.02 ]
avg_reprojection_error: 2.5e-01
per_view: !!opencv-nd-matrix
   sizes: [ 2 ]
   dt: f
   data: [ 1., 2. ]
"""
LISTS = f"camera_matrix: {np.reshape(K, (3, 3)).tolist()}\ndist_coeff: {[D]}\nsize: [1280, 720]\n"


def written(tmp_path, text, name="camera.yaml"):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_a_lens_file_that_is_lost_or_empty_is_refused(tmp_path):
    for name, text in (
        ("a.xml", "<?xml version='1.0'?><a/>"),
        ("b.yaml", ""),
        ("c.txt", "[image]"),
    ):
        with pytest.raises(
            EyeError, match=rf"{name}.*expected a lens: TOML of .scm eye calibrate."
        ):
            read_calibration(written(tmp_path, text, name))
    with pytest.raises(EyeError, match="found no file"):
        read_calibration(tmp_path / "none.yaml")


@pytest.mark.parametrize("text", [ROS, ECHOED, OPENCV, LISTS], ids=("ros", "echo", "cv", "lists"))
def test_lenses_of_ros_and_opencv_are_read_with_a_stated_covariance(tmp_path, text):
    lens, remarks = read_calibration(written(tmp_path, text))
    assert (lens.lens, lens.width_px, lens.height_px) == ("pinhole", 1280, 720)
    assert lens.values.tolist() == [K[0], K[4], K[2], K[5], *D]
    assert (lens.rms_px, lens.views) == ((0.25, 17) if text is OPENCV else (0.0, 0))
    assert "each ray is assumed known to 0.64 px" in remarks[-1]


def test_opencv_s_own_xml_and_json_are_read(tmp_path):
    for name in ("lens.xml", "lens.json", "lens.yml"):
        storage = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_WRITE)
        storage.write("image_width", 1280)
        storage.write("image_height", 720)
        storage.write("cameraMatrix", np.reshape(K, (3, 3)))
        storage.write("distCoeffs", np.array([D]))
        storage.release()
        lens = load_calibration(tmp_path / name)
        assert lens.values == pytest.approx([K[0], K[4], K[2], K[5], *D], rel=1e-12)


def test_the_covariance_taken_makes_rays_as_uncertain_as_is_said(tmp_path):
    lens = load_calibration(written(tmp_path, ROS))
    rng = np.random.default_rng(0)
    pixels = rng.uniform((0, 0), (1279, 719), (81, 2))
    rays = camera_model(lens.camera()).undistort(pixels)
    flat = np.concatenate((rays, np.ones((81, 1))), axis=1)
    root = np.linalg.cholesky(lens.lens_covariance + 1e-18 * np.eye(9))
    zero, off = np.zeros(3), []
    for _ in range(200):
        fx, fy, cx, cy, *d = lens.values + root @ rng.standard_normal(9)
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        off.append(cv2.projectPoints(flat, zero, zero, matrix, np.array(d))[0][:, 0] - pixels)
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(0.64, rel=0.2)


def test_an_equidistant_lens_is_our_fisheye(tmp_path):
    four = "[-0.02, 0.004, -0.001, 0.0002]"
    text = ROS.replace("plumb_bob", "equidistant").replace("cols: 5", "cols: 4")
    lens, _ = read_calibration(written(tmp_path, text.replace(str(D), four).replace(
        "[-0.31, 0.12, 1e-05, -0.0004, -0.02]", four)))  # fmt: skip
    assert (lens.lens, lens.distortion) == ("fisheye", (-0.02, 0.004, -0.001, 0.0002, 0.0))
    assert lens.deviations[8] == 0.0
    assert (lens.deviations[:8] > 0.0).all()


def rational(*more):
    data = [0.1, -0.2, 1e-4, -2e-4, 0.05, *more]
    return ROS.replace("plumb_bob", "rational_polynomial").replace(
        "[-0.31, 0.12, 1e-05, -0.0004, -0.02]", str(data)
    )


def test_a_rational_lens_is_fitted_by_five_and_what_is_left_is_said(tmp_path):
    lens, remarks = read_calibration(written(tmp_path, rational(0.3, -0.1, 0.02)))
    assert "8 distortion coefficients are approximated by five" in remarks[0]
    rays = np.array([[0.0, 0.0, 1.0], [0.5, 0.3, 1.0], [-0.6, -0.35, 1.0]])
    zero, matrix = np.zeros(3), np.reshape(K, (3, 3))
    want = cv2.projectPoints(
        rays, zero, zero, matrix, np.array([0.1, -0.2, 1e-4, -2e-4, 0.05, 0.3, -0.1, 0.02])
    )[0][:, 0]
    got = camera_model(lens.camera())
    shown = cv2.projectPoints(rays, zero, zero, matrix, np.array(lens.distortion))[0][:, 0]
    np.testing.assert_allclose(shown, want, atol=0.5)
    assert np.isfinite(got.undistort(want)).all()
    exact, _ = read_calibration(written(tmp_path, rational(0.0, 0.0, 0.0)))
    assert exact.distortion == (0.1, -0.2, 1e-4, -2e-4, 0.05)


def test_a_frame_size_that_the_file_lacks_is_the_camera_s(tmp_path):
    text = ROS.replace("image_width: 1280\nimage_height: 720\n", "")
    path = written(tmp_path, text)
    with pytest.raises(EyeError, match=r"camera\.yaml: image_width and image_height: expected"):
        read_calibration(path)
    lens, remarks = read_calibration(path, (1280, 720))
    assert (lens.width_px, lens.height_px) == (1280, 720)
    assert "assumed to be the camera's, 1280 x 720" in remarks[0]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("camera_matrix", "matrix_of_camera", r"camera_matrix: expected nine numbers.*got keys"),
        ("910.5, 0.", "910.5, 5.", "camera_matrix: expected .fx, 0, cx"),
        ("910.5,", ".nan,", "finite numbers"),
        ("910.5,", "many,", "camera_?matrix: expected numbers"),
        ("plumb_bob", "division", "distortion_model: expected plumb_bob"),
        (", -0.02]", ", -0.02, 0.1, 0.2]", "4, 5, 8, 12 or 14, got 7"),
        ("641.25", "1641.25", "cx_px: expected inside the frame"),
        ("-0.31, 0.12", "-3.1, 0.12", "folds back"),
        ("camera_name: narrow", "camera_name: [", "YAML"),
    ],
)
def test_a_file_that_is_no_lens_is_refused_with_its_name_and_key(tmp_path, old, new, said):
    path = written(tmp_path, ROS.replace(old, new, 1))
    with pytest.raises(EyeError, match=rf"(?s)camera\.yaml.*{said}"):
        read_calibration(path)


def test_a_lens_beyond_five_coefficients_is_refused(tmp_path):
    with pytest.raises(EyeError, match=r"that five of them follow to 0\.64 px RMS.*px RMS left"):
        read_calibration(written(tmp_path, rational(40.0, -60.0, 80.0)))


LENS = Calibration(
    lens="pinhole", width_px=1280, height_px=720, fx_px=K[0], fy_px=K[4], cx_px=K[2], cy_px=K[5],
    distortion=tuple(D), covariance=((0.0,) * 9,) * 9, rms_px=0.25, views=17,
)  # fmt: skip


def test_what_is_written_ros_and_opencv_read(tmp_path):
    write_calibration(LENS, tmp_path / "a.yaml", "ros", "narrow")
    told = yaml.safe_load((tmp_path / "a.yaml").read_text())
    assert told["camera_matrix"] == {"rows": 3, "cols": 3, "data": K}
    assert told["distortion_coefficients"]["data"] == D
    assert (told["distortion_model"], told["camera_name"]) == ("plumb_bob", "narrow")
    assert told["projection_matrix"]["data"] == [*K[:3], 0.0, *K[3:6], 0.0, *K[6:], 0.0]
    write_calibration(LENS, tmp_path / "a.yml", "opencv")
    storage = cv2.FileStorage(str(tmp_path / "a.yml"), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("camera_matrix").mat().ravel(), K)
    np.testing.assert_array_equal(storage.getNode("distortion_coefficients").mat().ravel(), D)
    for name in ("a.yaml", "a.yml"):
        assert load_calibration(tmp_path / name).values.tolist() == LENS.values.tolist()


def test_the_command_converts_and_says_what_it_took(tmp_path, capsys):
    source, made = written(tmp_path, OPENCV, "lens.yml"), tmp_path / "lens.toml"
    assert main(["eye", "convert", str(source), "--out", str(made)]) == 0
    assert load_calibration(made).values.tolist() == [K[0], K[4], K[2], K[5], *D]
    assert "each ray is assumed known to 0.64 px" in capsys.readouterr().out
    assert main(["eye", "convert", str(made), "--out", str(tmp_path / "camera.yaml")]) == 0
    assert yaml.safe_load((tmp_path / "camera.yaml").read_text())["image_width"] == 1280
