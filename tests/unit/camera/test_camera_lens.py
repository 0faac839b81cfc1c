"""A lens shows points where OpenCV says they are, and bends what is straight the right way."""

import math

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.camera.lens import Lens
from scm.camera.optics import cameras_of, fitted, optics_of
from scm.errors import CarError
from scm.scenery.bodies import car_rotation
from scm.vehicles.car import car_of, load_car

BARREL = (-0.30, 0.09, 0.001, -0.0008, 0.0)
PINCUSHION = (0.12, 0.0, 0.0, 0.0, 0.0)


def points_ahead(view, count=200, seed=0):
    """Return map points inside the field of view of a Nigel, (n, 3)."""
    rng = np.random.default_rng(seed)
    z = rng.uniform(0.2, 3.0, count)
    seen = np.column_stack(
        (rng.uniform(-0.55, 0.55, count) * z, rng.uniform(-0.3, 0.3, count) * z, z)
    )
    return seen @ view.camera_R_map + view.position


@pytest.mark.parametrize("distortion", [(0.0,) * 5, BARREL, PINCUSHION])
@pytest.mark.parametrize("camera", ["front", "rear"])
def test_points_are_shown_where_opencv_projects_them(optics, car, camera, distortion):
    lens = Lens(optics(camera, distortion=distortion, width_px=160, height_px=90))
    pose = car(0.7, 0.4, 1.1, roll_rad=0.03, pitch_rad=-0.02)
    view = lens.view(car_rotation(pose), np.array([pose.x_m, pose.y_m, 0.0]))
    points = points_ahead(view)
    turned, _ = cv2.Rodrigues(view.camera_R_map)
    moved = -view.camera_R_map @ view.position
    theirs, _ = cv2.projectPoints(points, turned, moved, lens.matrix, lens.distortion)
    assert_allclose(lens.project(view.seen(points)), theirs[:, 0], atol=1e-6)


def test_the_front_camera_of_a_nigel_is_where_its_file_says(optics, car):
    lens = Lens(optics())
    view = lens.view(car_rotation(car(0.0, 0.0)), np.zeros(3))
    assert_allclose(view.position, [0.195276, 0.0, 0.110486])
    # The middle of the picture is 7.3 deg below the horizon: it meets the floor so far ahead.
    far = 0.110486 / math.tan(0.1273)
    middle = lens.project(view.seen(np.array([[0.195276 + far, 0.0, 0.0]])))
    assert_allclose(middle, [[639.5, 359.5]], atol=1e-9)
    # 62.2 deg from edge to edge.
    right = lens.project(np.array([[math.tan(math.radians(31.1)), 0.0, 1.0]]))
    assert_allclose(right, [[639.5 + 640.0, 359.5]], atol=1e-9)


def test_what_is_left_of_the_car_is_left_in_front_and_right_behind(optics, car):
    rotation = car_rotation(car(0.0, 0.0))
    for camera, x, side in (("front", 1.0, -1.0), ("rear", -1.0, 1.0)):
        lens = Lens(optics(camera))
        seen = lens.view(rotation, np.zeros(3)).seen(np.array([[x, 0.2, 0.0]]))
        assert seen[0, 2] > 0.0
        assert math.copysign(1.0, seen[0, 0]) == side


def bent_line(lens, row=80):
    """Return the rows of a straight line near the picture's top: at its ends and in its middle."""
    width, height = lens.canvas_size
    canvas = np.zeros((height, width, 3), np.uint8)
    shift = round(lens.canvas_matrix[1, 2] - lens.matrix[1, 2])
    canvas[row + shift - 2 : row + shift + 3] = 255
    grey = lens.bend(canvas)[:, :, 0].astype(float)
    rows = np.arange(len(grey))[:, None]
    return [float((rows * grey[:, [x]]).sum() / grey[:, x].sum()) for x in (40, 640, 1240)]


