"""Pictures are read whole or refused with what is wrong; `scm eye detect` tells what is in them."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from scm.__main__ import main
from scm.errors import EyeError
from scm.eye.detect import detect_tags
from scm.eye.picture import decode_picture, read_picture
from scm.scenery.sheet import printed_tag

TAG = 7


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    """A grey sheet with one tag of 80 px, its printed edge 100 px."""
    sheet = np.full((240, 320, 3), 180, dtype=np.uint8)
    sheet[60:160, 100:200] = cv2.resize(printed_tag(TAG), (100, 100), interpolation=cv2.INTER_AREA)
    path = tmp_path / "sheet.png"
    cv2.imwrite(str(path), sheet)
    return path


def jpeg(shape=(48, 64, 3)):
    return cv2.imencode(".jpg", np.full(shape, 90, dtype=np.uint8))[1].tobytes()


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "expected a picture that OpenCV reads, got 0 bytes"),
        (b"no picture at all", "expected a picture that OpenCV reads, got 17 bytes"),
        (jpeg()[:-20], "expected a whole JPEG, got one truncated after"),
        (jpeg((1, 1, 3)), "expected at least 16 x 16 px, got 1 x 1"),
    ],
)
def test_what_is_no_whole_picture_is_refused(data, said):
    with pytest.raises(EyeError, match=said):
        decode_picture(data, "it")


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(EyeError, match=r"none\.png: expected a picture, found no file"):
        read_picture(tmp_path / "none.png")


def test_frames_too_small_for_any_tag_have_none():
    assert detect_tags(np.zeros((1, 1), dtype=np.uint8)) == ()
    assert detect_tags(np.zeros((480, 640), dtype=np.uint8)) == ()


def test_tags_are_told_as_json(picture, capsys):
    assert main(["eye", "detect", str(picture), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["image"] == str(picture)
    (tag,) = found["tags"]
    assert tag["id"] == TAG
    assert tag["decision_margin"] > 30.0
    # lower left first, counter-clockwise; the sheet's middle lies between pixels 149 and 150
    np.testing.assert_allclose(np.mean(tag["corners_px"], axis=0), [149.5, 109.5], atol=0.15)
    (left, low), (right, _), _, (_, up) = tag["corners_px"]
    assert left < right
    assert up < low


def test_tags_are_told_to_a_person(picture, capsys):
    assert main(["eye", "detect", str(picture)]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first == f"{picture}: 1 tag"
    assert second.startswith(f"  id   {TAG}  margin")


def test_a_bad_picture_is_bad_input(tmp_path, capsys):
    path = tmp_path / "cut.jpg"
    path.write_bytes(jpeg()[:-20])
    assert main(["eye", "detect", str(path)]) == 2
    assert "scm eye detect:" in capsys.readouterr().err
