"""What a person types after `--frames`."""

import cv2
import numpy as np
import pytest

from scm.errors import EyeError
from scm.eye.sources import choose
from scm.eye.sources.bus import BusSource
from scm.eye.sources.choose import source_of
from scm.eye.sources.file import FileSource
from scm.eye.sources.folder import FolderSource
from scm.eye.sources.live import LiveSource


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("0", "/dev/video0"),
        ("/dev/video2", "/dev/video2"),
        ("rtsp://me:secret@cam:554/one?two=3", "rtsp://cam:554/one?two=3"),
        ("http://me:secret@10.0.0.4/film", "http://10.0.0.4/film"),
        ("HTTPS://cam/film", "https://cam/film"),
    ],
)
def test_a_live_camera_is_named_without_its_password_and_not_yet_opened(text, name):
    source = source_of(text)
    assert isinstance(source, LiveSource)
    assert (source.name, source.problem) == (name, None)


def test_files_folders_and_the_bus_are_told_apart(tmp_path):
    path = tmp_path / "picture.png"
    cv2.imwrite(str(path), np.zeros((32, 32, 3), np.uint8))
    assert isinstance(source_of(str(path)), FileSource)
    assert isinstance(source_of(str(tmp_path)), FolderSource)
    assert source_of("bus:roof").camera == "roof"
    assert isinstance(source_of("bus:roof"), BusSource)


def test_a_folder_is_played_at_the_rate_that_is_asked_for_and_again_in_a_loop(tmp_path):
    for i in range(2):
        cv2.imwrite(str(tmp_path / f"{i}.png"), np.zeros((32, 32, 3), np.uint8))
    source = source_of(str(tmp_path), rate_hz=2.0, loop=True)
    assert [source.read(i * 500_000_000, None).t_ns for i in range(3)] == [0, 5 * 10**8, 10**9]


def test_a_csi_camera_needs_gstreamer(monkeypatch):
    monkeypatch.setattr(choose, "has_gstreamer", lambda: False)
    with pytest.raises(EyeError, match=r"csi:0: expected an OpenCV .* GStreamer, got one without"):
        source_of("csi:0")
    monkeypatch.setattr(choose, "has_gstreamer", lambda: True)
    assert source_of("csi:0").name == "csi:0"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected 0 or /dev/video0 .*; got ''"),
        ("webcam", "expected 0 or .* bus:CAMERA; got 'webcam'"),
        ("ftp://cam/film.mp4", "expected 0 or .*; got 'ftp://cam/film.mp4'"),
        ("-1", "got '-1'"),
        ("csi:front", "expected csi: and a number, as csi:0; got 'csi:front'"),
        ("rtsp://", "expected a host in the address"),
        ("http://cam:port/", "expected the address of a camera, got 'http://cam:port/'"),
        ("nowhere/film.mp4", "nowhere/film.mp4: expected a picture or film, found no file"),
    ],
)
def test_anything_else_is_refused_with_what_was_expected(text, said):
    with pytest.raises(EyeError, match=said):
        source_of(text)


def test_a_camera_that_is_not_there_yet_is_waited_for():
    source = source_of("/dev/video-none")
    try:
        assert source.read(0, None) is None
    finally:
        source.close()


@pytest.mark.parametrize("delay_s", [float("nan"), -0.1, float("inf")])
def test_a_delay_that_cannot_be_is_refused(delay_s):
    with pytest.raises(EyeError, match="--delay-ms: expected 0 to 10000, got"):
        source_of("bus:roof", delay_s=delay_s)
