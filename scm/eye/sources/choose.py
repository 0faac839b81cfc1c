"""Creates a source from the text of `--frames`."""

import re
from functools import partial
from pathlib import Path
from urllib.parse import urlsplit

from scm.errors import EyeError
from scm.eye.source import Source
from scm.eye.sources.bus import BusSource
from scm.eye.sources.device import (
    csi_pipeline,
    has_gstreamer,
    is_jetson,
    open_csi,
    open_rtsp,
    open_usb,
)
from scm.eye.sources.file import FileSource
from scm.eye.sources.folder import DEFAULT_RATE_HZ, FolderSource
from scm.eye.sources.live import LiveSource
from scm.eye.sources.mjpeg import MjpegCapture

MAX_DELAY_S = 10.0
FORMS = (
    "0 or /dev/video0 (USB), csi:0, rtsp://..., http://... (MJPEG), "
    "a film, a picture, a folder of pictures, bus:CAMERA"
)


def source_of(
    text: str,
    *,
    size_px: tuple[int, int] | None = None,
    rate_hz: float | None = None,
    loop: bool = False,
    delay_s: float = 0.0,
) -> Source:
    """Return the source for a text; a live one starts with its first `read`.

    Args:
        text: One of `FORMS`.
        size_px: Width and height to request from a USB or CSI camera.
        rate_hz: Frame rate to request from such a camera, or to play a folder without times.
        loop: Whether films and folders restart at their end.
        delay_s: Minimum delay from exposure to arrival, for cameras without usable stamps.

    Raises:
        EyeError: It names no possible source.
        MessageError: `bus:` with a name that is not valid in a key.
    """
    if not 0.0 <= delay_s < MAX_DELAY_S:
        longest = round(MAX_DELAY_S * 1e3)
        raise EyeError(f"--delay-ms: expected 0 to {longest}, got {delay_s * 1e3:g}")
    live = _live(text, size_px, rate_hz, delay_s)
    if live is not None:
        return live
    if text.startswith("bus:"):
        return BusSource(text.removeprefix("bus:"), delay_s)
    path = Path(text)
    if text and path.is_dir():
        return FolderSource(path, DEFAULT_RATE_HZ if rate_hz is None else rate_hz, loop)
    if path.is_file() or (path.suffix and ":" not in text):
        return FileSource(path, loop)
    raise EyeError(f"--frames: expected {FORMS}; got {text!r}")


def _live(
    text: str, size_px: tuple[int, int] | None, rate_hz: float | None, delay_s: float
) -> LiveSource | None:
    if re.fullmatch(r"\d{1,3}|/dev/.+", text):
        device = f"/dev/video{int(text)}" if text.isdigit() else text
        return LiveSource(device, partial(open_usb, device, size_px, rate_hz), delay_s)
    if text.startswith("csi:"):
        pipeline = csi_pipeline(_csi_number(text), size_px, rate_hz, is_jetson())
        return LiveSource(text, partial(open_csi, pipeline), delay_s)
    scheme = text.partition("://")[0].lower() if "://" in text else ""
    if scheme in ("rtsp", "rtsps"):
        return LiveSource(_without_password(text), partial(open_rtsp, text), delay_s)
    if scheme in ("http", "https"):
        return LiveSource(_without_password(text), partial(MjpegCapture, text), delay_s)
    return None


def _csi_number(text: str) -> int:
    number = text.removeprefix("csi:")
    if not re.fullmatch(r"\d{1,2}", number):
        raise EyeError(f"--frames: expected csi: and a number, as csi:0; got {text!r}")
    if not has_gstreamer():
        raise EyeError(
            f"--frames {text}: expected an OpenCV that was built with GStreamer, got one without; "
            "give the camera as /dev/video0, or its pictures over the bus (bus:CAMERA)"
        )
    return int(number)


def _without_password(address: str) -> str:
    """Return an address without its password.

    Raises:
        EyeError: It has no host, or an invalid port.
    """
    try:
        url = urlsplit(address)
        host, port = url.hostname, url.port
    except ValueError as cause:
        raise EyeError(f"--frames: expected the address of a camera, got {address!r}") from cause
    if not host:
        raise EyeError(f"--frames: expected a host in the address, got {address!r}")
    return url._replace(netloc=host if port is None else f"{host}:{port}").geturl()
