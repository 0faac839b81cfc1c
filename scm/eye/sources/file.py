"""Frames from a film or a still picture, at the film's own pace."""

from pathlib import Path

import cv2
import numpy as np

from scm.clock import NS_PER_S
from scm.errors import EyeError
from scm.eye.picture import read_picture
from scm.eye.source import Frame
from scm.v2x.messages.world_snapshot import WorldSnapshot

STILLS = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff")


class FileSource:
    """Plays a file once: a film's frames are exposed at its own rate from the first `take` on.

    Args:
        path: Any picture or film that OpenCV reads; a picture is one frame.

    Raises:
        EyeError: The file is missing, cut short or cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        if not path.is_file():
            raise EyeError(f"{path}: expected a picture or film, found no file")
        self._still = read_picture(path) if path.suffix.lower() in STILLS else None
        self._film = None if self._still is not None else cv2.VideoCapture(str(path))
        self._rate_hz = self._film.get(cv2.CAP_PROP_FPS) if self._film is not None else 1.0
        if self._film is not None and (not self._film.isOpened() or self._rate_hz <= 0.0):
            raise EyeError(f"{path}: expected a picture or film that OpenCV reads")
        self._started_ns: int | None = None
        self._played = 0

    def take(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the film's frame that is due, leaving out those already late; None when over."""
        del light
        if self._started_ns is None:
            self._started_ns = now_ns
        if self._film is None:
            return self._take_still(now_ns)
        due = int((now_ns - self._started_ns) * self._rate_hz // NS_PER_S)
        if self._played > due:
            return None
        while self._played < due and self._film.grab():
            self._played += 1
        good, image = self._film.read()
        exposed_ns = self._started_ns + round(self._played * NS_PER_S / self._rate_hz)
        self._played += 1
        return Frame(exposed_ns, np.asarray(image, dtype=np.uint8)) if good else None

    def _take_still(self, now_ns: int) -> Frame | None:
        if self._still is None or self._played:
            return None
        self._played = 1
        return Frame(now_ns, self._still)
