"""Prints for the Eye at true size: roof tags of named cars, the map's tag, and boards.

Each tag is upright as in `scm.scenery.tags`: the right of the print is the front of the car, or the
x of the map. OpenCV and many web pages draw the family turned by 180 degrees.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from scm.arrays import Bools
from scm.errors import EyeError, nearest
from scm.maps.vehicle_tags import bound_tag
from scm.records.city_map import CityMap
from scm.scenery.board import Board, charuco_board
from scm.scenery.bodies import car_body
from scm.scenery.paper import PAPERS_MM, Page, Rectangle
from scm.scenery.tags import CELLS, MARGIN_CELLS, PRINT_SCALE, tag_picture
from scm.vehicles.car_files import car_files

MARGIN_MM = 6.0
"""Most printers leave 4 to 6 mm of each edge white."""
FOOT_MM = 10.0
"""For the ruler and its words, at the foot of each page."""
WORDS_MM = 22.0
"""For the arrow and the words below a tag."""
BOARD_WORDS_MM = 5.0


@dataclass(frozen=True, slots=True)
class TagPrint:
    """One tag to be printed.

    Attributes:
        size_m: Edge of its black square.
        title: Whose it is.
        right: What the right of the print is.
        note: More about it.
    """

    tag_id: int
    size_m: float
    title: str
    right: str
    note: str = ""


def vehicle_print(city_map: CityMap, vehicle: str, car: str, worn: int | None = None) -> TagPrint:
    """Return the roof tag of a car.

    Args:
        city_map: Binds names to tags.
        vehicle: Its name.
        car: Its car file.
        worn: The tag that it has in the running city; None: by its car file, else by its name.

    Raises:
        EyeError: There is no such car file, its roof has no tag, or no tag is bound to its name.
    """
    if car not in car_files():
        wanted = ", ".join(sorted(car_files()))
        raise EyeError(
            f"car file {car!r}: expected one of {wanted}{nearest(car, list(car_files()))}"
        )
    body = car_body(car)
    if not body.has_tag:
        raise EyeError(f"car {car!r}: expected [ips] with position_m and tag_size_m, got none")
    tag_id = next(
        (one for one in (worn, body.tag_id, bound_tag(city_map, vehicle)) if one is not None), None
    )
    if tag_id is None:
        raise EyeError(
            f"vehicle {vehicle!r}: no tag is bound to this name: add [[vehicle_tags]] with vehicle "
            f'= "{vehicle}" and tag_id to the map file, or use a name as n1, n2'
        )
    return TagPrint(tag_id, body.tag_size, vehicle, "front of the car", f"car {car}")


def map_print(city_map: CityMap) -> TagPrint:
    """Return the tag that lies on the floor and defines the map's frame."""
    tag = city_map.tag
    at = f"middle at x {tag.x_m:g} m, y {tag.y_m:g} m, turned by {tag.yaw_rad:g} rad"
    return TagPrint(
        tag.tag_id, tag.size_m, f"floor of {city_map.name}", "x of the map", f"{at}, facing up"
    )


def tag_pages(prints: Sequence[TagPrint], paper: str = "A4") -> list[Page]:
    """Return pages of tags, as many on each as fit, with a ruler.

    Raises:
        EyeError: There is nothing to print, no such paper, or a tag is larger than it.
    """
    pages: list[Page] = []
    room = 0.0
    if not prints:
        raise EyeError("print: expected a vehicle, the map's tag or a tag's id, got none")
    for one in prints:
        edge = 1e3 * one.size_m * PRINT_SCALE
        _check_fit(edge, edge + WORDS_MM, paper, f"tag {one.tag_id} with its margin")
        if not pages or edge + WORDS_MM > room:
            pages.append(_page(paper))
            room = pages[-1].height_mm - 2.0 * MARGIN_MM - FOOT_MM
        top = MARGIN_MM + FOOT_MM + room
        _draw_tag(pages[-1], one, MARGIN_MM, top - edge)
        room -= edge + WORDS_MM
    return pages


def board_page(board: Board, paper: str = "A4") -> Page:
    """Return a page with a board, turned to the paper's longer side if it fits only so.

    Raises:
        EyeError: There is no such paper, or the board is larger than it.
    """
    kind, columns, rows = board.kind, board.columns, board.rows
    square = 1e3 * board.square_m
    if kind == "chessboard":
        shapes: list[tuple[Rectangle, ...]] = [_chessboard(columns, rows, square)]
    elif kind == "charuco":
        shapes = _charuco(board)
    else:
        shapes = _tag_grid(board)
    width, height = columns * square, rows * square
    page = _page(paper)
    if width > page.width_mm - 2.0 * MARGIN_MM:
        page = _page(paper, turned=True)
    _check_fit(width, height + BOARD_WORDS_MM, paper, f"the board of {width:g} x {height:g} mm",
               (page.width_mm, page.height_mm))  # fmt: skip
    left = (page.width_mm - width) / 2.0
    bottom = MARGIN_MM + FOOT_MM + BOARD_WORDS_MM
    page.shapes = [_placed(shape, left, bottom) for shape in shapes]
    option = f" --marker-m {board.marker_m:g}" if board.marker_m else ""
    option += f" --dictionary {board.dictionary}" if kind == "charuco" else ""
    option += f" --first-id {board.first_id}" if kind == "tags" and board.first_id else ""
    words = f"scm eye calibrate --board {kind} --squares {columns}x{rows}"
    words += f" --square-m {board.square_m:g}{option}"
    page.texts.append((MARGIN_MM, MARGIN_MM + FOOT_MM + 1.0, 3.0, words))
    return page


