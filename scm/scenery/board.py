"""Calibration boards: a chessboard, a ChArUco board, or a grid of tags."""

from dataclasses import dataclass
from typing import Literal

import cv2

from scm.errors import EyeError
from scm.scenery.tags import TAG_COUNT

Kind = Literal["chessboard", "charuco", "tags"]
KINDS: tuple[Kind, ...] = ("chessboard", "charuco", "tags")
LARGEST_COUNT = 60


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
            charuco_board(self)

    @property
    def description(self) -> str:
        """What it is, in words."""
        if self.kind == "tags":
            return f"{self.columns} x {self.rows} tags from id {self.first_id}"
        inner = f"{self.columns - 1} x {self.rows - 1} inner corners"
        return f"{self.kind} of {self.columns} x {self.rows} squares ({inner})"


def charuco_board(board: Board) -> cv2.aruco.CharucoBoard:
    """Return OpenCV's own description of a ChArUco board, in metres.

    Raises:
        EyeError: OpenCV has no such markers, or too few of them.
    """
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
    return cv2.aruco.CharucoBoard(size, board.square_m, marker, dictionary)
