"""`scm camera calibrate-look`: frames of a camera with a concealed look, and useless folders."""

import contextlib
import dataclasses
import io

import cv2
import numpy as np
import pytest

from scm.__main__ import main
from scm.camera.calibrate import counterparts
from scm.camera.calibrate.real_frames import read_frames
from scm.camera.optics import optics_of
from scm.errors import EyeError
from scm.geometry import Pose2
from scm.maps.route import Path as LanePath
from scm.maps.route import roads_of
from scm.vehicles.car import load_car
from scm.vehicles.car_text import set_entry

SIZE = (320, 180)
LOOK = {
    "exposure": 0.7, "white_balance": (1.2, 1.0, 0.85), "gamma": 1.2, "vignetting": 0.3,
    "blur_px": 1.0, "read_noise": 2.0, "shot_noise": 5.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def small_nigel(tmp_path_factory):
    """Return a Nigel's file whose camera has fewer pixels, which takes less time."""
    path = tmp_path_factory.mktemp("car") / "small.toml"
    text = load_car("nigel").path.read_text(encoding="utf-8")
    path.write_text(set_entry(text, "camera", "resolution_px", "{ value = [320, 180] }"))
    return path


@pytest.fixture(scope="module")
def frames(small_nigel, studio, city_map, car, tmp_path_factory):
    """Return a folder of frames by a camera with `LOOK`, from along the lane."""
    folder = tmp_path_factory.mktemp("real")
    optics = dataclasses.replace(optics_of(load_car(small_nigel), "front"), **LOOK)
    lane = LanePath.circulation(roads_of(city_map), city_map.lanes[0].name)
    rng = np.random.default_rng(5)
    for number in range(16):
        beside, turned = rng.standard_normal(2) * (0.01, 0.03)
        at = lane.at(number * lane.length_m / 16) @ Pose2(0.0, beside, turned)
        me = car(at.x, at.y, at.yaw)
        image = studio.picture(optics, me, [me], {}, "front", number)
        cv2.imwrite(str(folder / f"{number:02}.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 93])
    return folder


@pytest.fixture(scope="module")
def calibrated(small_nigel, frames, tmp_path_factory):
    """Return the car file that the command writes, and what it prints."""
    out = tmp_path_factory.mktemp("out") / "new" / "car.toml"
    options = ["--car", str(small_nigel), "--out", str(out), "--sheet", str(out.parent / "s.png")]
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as text:
        patch.setattr(counterparts, "PLACES", 200)
        assert main(["camera", "calibrate-look", str(frames), *options]) == 0
    return out, text.getvalue()


def test_a_concealed_look_is_found(calibrated):
    found = optics_of(load_car(calibrated[0]), "front")
    assert found.exposure == pytest.approx(0.7, rel=0.06)
    assert found.white_balance == pytest.approx((1.2, 1.0, 0.85), rel=0.03)
    assert found.gamma == pytest.approx(1.2, rel=0.06)
    assert found.vignetting == pytest.approx(0.3, abs=0.08)
    assert found.blur_px == pytest.approx(1.0, abs=0.15)
    at_80 = found.read_noise**2 + found.shot_noise**2 * 80 / 255
    assert at_80**0.5 == pytest.approx((2.0**2 + 5.0**2 * 80 / 255) ** 0.5, rel=0.15)
    assert found.jpeg_quality == 93


def test_a_calibrated_file_keeps_all_else_of_the_car(calibrated, small_nigel):
    new, old = load_car(calibrated[0]), load_car(small_nigel)
    changed = {key for key in new.values if new.values[key].value != old.values[key].value}
    assert changed == {f"camera.{key}" for key in (*LOOK, "jpeg_quality")}
    assert "calibrate-look: 16 frames" in new.quantity("camera.exposure").source


def test_figures_of_frames_held_out_are_printed_before_and_after(calibrated):
    out, text = calibrated
    rows = [line.split() for line in text.splitlines()]
    before, after = next(map(float, row[-3:-1]) for row in rows if row[:1] == ["colour,"])
    assert after < 0.2 * before
    assert "What no frames of unknown poses can tell apart" in text
    sheet = cv2.imread(str(out.parent / "s.png"))
    assert sheet.shape == (3 * 180, 4 * 320, 3)


def test_frames_made_smaller_give_colour_and_no_noise(frames, small_nigel, tmp_path, capsys):
    for path in frames.iterdir():
        little = cv2.resize(cv2.imread(str(path)), (160, 90), interpolation=cv2.INTER_AREA)
        cv2.imwrite(str(tmp_path / f"{path.stem}.png"), little)
    options = ["--car", str(small_nigel), "--out", str(tmp_path / "car.toml")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(counterparts, "PLACES", 200)
        assert main(["camera", "calibrate-look", str(tmp_path), *options]) == 0
    found = optics_of(load_car(tmp_path / "car.toml"), "front")
    assert found.white_balance == pytest.approx((1.2, 1.0, 0.85), rel=0.03)
    assert (found.read_noise, found.jpeg_quality) == (1.0, 80.0)
    assert "Not determined by these frames: noise, blur_px" in capsys.readouterr().out


def written(folder, *, count=10, size=SIZE, kind="png", colour=(40, 90, 200)):
    for number in range(count):
        image = np.full((size[1], size[0], 3), colour, np.uint8)
        cv2.imwrite(str(folder / f"{number}.{kind}"), image)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"count": 3}, r"expected at least 8 frames \(\.jpg, \.png\), got 3"),
        ({"size": (320, 240)}, r"expected 320 x 180 pixels, .*smaller.*, got 320 x 240"),
        ({"size": (640, 360)}, r"expected 320 x 180 pixels, .*smaller.*, got 640 x 360"),
        ({"colour": (90, 90, 90)}, "grey: red, green and blue are equal"),
        ({"colour": (2, 1, 0)}, "black: nine in ten pixels are darker"),
        ({"colour": (255, 255, 255)}, "white: over-exposed"),
    ],
)
def test_a_folder_of_no_use_is_refused_in_words(tmp_path, wrong, words):
    written(tmp_path, **wrong)
    with pytest.raises(EyeError, match=words):
        read_frames(tmp_path, SIZE)


