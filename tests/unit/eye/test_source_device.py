"""Cameras of OpenCV, as a fake `cv2.VideoCapture` would give them."""

import cv2
import numpy as np
import pytest

from scm.clock import NS_PER_MS
from scm.errors import EyeError
from scm.eye.sources.capture import DamagedFrameError
from scm.eye.sources.device import MJPG, DeviceCapture, csi_pipeline, open_rtsp, open_usb, set_up

NOW_NS = 90_000 * NS_PER_MS
PICTURE = np.random.default_rng(0).integers(0, 255, (48, 64, 3), dtype=np.uint8)
JPEG = cv2.imencode(".jpg", PICTURE)[1]


class FakeVideo:
    """A device: its properties, and the frames that it gives one after the other."""

    def __init__(self, *frames, stamp_ms=0.0, knows_mjpg=True):
        self.frames = list(frames)
        self.stamp_ms = stamp_ms
        self.knows_mjpg = knows_mjpg
        self.asked = {}
        self.released = False

    def isOpened(self):  # noqa: N802  OpenCV's name
        return True

    def grab(self):
        return bool(self.frames)

    def retrieve(self):
        image = self.frames.pop(0)
        return image is not None, image

    def get(self, of):
        if of == cv2.CAP_PROP_POS_MSEC:
            return self.stamp_ms
        return MJPG if self.knows_mjpg and of == cv2.CAP_PROP_FOURCC else 0.0

    def set(self, what, value):
        self.asked[what] = value
        return True

    def release(self):
        self.released = True


def fetch(*frames, is_local=True, stamp_ms=0.0):
    capture = DeviceCapture(FakeVideo(*frames, stamp_ms=stamp_ms), is_local, lambda: NOW_NS)
    capture.wait()
    return capture.fetch()


def test_a_kernels_time_stamp_is_an_age():
    grabbed = fetch(PICTURE, stamp_ms=89_960.0)
    assert grabbed.age_ns == 40 * NS_PER_MS
    np.testing.assert_array_equal(grabbed.image, PICTURE)


def test_a_far_cameras_time_stamp_is_on_its_own_clock():
    grabbed = fetch(PICTURE, is_local=False, stamp_ms=120.0)
    assert (grabbed.stamp_ns, grabbed.age_ns) == (120 * NS_PER_MS, None)


def test_a_device_without_time_stamps_gives_none():
    assert (fetch(PICTURE).stamp_ns, fetch(PICTURE).age_ns) == (None, None)


def test_a_jpeg_that_comes_as_bytes_is_decoded_by_us():
    grabbed = fetch(JPEG.reshape(1, -1))
    np.testing.assert_array_equal(grabbed.image, cv2.imdecode(JPEG, cv2.IMREAD_COLOR))


@pytest.mark.parametrize(
    ("frame", "said"),
    [(JPEG.reshape(1, -1)[:, :-40], "a frame: expected a whole JPEG"), (None, "cannot be decoded")],
)
def test_a_damaged_frame_is_not_the_end_of_the_camera(frame, said):
    with pytest.raises(DamagedFrameError, match=said):
        fetch(frame)


def test_a_device_that_gives_nothing_more_is_gone_and_let_go():
    video = FakeVideo()
    capture = DeviceCapture(video, is_local=True)
    with pytest.raises(EyeError, match="delivers no more frames"):
        capture.wait()
    capture.close()
    assert video.released


def test_a_usb_camera_is_asked_for_the_size_the_rate_and_its_own_jpegs():
    video = FakeVideo()
    set_up(video, (1920, 1080), 30.0)
    assert list(video.asked.items()) == [
        (cv2.CAP_PROP_FOURCC, MJPG),
        (cv2.CAP_PROP_FRAME_WIDTH, 1920),
        (cv2.CAP_PROP_FRAME_HEIGHT, 1080),
        (cv2.CAP_PROP_FPS, 30.0),
        (cv2.CAP_PROP_CONVERT_RGB, 0),
    ]


def test_a_usb_camera_without_jpegs_is_left_to_opencv():
    video = FakeVideo(knows_mjpg=False)
    set_up(video, None, None)
    assert list(video.asked) == [cv2.CAP_PROP_FOURCC]


def test_a_usb_camera_that_is_not_there_is_said():
    with pytest.raises(EyeError, match=r"^not there$"):
        open_usb("/dev/video-none", None, None)


def test_what_is_no_camera_is_said(tmp_path, capfd):
    path = tmp_path / "no-camera"
    path.write_bytes(b"")
    with pytest.raises(EyeError, match="it is no camera"):
        open_usb(str(path), None, None)


def test_an_address_where_nobody_answers_is_said(capfd):
    with pytest.raises(EyeError, match="no answer, or no stream"):
        open_rtsp("rtsp://127.0.0.1:9/none")


@pytest.mark.parametrize(
    ("jetson", "of"), [(True, "nvarguscamerasrc sensor-id=1"), (False, "libcamerasrc")]
)
def test_a_csi_camera_is_a_pipeline_that_keeps_only_the_newest_frame(jetson, of):
    pipeline = csi_pipeline(1, (1280, 720), 30.0, jetson)
    assert pipeline.startswith(of)
    assert "width=1280, height=720, framerate=30/1" in pipeline
    assert pipeline.endswith("appsink drop=true max-buffers=1 sync=false")
