"""What was printed to calibrate with, and finding it in a picture.

The board's frame lies in its plane: x to the print's right, y to its top, z out of the print for a
grid of tags; OpenCV's boards count y downwards. Only distances matter to a calibration, so each
kind keeps its own.
"""

from dataclasses import dataclass
from functools import cache
from typing import Literal

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.errors import EyeError
from scm.eye.detect import Settings, detect_tags
from scm.scenery.tags import TAG_COUNT, tag_corners

Kind = Literal["chessboard", "charuco", "tags"]
KINDS: tuple[Kind, ...] = ("chessboard", "charuco", "tags")
LEAST_POINTS = 8
"""In one picture: a view has six unknowns of its own."""
LARGEST_COUNT = 60
_FIND = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE


@dataclass(frozen=True, slots=True)
class Board:
    """A printed board.

    Attributes:
        kind: Chessboard, ChArUco (a chessboard with small markers) or a grid of tag36h11 tags.
        columns, rows: Its squares, or its tags.
        square_m: Edge of a square; of a grid of tags from one tag's middle to the next one's.
        marker_m: Black edge of a marker or tag; a plain chessboard has none.
        dictionary: Which markers a ChArUco board carries, by OpenCV's name.
        first_id: Of a grid of tags, at its lower left; they count to the right, then upwards.

    Raises:
        EyeError: There can be no such board.
    """

    kind: Kind
    columns: int
    rows: int
    square_m: float
    marker_m: float | None = None
    dictionary: str = "DICT_4X4_50"
    first_id: int = 0

    def __post_init__(self) -> None:
        """Refuse what cannot be printed."""
        least = 2 if self.kind == "tags" else 3
        shortest, longest = min(self.columns, self.rows), max(self.columns, self.rows)
        if shortest < least or longest > LARGEST_COUNT:
            got = f"{self.columns}x{self.rows}"
            raise EyeError(
                f"board: squares: expected {least} to {LARGEST_COUNT} each way, got {got}"
            )
        if not self.square_m > 0.0:
            raise EyeError(f"board: square_m: expected above 0, got {self.square_m}")
        if self.kind == "chessboard":
            return
        if self.marker_m is None or not 0.0 < self.marker_m < self.square_m:
            wanted = f"above 0 and below the square's {self.square_m}"
            raise EyeError(f"board: marker_m: expected {wanted}, got {self.marker_m}")
        last = self.first_id + self.columns * self.rows - 1
        if self.kind == "tags" and not 0 <= self.first_id <= last < TAG_COUNT:
            raise EyeError(f"board: tag ids: expected 0 to {TAG_COUNT - 1}, got up to {last}")
        if self.kind == "charuco":
            _charuco(self)

    @property
    def said(self) -> str:
        """What it is, in words."""
        if self.kind == "tags":
            return f"{self.columns} x {self.rows} tags from id {self.first_id}"
        inner = f"{self.columns - 1} x {self.rows - 1} inner corners"
        return f"{self.kind} of {self.columns} x {self.rows} squares ({inner})"


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The board in one picture.

    Attributes:
        name: Of the picture, for reports.
        points: Places on the board, (n, 3) [m], z 0.
        pixels: Where they were found, (n, 2) [px].
        tags: Whether each four are where straight lines through the sides of a tag meet.
    """

    name: str
    points: Floats
    pixels: Floats
    tags: bool = False


def find_board(board: Board, grey: Image, name: str) -> View | None:
    """Return the board in a grey picture (height, width); None: not to be seen, or too little."""
    if board.kind == "chessboard":
        found = _find_chessboard(board, grey)
    elif board.kind == "charuco":
        found = _find_charuco(board, grey)
    else:
        found = _find_tags(board, grey)
    if found is None or len(found[0]) < LEAST_POINTS:
        return None
    flat, pixels = found
    straight = np.linalg.matrix_rank(flat - flat.mean(axis=0), tol=1e-6 * board.square_m) < 2
    if straight:
        return None
    points = np.column_stack((flat, np.zeros(len(flat))))
    return View(name, points, pixels, tags=board.kind == "tags")


def chessboard_corners(board: Board) -> Floats:
    """Return the inner corners in OpenCV's order: right, then down; (n, 2) [m]."""
    across, down = np.meshgrid(np.arange(1, board.columns), np.arange(1, board.rows))
    corners = np.column_stack((across.ravel(), down.ravel())).astype(np.float64)
    return corners * board.square_m


def grid_corners(board: Board) -> dict[int, Floats]:
    """Return the corners of each tag of a grid, (4, 2) [m] from the lower left tag's middle."""
    one = tag_corners(board.marker_m or 0.0)
    return {
        board.first_id + row * board.columns + column: one
        + np.array([column, row]) * board.square_m
        for row in range(board.rows)
        for column in range(board.columns)
    }


def _find_chessboard(board: Board, grey: Image) -> tuple[Floats, Floats] | None:
    size = (board.columns - 1, board.rows - 1)
    good, corners = cv2.findChessboardCornersSB(grey, size, flags=_FIND)
    if not good:
        return None
    return chessboard_corners(board), np.asarray(corners, dtype=np.float64).reshape(-1, 2)


def _find_charuco(board: Board, grey: Image) -> tuple[Floats, Floats] | None:
    detector = _charuco(board)
    corners, ids, _, _ = detector.detectBoard(grey)
    if ids is None or not len(ids):
        return None
    places = np.asarray(detector.getBoard().getChessboardCorners(), dtype=np.float64)[:, :2]
    return places[np.ravel(ids)], np.asarray(corners, dtype=np.float64).reshape(-1, 2)


def _find_tags(board: Board, grey: Image) -> tuple[Floats, Floats] | None:
    places = grid_corners(board)
    seen = [tag for tag in detect_tags(grey, Settings(max_hamming=0)) if tag.tag_id in places]
    if not seen:
        return None
    flat = np.concatenate([places[tag.tag_id] for tag in seen])
    return flat, np.concatenate([np.array(tag.corners_px) for tag in seen])


@cache
def _charuco(board: Board) -> cv2.aruco.CharucoDetector:
    named = getattr(cv2.aruco, board.dictionary, None)
    if not isinstance(named, int) or not board.dictionary.startswith("DICT_"):
        raise EyeError(
            f"board: dictionary: expected a name as DICT_4X4_50, got {board.dictionary!r}"
        )
    dictionary = cv2.aruco.getPredefinedDictionary(named)
    markers, holds = board.columns * board.rows // 2, len(dictionary.bytesList)
    if markers > holds:
        raise EyeError(f"board: {board.dictionary} holds {holds} markers, the board has {markers}")
    size, marker = (board.columns, board.rows), board.marker_m or 0.0
    return cv2.aruco.CharucoDetector(
        cv2.aruco.CharucoBoard(size, board.square_m, marker, dictionary)
    )
