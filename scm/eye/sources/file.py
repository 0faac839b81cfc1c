"""Frames from a film or a still picture, at the film's own rate."""

from pathlib import Path

import cv2
import numpy as np

from scm.arrays import Image
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import EyeError
from scm.eye.picture import read_picture
from scm.eye.sources.folder import STILLS, FolderReel
from scm.eye.sources.player import Player, Reel


class FileSource(Player):
    """Plays a file: a film's frames follow its own time stamps from the first `read` on.

    Args:
        path: Any picture or film that OpenCV reads; a picture is one frame.
        loop: Whether to restart at the end; time continues.

    Raises:
        EyeError: The file is missing, truncated or unreadable.
    """

    def __init__(self, path: Path, loop: bool = False) -> None:
        if not path.is_file():
            raise EyeError(f"{path}: expected a picture or film, found no file")
        super().__init__(str(path), _reel(path), loop)


def _reel(path: Path) -> Reel:
    if path.suffix.lower() not in STILLS:
        return FilmReel(path)
    read_picture(path)
    return FolderReel([path], [0])


class FilmReel:
    """A film, read one frame ahead, since only that gives its time.

    Args:
        path: Any film that OpenCV reads.

    Raises:
        EyeError: It cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._film = cv2.VideoCapture(str(path))
        rate_hz = self._film.get(cv2.CAP_PROP_FPS)
        self._period_ns = round(NS_PER_S / rate_hz) if rate_hz > 0.0 else 0
        self._first_ns = 0
        self._last_ns = 0
        self._next_ns = self._ahead(None)
        if self._next_ns is None or self._period_ns == 0:
            self._film.release()
            raise EyeError(f"{path}: expected a picture or film that OpenCV reads")

    def next_ns(self) -> int | None:
        """Return the time of the next frame [ns], None at the end."""
        return self._next_ns

    def following_ns(self) -> int | None:
        """Return when the frame after the next is due [ns], by the film's rate."""
        return None if self._next_ns is None else self._next_ns + self._period_ns

    def skip(self) -> None:
        """Skip the next frame."""
        self._next_ns = self._ahead(self._next_ns)

    def show(self) -> Image:
        """Return the next frame; raises an `EyeError` where it cannot be decoded."""
        try:
            good, image = self._film.retrieve()
        except cv2.error:
            good, image = False, None
        self._next_ns = self._ahead(self._next_ns)
        if not good or image is None:
            raise EyeError(f"{self._path}: a frame that cannot be decoded")
        return np.asarray(image, dtype=np.uint8)

    def rewind(self) -> int:
        """Go back to the first frame; return how long after the previous first it is [ns]."""
        length_ns = self._last_ns + self._period_ns
        self._film.release()
        self._film = cv2.VideoCapture(str(self._path))
        self._next_ns = self._ahead(None)
        return length_ns

    def close(self) -> None:
        """Close the file."""
        self._film.release()

    def _ahead(self, before_ns: int | None) -> int | None:
        """Read one frame and return its time [ns]; by the film's rate if times do not ascend.

        Args:
            before_ns: Time of the previous frame, None for the first.
        """
        try:
            good = self._film.grab()
        except cv2.error:
            good = False
        if not good:
            return None
        t_ns = round(self._film.get(cv2.CAP_PROP_POS_MSEC) * NS_PER_MS)
        if before_ns is None:
            self._first_ns = t_ns
        t_ns -= self._first_ns
        if before_ns is not None and t_ns <= before_ns:
            t_ns = before_ns + self._period_ns
        self._last_ns = t_ns
        return t_ns