def _page(paper: str, *, turned: bool = False) -> Page:
    width, height = PAPERS_MM[_known(paper)][:: -1 if turned else 1]
    page = Page(width, height)
    page.ruler(MARGIN_MM, MARGIN_MM + 4.0)
    return page


def _known(paper: str) -> str:
    if paper not in PAPERS_MM:
        raise EyeError(f"paper: expected one of {', '.join(PAPERS_MM)}, got {paper!r}")
    return paper


def _check_fit(
    width: float, height: float, paper: str, what: str, size: tuple[float, float] | None = None
) -> None:
    across, up = size or PAPERS_MM[_known(paper)]
    if width > across - 2.0 * MARGIN_MM or height > up - 2.0 * MARGIN_MM - FOOT_MM:
        short, long = sorted((width, height + FOOT_MM))
        fits = [
            name
            for name, one in PAPERS_MM.items()
            if short + 2.0 * MARGIN_MM <= min(one) and long + 2.0 * MARGIN_MM <= max(one)
        ]
        wanted = f"paper {fits[0]}" if fits else "something smaller: no paper here is so large"
        raise EyeError(f"{what} does not fit paper {paper}: expected {wanted}")


def _draw_tag(page: Page, one: TagPrint, left: float, bottom: float) -> None:
    """Draw a print whose white margin begins there, with its words below."""
    cell = 1e3 * one.size_m / CELLS
    edge = 1e3 * one.size_m * PRINT_SCALE
    page.shapes.append(_placed(_cells(tag_picture(one.tag_id, 1) < 128, cell), left, bottom))
    page.frame(left, bottom, edge)
    page.arrow(left, bottom - 5.0, 25.0)
    page.texts += [
        (left + 28.0, bottom - 6.0, 3.5, one.right),
        (left, bottom - 13.0, 5.0, f"{one.title} - tag {one.tag_id}"),
        (left, bottom - 18.0, 3.0, f"tag36h11, black edge {1e3 * one.size_m:g} mm" +
         (f", {one.note}" if one.note else "")),
    ]  # fmt: skip


def _cells(black: Bools, cell: float) -> tuple[Rectangle, ...]:
    """Return runs of black cells of a picture, (rows from the top, columns), as rectangles."""
    height = len(black)
    found: list[Rectangle] = []
    for row, line in enumerate(black):
        edges = np.flatnonzero(np.diff(np.concatenate(([False], line, [False])).astype(np.int8)))
        found += [
            (float(start) * cell, (height - 1 - row) * cell, float(end - start) * cell, cell)
            for start, end in edges.reshape(-1, 2)
        ]
    return tuple(found)


def _placed(shape: Sequence[Rectangle], left: float, bottom: float) -> tuple[Rectangle, ...]:
    return tuple((left + x, bottom + y, across, up) for x, y, across, up in shape)


def _chessboard(columns: int, rows: int, square: float) -> tuple[Rectangle, ...]:
    """Return the black squares; that at the upper left is black, as OpenCV has it."""
    return _cells(np.indices((rows, columns)).sum(axis=0) % 2 == 0, square)


def _tag_grid(board: Board) -> list[tuple[Rectangle, ...]]:
    """Return the tags of a grid, the first at the lower left, to the right and then upwards."""
    columns, rows = board.columns, board.rows
    square, marker = 1e3 * board.square_m, 1e3 * (board.marker_m or 0.0)
    shapes = []
    for number in range(columns * rows):
        row, column = divmod(number, columns)
        black = tag_picture(board.first_id + number, 1)[MARGIN_CELLS:-MARGIN_CELLS, :] < 128
        cells = _cells(black[:, MARGIN_CELLS:-MARGIN_CELLS], marker / CELLS)
        margin = (square - marker) / 2.0
        shapes.append(_placed(cells, column * square + margin, row * square + margin))
    return shapes


def _charuco(board: Board) -> list[tuple[Rectangle, ...]]:
    """Return the shapes of OpenCV's ChArUco board; its y goes down, ours up."""
    theirs = charuco_board(board)
    columns, rows, square = board.columns, board.rows, 1e3 * board.square_m
    marker, family = 1e3 * (board.marker_m or 0.0), theirs.getDictionary()
    corners = 1e3 * np.array(theirs.getObjPoints())[..., :2]
    lows, highs = corners.min(axis=1), corners.max(axis=1)
    cells = family.markerSize + 2
    white = np.zeros((rows, columns), dtype=np.bool_)
    shapes = []
    for number, low, high in zip(np.ravel(theirs.getIds()), lows, highs, strict=True):
        column, row = ((low + high) / 2.0 // square).astype(int)
        white[row, column] = True
        bits = cv2.aruco.generateImageMarker(family, int(number), cells) < 128
        shapes.append(
            _placed(_cells(bits, marker / cells), float(low[0]), rows * square - float(high[1]))
        )
    return [_cells(~white, square), *shapes]
