"""Views of a board from pictures, a film or a live camera.

All pictures are used. Of a film or a camera only frames in which the board is at a new place and
still: a moving board is blurred, and a rolling shutter distorts it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from scm.arrays import Image
from scm.errors import EyeError
from scm.eye.calibrate.board import View, find_board
from scm.eye.picture import read_picture
from scm.eye.source import grey_of
from scm.scenery.board import Board

FILMS = (".mp4", ".avi", ".mkv", ".mov", ".webm", ".m4v", ".mpg", ".mjpeg")
NEW_SHARE = 0.05
"""Minimum distance from every view used so far, over the frame's width."""
STILL_SHARE = 0.002
"""Maximum movement since the previous frame, likewise."""
SAMPLE_HZ = 10.0  # frames of a film that are searched
MAX_VIEWS = 80  # of a film: more take long and add nothing

Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Gathered:
    """Views, the size of their frames [px], and remarks on what was left out."""

    views: tuple[View, ...]
    size: tuple[int, int]
    remarks: tuple[str, ...]


def from_files(board: Board, paths: Sequence[Path], progress: Progress) -> Gathered:
    """Return the views in pictures, or in one film.

    Raises:
        EyeError: A file cannot be read, sizes differ, or the board is in none of them.
    """
    films = [path for path in paths if path.suffix.lower() in FILMS]
    if not films:
        return _from_pictures(board, paths, progress)
    if len(paths) > 1:
        raise EyeError(f"{films[0]}: expected pictures or one film, got {len(paths)} files")
    if not films[0].is_file():
        raise EyeError(f"{films[0]}: expected a film, found no file")
    film = cv2.VideoCapture(str(films[0]))
    step = max(1, round(film.get(cv2.CAP_PROP_FPS) / SAMPLE_HZ))
    return _from_frames(board, str(films[0]), _frames(film, step), MAX_VIEWS, progress)


def from_camera(board: Board, number: int, wanted: int, progress: Progress) -> Gathered:
    """Return `wanted` views from a live camera; Ctrl-C ends the session with those there are.

    Raises:
        EyeError: There is no such camera, or it did not see the board.
    """
    camera = cv2.VideoCapture(number)
    if not camera.isOpened():
        raise EyeError(f"camera {number}: expected a camera that OpenCV opens, found none")
    return _from_frames(board, f"camera {number}", _frames(camera, 1), wanted, progress)


def _from_pictures(board: Board, paths: Sequence[Path], progress: Progress) -> Gathered:
    views: list[View] = []
    remarks: list[str] = []
    size, first = (0, 0), None
    for i, path in enumerate(paths):
        progress(f"picture {i + 1} of {len(paths)}, board in {len(views)}")
        grey = grey_of(read_picture(path))
        got = (grey.shape[1], grey.shape[0])
        if first is not None and got != size:
            wanted = f"{size[0]} x {size[1]} px as {first}"
            raise EyeError(f"{path}: expected {wanted}, got {got[0]} x {got[1]}")
        size, first = got, first or path
        view = find_board(board, grey, str(path))
        if view is None:
            remarks.append(f"{path}: no {board.description}")
        else:
            views.append(view)
    if not views:
        raise EyeError(_nothing(board, f"{len(paths)} pictures"))
    return Gathered(tuple(views), size, tuple(remarks))


def _from_frames(
    board: Board, name: str, frames: Iterator[tuple[int, Image]], wanted: int, progress: Progress
) -> Gathered:
    views: list[View] = []
    last, found, size = None, 0, (0, 0)
    try:
        for number, grey in frames:
            size = (grey.shape[1], grey.shape[0])
            view = find_board(board, grey, f"frame {number}")
            found += view is not None
            if view is not None and last is not None and _is_new(view, last, views, size[0]):
                views.append(view)
            last = view
            seen = "held still?" if view is not None else "no board"
            progress(f"{name}: frame {number}, {len(views)} of {wanted} views, {seen}")
            if len(views) >= wanted:
                break
    except KeyboardInterrupt:
        progress(f"{name}: ended with {len(views)} views")
    if not size[0]:
        raise EyeError(f"{name}: expected frames that OpenCV reads, got none")
    if not views and found:
        raise EyeError(
            f"{name}: the board is in {found} frames, but held still in none: stop for half a "
            "second at each new place"
        )
    if not views:
        raise EyeError(_nothing(board, name))
    return Gathered(tuple(views), size, ())


def _is_new(view: View, last: View, views: Sequence[View], width: int) -> bool:
    still = _moved(view, last) <= STILL_SHARE * width
    return still and all(_moved(view, other) >= NEW_SHARE * width for other in views)


def _moved(one: View, other: View) -> float:
    """Return the mean movement of the points that two views share [px]."""
    before = {tuple(p): at for p, at in zip(other.points.tolist(), other.pixels, strict=True)}
    gone = [
        float(np.hypot(*(at - before[tuple(p)])))
        for p, at in zip(one.points.tolist(), one.pixels, strict=True)
        if tuple(p) in before
    ]
    return float(np.mean(gone)) if gone else float("inf")


def _frames(capture: cv2.VideoCapture, step: int) -> Iterator[tuple[int, Image]]:
    """Yield every `step`-th frame with its number, in grey."""
    number = 0
    try:
        while capture.grab():
            if number % step == 0:
                good, image = capture.retrieve()
                if good:
                    yield number, grey_of(np.asarray(image, dtype=np.uint8))
            number += 1
    finally:
        capture.release()


def _nothing(board: Board, where: str) -> str:
    hint = ""
    if board.kind != "tags":
        more = f"{board.columns + 1}x{board.rows + 1}"
        hint = f" (--squares counts squares: a board of {board.columns} x {board.rows} inner "
        hint += f"corners is {more})"
    return f"{where}: expected a {board.description}, found none{hint}"
