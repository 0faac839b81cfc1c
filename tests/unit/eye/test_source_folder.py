"""A folder of pictures is played in the order that a person counts, at its own times."""

import cv2
import numpy as np
import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import EyeError
from scm.eye.sources.folder import FolderSource

START_NS = 1_000


@pytest.fixture
def folder(tmp_path):
    """Return a function that fills a folder: the first picture's grey level is 0, the next 1 ..."""

    def fill(*names, shape=(32, 32, 3)):
        for level, name in enumerate(names):
            cv2.imwrite(str(tmp_path / name), np.full(shape, level, np.uint8))
        return tmp_path

    return fill


def play(source, steps, step_ns=NS_PER_S // 100):
    """Return (time since the start [ms], grey level) of each frame."""
    taken = [source.read(START_NS + i * step_ns, None) for i in range(steps)]
    return [
        (round((frame.t_ns - START_NS) / NS_PER_MS), int(frame.image[0, 0, 0]))
        for frame in taken
        if frame
    ]


def test_two_comes_before_ten_and_the_rate_is_kept(folder):
    path = folder("f1.png", "f2.png", "F10.png", "f21.png")
    (path / "notes.txt").write_text("no picture")
    source = FolderSource(path, rate_hz=20.0)
    assert play(source, 30) == [(0, 0), (50, 1), (100, 2), (150, 3)]
    assert source.problem == f"{path}: over"


def test_a_table_of_times_chooses_the_pictures_and_says_when(folder):
    path = folder("a.png", "b.png", "c.png")
    (path / "timestamps.csv").write_text("note,file,t_s\n,c.png,12.5\nx,a.png,12.62\n")
    assert play(FolderSource(path), 30) == [(0, 2), (120, 0)]


def test_times_in_names_are_seconds_with_a_point(folder):
    path = folder("cam_9.95.png", "cam_10.00.png", "cam_10.20.png")
    assert play(FolderSource(path), 40) == [(0, 0), (50, 1), (250, 2)]


def test_times_in_names_are_microseconds_or_nanoseconds_of_the_epoch(folder):
    path = folder("1700000000000000.png", "x1700000000100000000.png")
    assert play(FolderSource(path), 40) == [(0, 0), (100, 1)]


def test_pictures_already_late_are_left_out_but_never_the_last(folder):
    source = FolderSource(folder(*(f"{i}.png" for i in range(6))), rate_hz=10.0)
    assert play(source, 3, step_ns=3 * NS_PER_S // 10) == [(0, 0), (300, 3), (500, 5)]


def test_a_loop_goes_on_with_the_mean_pace(folder):
    source = FolderSource(folder("0.png", "1.png", "2.png"), rate_hz=10.0, loop=True)
    assert play(source, 61) == [(100 * i, i % 3) for i in range(7)]
    assert source.problem is None


def test_a_damaged_picture_is_said_and_the_next_one_is_shown(folder):
    path = folder(*(f"{i}.jpg" for i in range(12)))
    (path / "1.jpg").write_bytes((path / "1.jpg").read_bytes()[:-30])
    source = FolderSource(path, rate_hz=10.0)
    assert source.read(0, None)
    assert source.read(100 * NS_PER_MS, None) is None
    assert source.problem.startswith(f"{path / '1.jpg'}: expected a whole JPEG, got one truncated")
    assert source.read(200 * NS_PER_MS, None)
    assert "truncated" in source.problem  # long enough for a status that is told twice a second
    assert source.read(1_100 * NS_PER_MS, None)
    assert source.problem is None


def test_a_picture_that_vanished_is_said(folder):
    path = folder("0.png", "1.png")
    source = FolderSource(path)
    (path / "0.png").unlink()
    assert source.read(0, None) is None
    assert "0.png: expected a picture, found no file" in source.problem


def test_a_picture_of_another_size_is_left_out(folder):
    path = folder("0.png", "1.png")
    cv2.imwrite(str(path / "1.png"), np.zeros((16, 48, 3), np.uint8))
    source = FolderSource(path)
    assert play(source, 20) == [(0, 0)]
    source = FolderSource(path)
    source.read(0, None)
    source.read(100 * NS_PER_MS, None)
    assert source.problem == f"{path}: size changed from 32 x 32 to 48 x 16 px: frames left out"


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("file,time\na.png,1\n", "expected the columns file, t_s; got file, time"),
        ("", "expected the columns file, t_s; got nothing"),
        ("file,t_s\n", "expected at least one picture"),
        ("file,t_s\na.png,1\nb.pgn,2\n", r"line 3: .*got 'b.pgn' \(did you mean 'b.png'\?\)"),
        ("file,t_s\na.png,one\n", "line 2: t_s: expected seconds, got 'one'"),
        ("file,t_s\na.png,nan\n", "line 2: t_s: expected seconds, got 'nan'"),
        ("file,t_s\na.png\n", "line 2: t_s: expected seconds, got ''"),
        ("file,t_s\na.png,2\nb.png,2\n", "line 3: expected a later time than the line before"),
    ],
)
def test_a_table_that_makes_no_sense_is_refused_with_its_line(folder, table, said):
    path = folder("a.png", "b.png")
    (path / "timestamps.csv").write_text(table)
    with pytest.raises(EyeError, match=said):
        FolderSource(path)


def test_a_folder_without_pictures_or_a_rate_that_is_none_is_refused(folder):
    with pytest.raises(EyeError, match=r"expected pictures \(.jpg, .*found none"):
        FolderSource(folder())
    with pytest.raises(EyeError, match="expected a folder of pictures, found none"):
        FolderSource(folder() / "none")
    with pytest.raises(EyeError, match="expected a rate above 0 Hz, got 0"):
        FolderSource(folder("a.png"), rate_hz=0.0)


def test_two_pictures_with_the_same_time_in_their_names_are_refused(folder):
    with pytest.raises(EyeError, match=r"a_1.5.png and b_1.50.png have the same time"):
        FolderSource(folder("a_1.5.png", "b_1.50.png"))
