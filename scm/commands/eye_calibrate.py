"""`scm eye calibrate`: measure a camera's lens with a printed board."""

import argparse
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:  # the command line starts without what finds boards
    from scm.eye.calibrate.gather import Gathered
    from scm.records.city_map import Camera
    from scm.scenery.board import Board


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "image", nargs="*", type=Path, metavar="IMAGE", help="pictures of the board, or one film"
    )
    parser.add_argument("--camera", type=int, metavar="N", help="use this live camera instead")
    parser.add_argument(
        "--views", type=int, default=25, help="number of views from a live camera (%(default)s)"
    )
    parser.add_argument(
        "--board", choices=("chessboard", "charuco", "tags"), default="chessboard",
        help="what the printed board shows (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--squares", type=squares, required=True, metavar="9x6",
        help="number of squares (not inner corners), or of tags, across and down",
    )  # fmt: skip
    parser.add_argument(
        "--square-m", type=float, required=True, metavar="M",
        help="edge of a square; for tags the distance of their centres",
    )  # fmt: skip
    parser.add_argument("--marker-m", type=float, metavar="M", help="black edge of a marker or tag")
    parser.add_argument(
        "--dictionary", default="DICT_4X4_50", help="markers of a ChArUco board (%(default)s)"
    )
    parser.add_argument(
        "--first-id", type=int, default=0, metavar="ID", help="id of the tag at the lower left"
    )
    parser.add_argument(
        "--fisheye", action="store_true", help="for lenses of more than about 100 deg"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="file to write, such as lens.toml")
    parser.add_argument(
        "--look", action="store_true", help="only find the board in the pictures, without measuring"
    )
    parser.add_argument(
        "--report", type=Path, metavar="FILE", help="write all results as JSON, for programs"
    )
    parser.add_argument(
        "--map", metavar="MAP", help="map of the camera, to check the size of the frames"
    )
    parser.add_argument(
        "--camera-name", metavar="NAME", help="name of the camera; default: the map's first"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import EyeError
    from scm.eye.calibrate.report import views_report, write_report

    if bool(arguments.image) == (arguments.camera is not None):
        raise EyeError("expected pictures, or a film, or --camera N, and only one of these")
    if arguments.look == (arguments.out is not None):
        raise EyeError("expected --out FILE for the lens, or --look, and only one of these")
    owner = _owner(arguments)
    board, gathered = _gathered(arguments)
    if arguments.report:  # what follows may refuse them
        write_report(views_report(board, gathered), arguments.report)
    if not arguments.look:
        _measure(arguments, board, gathered, owner)
        return 0
    _progress("")
    for line in gathered.remarks:
        print(line)
    print(f"{board.description}: in {len(gathered.views)} pictures")
    return 0


def _gathered(arguments: argparse.Namespace) -> "tuple[Board, Gathered]":
    from scm.eye.calibrate.gather import from_camera, from_files
    from scm.scenery.board import Board

    columns, rows = arguments.squares
    board = Board(
        arguments.board, columns, rows, arguments.square_m, arguments.marker_m,
        arguments.dictionary, arguments.first_id,
    )  # fmt: skip
    if arguments.camera is not None:
        return board, from_camera(board, arguments.camera, arguments.views, _progress)
    return board, from_files(board, arguments.image, _progress)


def _measure(
    arguments: argparse.Namespace, board: "Board", gathered: "Gathered", owner: "Camera | None"
) -> None:
    from scm.errors import EyeError
    from scm.eye.calibrate.assessment import assess
    from scm.eye.calibrate.report import lens_report, write_report
    from scm.eye.calibrate.solve import solve
    from scm.eye.calibrate.summary import report
    from scm.eye.calibration import calibrated

    solution = solve(gathered.views, gathered.size, arguments.fisheye, _progress)
    assessment = assess(solution)
    if arguments.report:
        write_report(lens_report(board, gathered, solution, assessment), arguments.report)
    _progress("")
    for line in gathered.remarks:
        print(line)
    print(report(solution, assessment))
    if assessment.refused:
        reasons = "".join(f"\n  {one}" for one in assessment.refused)
        raise EyeError(f"refused, nothing written: these views do not determine the lens{reasons}")
    calibration = solution.calibration()
    if owner is not None:
        calibrated(owner, calibration)
    calibration.save(arguments.out)
    print(f"\nwritten to {arguments.out}")


def _owner(arguments: argparse.Namespace) -> "Camera | None":
    from scm.eye.camera import camera_of
    from scm.maps.load import load_map

    return camera_of(load_map(arguments.map), arguments.camera_name) if arguments.map else None


def squares(text: str) -> tuple[int, int]:
    """Return the columns and rows of an argument as 9x6."""
    found = re.fullmatch(r"(\d{1,3})[xX](\d{1,3})", text)
    if found is None:
        raise argparse.ArgumentTypeError(f"expected two numbers as 9x6, got {text!r}")
    return int(found[1]), int(found[2])


def _progress(text: str) -> None:
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)


COMMAND = Command(
    help="Measure a camera's lens with a printed board; refuses views that do not determine it.",
    example="scm eye calibrate shots/*.jpg --squares 10x7 --square-m 0.025 --out lens.toml",
    arguments=_arguments,
    run=_run,
)
