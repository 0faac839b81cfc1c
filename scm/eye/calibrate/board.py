"""Finds the printed calibration board in a picture.

The board's frame lies in its plane: x to the print's right, y to its top, z out of the print for a
grid of tags; OpenCV's boards count y downwards. Only distances matter to a calibration, so each
kind uses its own.
"""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.eye.detect import Settings, detect_tags
from scm.scenery.board import Board, charuco_board
from scm.scenery.tags import tag_corners

LEAST_POINTS = 8
"""Minimum in one picture: a view has six unknowns of its own."""
_FIND = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The board in one picture.

    Attributes:
        name: Of the picture, for reports.
        points: Places on the board, (n, 3) [m], z 0.
        pixels: Where they were detected, (n, 2) [px].
        tags: Whether each four are intersections of lines through the sides of a tag.
    """

    name: str
    points: Floats
    pixels: Floats
    tags: bool = False


def find_board(board: Board, grey: Image, name: str) -> View | None:
    """Return the board in a grey picture (height, width); None if too little is found."""
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
    return cv2.aruco.CharucoDetector(charuco_board(board))