def test_a_file_that_is_no_picture_is_named(tmp_path):
    written(tmp_path)
    (tmp_path / "3.png").write_bytes(b"no picture")
    with pytest.raises(EyeError, match=r"3\.png: expected a JPEG or PNG picture"):
        read_frames(tmp_path, SIZE)
    with pytest.raises(EyeError, match="got no such folder"):
        read_frames(tmp_path / "elsewhere", SIZE)


def test_frames_of_two_kinds_or_sizes_are_refused(tmp_path):
    written(tmp_path)
    cv2.imwrite(str(tmp_path / "9.png"), np.zeros((90, 160, 3), np.uint8))
    with pytest.raises(EyeError, match=r"9\.png: expected 320 x 180 pixels, got 160 x 90"):
        read_frames(tmp_path, SIZE)
    written(tmp_path, kind="jpg")
    with pytest.raises(EyeError, match="both JPEG and PNG"):
        read_frames(tmp_path, SIZE)


@pytest.mark.parametrize("quality", [50, 80, 95])
def test_the_quality_of_a_jpeg_file_is_read_from_its_table(tmp_path, quality):
    for number in range(8):
        image = np.random.default_rng(number).integers(0, 255, (180, 320, 3), np.uint8)
        cv2.imwrite(str(tmp_path / f"{number}.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert read_frames(tmp_path, SIZE).jpeg_quality == quality


def test_what_no_file_and_no_camera_has_is_an_error_before_anything_is_rendered(tmp_path, capsys):
    written(tmp_path)
    options = [str(tmp_path), "--out", str(tmp_path / "car.toml")]
    assert main(["camera", "calibrate-look", *options, "--car", "dart"]) == 2
    assert "expected a front camera, the file has no camera" in capsys.readouterr().err
    assert main(["camera", "calibrate-look", *options, "--sheet", "sheet.txt"]) == 2
    assert "expected a name that ends in .jpg or .png" in capsys.readouterr().err
