"""Frames from files."""

import cv2
import numpy as np
import pytest

from scm.errors import EyeError
from scm.eye.sources.file import FileSource

FRAME_NS = 100_000_000


@pytest.fixture
def film(tmp_path):
    """Five frames at 10 Hz, each 40 grey levels brighter than the one before."""
    path = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    for i in range(5):
        writer.write(np.full((48, 64, 3), 40 * i, dtype=np.uint8))
    writer.release()
    return path


def test_a_still_is_one_frame(tmp_path):
    path = tmp_path / "still.png"
    cv2.imwrite(str(path), np.full((48, 64, 3), 7, dtype=np.uint8))
    source = FileSource(path)
    frame = source.take(5, None)
    assert (frame.t_ns, frame.image.shape, int(frame.grey()[0, 0])) == (5, (48, 64, 3), 7)
    assert source.take(6, None) is None


def test_a_film_plays_at_its_own_rate(film):
    source = FileSource(film)
    taken = [source.take(1_000 + i * FRAME_NS // 2, None) for i in range(12)]
    times = [frame.t_ns for frame in taken if frame]
    assert times == [1_000 + i * FRAME_NS for i in range(5)]


def test_frames_already_late_are_left_out(film):
    source = FileSource(film)
    source.take(0, None)
    frame = source.take(3 * FRAME_NS, None)
    assert frame.t_ns == 3 * FRAME_NS
    assert float(frame.image.mean()) == pytest.approx(120.0, abs=4.0)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(EyeError, match="found no file"):
        FileSource(tmp_path / "none.mp4")


def test_a_file_that_is_no_picture_is_refused(tmp_path, capfd):
    path = tmp_path / "text.avi"
    path.write_text("no film")
    with pytest.raises(EyeError, match="OpenCV reads"):
        FileSource(path)