def test_a_barrel_bows_a_line_outwards_and_a_pincushion_inwards(optics):
    left, middle, right = bent_line(Lens(optics(distortion=(-0.2, 0.0, 0.0, 0.0, 0.0))))
    assert middle < min(left, right) - 5.0
    left, middle, right = bent_line(Lens(optics(distortion=PINCUSHION)))
    assert middle > max(left, right) + 5.0
    left, middle, right = bent_line(Lens(optics()))
    assert left == middle == right == pytest.approx(80.0)


@pytest.mark.parametrize("distortion", [BARREL, PINCUSHION])
def test_a_bent_picture_agrees_with_the_projection(optics, distortion):
    lens = Lens(optics(distortion=distortion))
    width, height = lens.canvas_size
    seen = np.array([[-0.4, -0.2, 1.0], [0.3, 0.15, 1.0], [0.0, 0.0, 1.0], [0.5, -0.25, 1.0]])
    for point in seen:
        canvas = np.zeros((height, width, 3), np.uint8)
        at = np.rint(lens.on_canvas(point) * 16).astype(int)
        cv2.circle(canvas, tuple(at.tolist()), 6 * 16, (255, 255, 255), -1, cv2.LINE_AA, 4)
        grey = lens.bend(canvas)[:, :, 0].astype(float)
        rows, columns = np.indices(grey.shape)
        middle = [(columns * grey).sum() / grey.sum(), (rows * grey).sum() / grey.sum()]
        # A round spot is squeezed unevenly by the lens: its middle is good to a third of a pixel.
        assert_allclose(middle, lens.project(point[None])[0], atol=0.35)


def test_a_distortion_that_folds_the_picture_is_refused(optics):
    with pytest.raises(CarError, match=r"camera\.distortion: got \[-2\.0"):
        Lens(optics(distortion=(-2.0, 0.0, 0.0, 0.0, 0.0)))


def test_a_car_file_may_say_more_of_its_cameras(tmp_path):
    import tomllib

    path = load_car("nigel").path
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    data["camera"]["distortion"] = {"value": list(BARREL), "source": "ours"}
    data["camera"]["exposure"] = {"value": 0.5, "source": "ours"}
    data["camera"]["rate_hz"] = {"value": 30.0, "source": "ours"}
    data["camera"]["latency_s"] = {"value": 0.1, "source": "ours"}
    data["camera"]["drop_out"] = {"value": 0.2, "source": "ours"}
    found = optics_of(car_of(data, path), "rear")
    assert (found.distortion, found.exposure, found.rate_hz) == (BARREL, 0.5, 30.0)
    assert (found.latency_s, found.drop_out) == (0.1, 0.2)
    assert found.jpeg_quality == 80.0
    del data["camera"]["rear_position_m"]
    assert cameras_of(car_of(data, path)) == ("front",)


def test_a_vertical_field_of_view_reaches_from_the_upper_edge_to_the_lower():
    found = optics_of(load_car("f1tenth"), "front")
    half = math.radians(48.83 / 2.0)
    assert 2.0 * math.atan(360.0 / found.focal_px) == pytest.approx(2.0 * half)
    # The sensor's width and the focal length of the file say the same, cut to 16:9 or not.
    assert math.tan(half) == pytest.approx(0.75 * 3.68 / 2.0 / 3.04, rel=1e-3)


def test_a_field_of_view_is_horizontal_unless_the_file_says_otherwise():
    found = optics_of(load_car("nigel"), "front")
    assert 2.0 * math.atan(640.0 / found.focal_px) == pytest.approx(math.radians(62.2))


def test_a_field_of_view_along_anything_else_is_refused_with_the_words_that_are_valid():
    import tomllib

    path = load_car("nigel").path
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    data["camera"]["fov_axis"] = {"value": "diagonal", "source": "ours"}
    told = r"nigel\.toml: camera\.fov_axis: expected 'horizontal' or 'vertical', got 'diagonal'"
    with pytest.raises(CarError, match=told):
        car_of(data, path)


def test_cars_have_the_cameras_of_their_files():
    found = {car: tuple(fitted(car)) for car in ("nigel", "f1tenth", "dart")}
    assert found == {"nigel": ("front", "rear"), "f1tenth": ("front",), "dart": ()}
