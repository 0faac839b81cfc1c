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
    frame = source.read(5, None)
    assert (frame.t_ns, frame.image.shape, int(frame.grey()[0, 0])) == (5, (48, 64, 3), 7)
    assert source.read(6, None) is None


def test_a_film_plays_at_its_own_rate(film):
    source = FileSource(film)
    taken = [source.read(1_000 + i * FRAME_NS // 2, None) for i in range(12)]
    times = [frame.t_ns for frame in taken if frame]
    assert times == [1_000 + i * FRAME_NS for i in range(5)]


def test_frames_already_late_are_left_out(film):
    source = FileSource(film)
    source.read(0, None)
    frame = source.read(3 * FRAME_NS, None)
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


def test_a_film_that_is_over_says_so(film):
    source = FileSource(film)
    assert source.problem is None
    assert [bool(source.read(i * FRAME_NS, None)) for i in range(6)] == [True] * 5 + [False]
    assert source.problem == f"{film}: over"


def test_a_film_in_a_loop_begins_again_and_time_goes_on(film):
    source = FileSource(film, loop=True)
    frames = [source.read(7 + i * FRAME_NS, None) for i in range(13)]
    assert [frame.t_ns for frame in frames] == [7 + i * FRAME_NS for i in range(13)]
    levels = [round(float(frame.image.mean()) / 40.0) for frame in frames]
    assert levels == [0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 0, 1, 2]
    assert source.problem is None


def test_a_film_whose_frames_come_unevenly_keeps_their_times(tmp_path, monkeypatch):
    """OpenCV writes even films only, so its reader is told other times than the file has."""
    times_ms = [20.0, 120.0, 155.0, 155.0, 420.0]

    class Uneven:
        def __init__(self, path):
            self.at = -1

        def isOpened(self):  # noqa: N802
            return True

        def grab(self):
            self.at += 1
            return self.at < len(times_ms)

        def retrieve(self):
            return True, np.full((48, 64, 3), self.at, np.uint8)

        def get(self, of):
            return 10.0 if of == cv2.CAP_PROP_FPS else times_ms[self.at]

        def release(self):
            pass

    path = tmp_path / "film.mp4"
    path.write_bytes(b"")
    monkeypatch.setattr(cv2, "VideoCapture", Uneven)
    source = FileSource(path)
    taken = [source.read(i * FRAME_NS // 20, None) for i in range(101)]
    # the first is the start; the fourth has no time of its own, so the rate gives it one
    assert [frame.t_ns // 1_000_000 for frame in taken if frame] == [0, 100, 135, 235, 400]


def test_a_still_in_a_loop_is_shown_again_and_again(tmp_path):
    path = tmp_path / "still.png"
    cv2.imwrite(str(path), np.full((48, 64, 3), 7, dtype=np.uint8))
    source = FileSource(path, loop=True)
    times = [source.read(i * FRAME_NS, None).t_ns for i in range(4)]
    assert times == [i * FRAME_NS for i in range(4)]


def test_a_film_cut_short_plays_what_there_is_and_says_it_is_over(tmp_path, capfd):
    path = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    for i in range(20):
        writer.write(np.random.default_rng(i).integers(0, 255, (48, 64, 3), dtype=np.uint8))
    writer.release()
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    source = FileSource(path)
    shown = sum(source.read(i * FRAME_NS, None) is not None for i in range(30))
    assert 5 <= shown <= 11
    assert source.problem == f"{path}: over"


def test_nothing_comes_of_a_closed_film(film):
    source = FileSource(film)
    source.close()
    source.close()
    assert source.read(0, None) is None
