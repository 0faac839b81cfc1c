"""`scm eye print`: tags and boards at true size, ready for a printer."""

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command
from scm.commands.eye_calibrate import squares

if TYPE_CHECKING:  # the command line starts without what draws tags
    from scm.records.city_map import CityMap
    from scm.scenery.paper import Page
    from scm.scenery.prints import TagPrint

MAX_RANGE = 200  # of names such as n1..n8


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "map", nargs="?", default="driving_school", metavar="MAP", help="map name or file"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="tags.pdf or .svg")
    parser.add_argument(
        "--vehicles", nargs="+", default=[], metavar="NAME",
        help="roof tags: n1 n2, n1..n8, or n3=f1tenth for a car file of its own",
    )  # fmt: skip
    parser.add_argument("--car", default="nigel", help="car file of the vehicles (%(default)s)")
    parser.add_argument("--map-tag", action="store_true", help="the tag on the floor")
    parser.add_argument(
        "--tags", nargs="+", type=int, default=[], metavar="ID", help="tags by number"
    )
    parser.add_argument(
        "--size-m", type=float, default=0.0762, metavar="M",
        help="black edge of the tags by number (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--board", choices=("chessboard", "charuco", "tags"), help="a board for `scm eye calibrate`"
    )
    parser.add_argument(
        "--squares", type=squares, default=(9, 6), metavar="9x6", help="of the board"
    )
    parser.add_argument("--square-m", type=float, default=0.03, metavar="M", help="(%(default)s)")
    parser.add_argument("--marker-m", type=float, default=0.022, metavar="M", help="(%(default)s)")
    parser.add_argument(
        "--dictionary", default="DICT_4X4_50", help="of a ChArUco board (%(default)s)"
    )
    parser.add_argument(
        "--first-id", type=int, default=0, metavar="ID", help="first id of a board of tags"
    )
    parser.add_argument("--paper", default="A4", help="A4 to A0, letter, tabloid (%(default)s)")


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import EyeError
    from scm.maps.load import load_map
    from scm.scenery.paper import pdf, svg
    from scm.scenery.prints import tag_pages

    form = arguments.out.suffix.lower()
    if form not in {".pdf", ".svg"}:
        raise EyeError(f"--out: expected a name that ends in .pdf or .svg, got {arguments.out}")
    if arguments.board and (arguments.vehicles or arguments.tags or arguments.map_tag):
        raise EyeError("--board: expected without tags: they go into another file")
    if arguments.board:
        pages = [_board(arguments)]
    else:
        prints = _prints(arguments, load_map(arguments.map))
        pages = tag_pages(prints, arguments.paper)
        for one in prints:
            print(f"tag {one.tag_id:3}  {1e3 * one.size_m:g} mm  {one.title}")
    if form == ".pdf":
        files = {arguments.out: pdf(pages)}
    elif len(pages) == 1:
        files = {arguments.out: svg(pages[0]).encode()}
    else:
        name = arguments.out
        files = {
            name.with_stem(f"{name.stem}-{number}"): svg(page).encode()
            for number, page in enumerate(pages, start=1)
        }
    for path, content in files.items():
        path.write_bytes(content)
        print(f"written to {path}: print at 100 % (actual size), then measure the ruler")
    return 0


def _prints(arguments: argparse.Namespace, city_map: "CityMap") -> "list[TagPrint]":
    from scm.errors import EyeError
    from scm.scenery.prints import TagPrint, map_print, vehicle_print

    if not arguments.size_m > 0.0:
        raise EyeError(f"--size-m: expected above 0, got {arguments.size_m}")
    prints = [map_print(city_map)] if arguments.map_tag else []
    for text in arguments.vehicles:
        names, _, car = text.partition("=")
        prints += [vehicle_print(city_map, name, car or arguments.car) for name in _names(names)]
    prints += [
        TagPrint(tag_id, arguments.size_m, f"tag36h11 {tag_id}", "x of the tag")
        for tag_id in arguments.tags
    ]
    ids = [one.tag_id for one in prints]
    twice = sorted({one for one in ids if ids.count(one) > 1})
    if twice:
        whose = ", ".join(one.title for one in prints if one.tag_id == twice[0])
        raise EyeError(f"tag {twice[0]}: expected it once, got it for {whose}")
    return prints


def _names(text: str) -> list[str]:
    """Return one name, or those of a range n1..n8."""
    found = re.fullmatch(r"([a-z_-]+)(\d{1,3})\.\.([a-z_-]*)(\d{1,3})", text)
    if found is None:
        return [text]
    first, last = int(found[2]), int(found[4])
    is_range = found[3] in {"", found[1]} and first <= last < first + MAX_RANGE
    return [f"{found[1]}{number}" for number in range(first, last + 1)] if is_range else [text]


def _board(arguments: argparse.Namespace) -> "Page":
    from scm.scenery.board import Board
    from scm.scenery.prints import board_page

    columns, rows = arguments.squares
    marker_m = None if arguments.board == "chessboard" else arguments.marker_m
    board = Board(
        arguments.board, columns, rows, arguments.square_m, marker_m, arguments.dictionary,
        arguments.first_id,
    )  # fmt: skip
    print(board.description)
    return board_page(board, arguments.paper)


COMMAND = Command(
    help="Print roof tags, the map's tag and boards at true size, as PDF or SVG with a ruler.",
    example="scm eye print driving_school --map-tag --vehicles n1..n8 --out tags.pdf",
    arguments=_arguments,
    run=_run,
)
