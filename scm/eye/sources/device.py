"""Cameras that OpenCV opens: USB (V4L2), CSI (GStreamer), RTSP (FFmpeg)."""

import os
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np

from scm.arrays import Image
from scm.clock import NS_PER_MS
from scm.errors import EyeError
from scm.eye.picture import decode_picture
from scm.eye.sources.capture import DamagedFrameError, Grabbed

OPEN_TIMEOUT_MS, READ_TIMEOUT_MS = 3000, 2000
MJPG = float(cv2.VideoWriter.fourcc(*"MJPG"))
_TEGRA = Path("/etc/nv_tegra_release")


class VideoCapture(Protocol):
    """The part of `cv2.VideoCapture` that is used."""

    def isOpened(self) -> bool: ...  # noqa: N802, D102  OpenCV's name

    def grab(self) -> bool: ...  # noqa: D102

    def retrieve(self) -> tuple[bool, Any]: ...  # noqa: D102

    def get(self, propId: int, /) -> float: ...  # noqa: N803, D102

    def set(self, propId: int, value: float, /) -> bool: ...  # noqa: N803, D102

    def release(self) -> None: ...  # noqa: D102


class DeviceCapture:
    """An opened camera of OpenCV.

    Args:
        video: The opened device.
        is_local: Whether its time stamps are the kernel's, on the clock of `monotonic_ns`.
        monotonic_ns: That clock.
    """

    def __init__(
        self,
        video: VideoCapture,
        is_local: bool,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._video = video
        self._is_local = is_local
        self._monotonic_ns = monotonic_ns
        self._arrival_ns = 0

    def wait(self) -> None:
        """Wait for a frame, at most for the driver's own time limit."""
        if not self._video.grab():
            raise EyeError("it delivers no more frames")
        self._arrival_ns = self._monotonic_ns()

    def fetch(self) -> Grabbed:
        """Return the frame with the driver's time stamp."""
        good, image = self._video.retrieve()
        if not good or image is None:
            raise DamagedFrameError("a frame that cannot be decoded")
        stamp_ns = round(self._video.get(cv2.CAP_PROP_POS_MSEC) * NS_PER_MS)
        picture = _decoded(image)
        if stamp_ns <= 0:
            return Grabbed(picture)
        age_ns = self._arrival_ns - stamp_ns if self._is_local else None
        return Grabbed(picture, stamp_ns, age_ns)

    def interrupt(self) -> None:
        """Do nothing: OpenCV cannot be interrupted, its time limits end every wait."""

    def close(self) -> None:
        """Release the device."""
        self._video.release()


def open_usb(device: str, size_px: tuple[int, int] | None, rate_hz: float | None) -> DeviceCapture:
    """Open a V4L2 camera; frames are the camera's own JPEGs if it has them.

    Raises:
        EyeError: It does not exist, may not be read, or is no camera.
    """
    path = Path(device)
    if not path.exists():
        raise EyeError("not there")
    if not os.access(path, os.R_OK | os.W_OK):
        raise EyeError("no permission to read and write it (on Linux: join the group video)")
    os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "1")
    video = cv2.VideoCapture(device, cv2.CAP_V4L2)
    _check_opened(video, "it is no camera, or in use by another program")
    set_up(video, size_px, rate_hz)
    return DeviceCapture(video, is_local=True)


def set_up(video: VideoCapture, size_px: tuple[int, int] | None, rate_hz: float | None) -> None:
    """Request JPEGs of a size and rate from a USB camera; it may deliver something else.

    A USB 2 cable carries 1080p at 30 Hz only as JPEG. We decode them ourselves: OpenCV fills the
    missing part of a truncated frame with grey.
    """
    video.set(cv2.CAP_PROP_FOURCC, MJPG)
    if size_px is not None:
        video.set(cv2.CAP_PROP_FRAME_WIDTH, size_px[0])
        video.set(cv2.CAP_PROP_FRAME_HEIGHT, size_px[1])
    if rate_hz is not None:
        video.set(cv2.CAP_PROP_FPS, rate_hz)
    if video.get(cv2.CAP_PROP_FOURCC) == MJPG:
        video.set(cv2.CAP_PROP_CONVERT_RGB, 0)


def open_rtsp(address: str) -> DeviceCapture:
    """Open an IP camera's stream.

    Raises:
        EyeError: No answer, or no readable stream.
    """
    limits = [
        *(cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, OPEN_TIMEOUT_MS),
        *(cv2.CAP_PROP_READ_TIMEOUT_MSEC, READ_TIMEOUT_MS),
    ]
    video = cv2.VideoCapture(address, cv2.CAP_FFMPEG, limits)
    _check_opened(video, "no answer, or no stream that FFmpeg reads")
    return DeviceCapture(video, is_local=False)


def open_csi(pipeline: str) -> DeviceCapture:
    """Open a camera on a CSI cable by a GStreamer pipeline.

    Raises:
        EyeError: The pipeline does not start.
    """
    video = cv2.VideoCapture(pipeline, cv2.CAP_GSTREAMER)
    _check_opened(video, f"this GStreamer pipeline does not start: {pipeline}")
    return DeviceCapture(video, is_local=False)


def csi_pipeline(
    number: int, size_px: tuple[int, int] | None, rate_hz: float | None, is_jetson: bool
) -> str:
    """Return the GStreamer pipeline of a CSI camera of a Jetson, else of a Raspberry Pi."""
    size = f", width={size_px[0]}, height={size_px[1]}" if size_px else ""
    rate = f", framerate={round(rate_hz)}/1" if rate_hz else ""
    end = "video/x-raw, format=BGR ! appsink drop=true max-buffers=1 sync=false"
    if is_jetson:
        return (
            f"nvarguscamerasrc sensor-id={number} ! video/x-raw(memory:NVMM){size}{rate} "
            f"! nvvidconv ! video/x-raw, format=BGRx ! videoconvert ! {end}"
        )
    return f"libcamerasrc ! video/x-raw{size}{rate} ! videoconvert ! {end}"


def is_jetson() -> bool:
    """Return whether this computer is an NVIDIA Jetson."""
    return _TEGRA.exists()


def has_gstreamer() -> bool:
    """Return whether OpenCV was built with GStreamer."""
    return bool(re.search(r"GStreamer:\s+YES", cv2.getBuildInformation()))


def _check_opened(video: VideoCapture, text: str) -> None:
    if not video.isOpened():
        video.release()
        raise EyeError(text)


def _decoded(image: Image) -> Image:
    """Return the picture; without conversion a device delivers its JPEG as one row."""
    if 1 not in image.shape[:2]:
        return image
    try:
        return decode_picture(np.ascontiguousarray(image).tobytes(), "a frame")
    except EyeError as cause:
        raise DamagedFrameError(str(cause)) from cause
