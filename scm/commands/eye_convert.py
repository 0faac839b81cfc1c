"""`scm eye convert`: a camera's lens from one file format into another."""

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:  # the command line starts without what reads lenses
    from scm.eye.calibration_files import Format

_FORMATS: "dict[str, Format]" = {".toml": "scm", ".yaml": "ros", ".yml": "opencv"}


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "calibration", type=Path, metavar="FILE",
        help="lens.toml, ROS camera_info YAML, or YAML, XML or JSON of OpenCV",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE",
        help="file to write: .toml for our format, .yaml for ROS camera_info, .yml for OpenCV",
    )  # fmt: skip
    parser.add_argument(
        "--format", choices=("scm", "ros", "opencv"), help="format of --out, whatever its suffix"
    )
    parser.add_argument(
        "--size",
        type=_size,
        metavar="1280x720",
        help="size of the frames, if FILE does not state it",
    )
    parser.add_argument(
        "--camera-name", default="camera", metavar="NAME", help="camera name for ROS (%(default)s)"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import EyeError
    from scm.eye.calibrate.summary import lens_lines
    from scm.eye.calibration_files import read_calibration, write_calibration

    form: Format | None = arguments.format or _FORMATS.get(arguments.out.suffix.lower())
    if form is None:
        raise EyeError(f"--out: expected .toml, .yaml or .yml, or --format, got {arguments.out}")
    lens, remarks = read_calibration(arguments.calibration, arguments.size)
    write_calibration(lens, arguments.out, form, arguments.camera_name)
    print(f"{lens.lens} lens, {lens.width_px} x {lens.height_px} px")
    print("\n".join(lens_lines(lens)))
    for remark in remarks:
        print(f"  {remark}")
    if form != "scm":
        print("  its covariance is not written: only our own format, .toml, holds it")
    print(f"written to {arguments.out}, {_DESTINATIONS[form]}")
    return 0


_DESTINATIONS = {"scm": "for `scm eye --calibration`", "ros": "as ROS camera_info",
         "opencv": "as OpenCV's FileStorage"}  # fmt: skip


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,5})[xX](\d{1,5})", text)
    if found is None:
        raise argparse.ArgumentTypeError(f"expected two numbers as 1280x720, got {text!r}")
    return int(found[1]), int(found[2])


COMMAND = Command(
    help="Convert a camera's lens between our format, ROS and OpenCV.",
    example="scm eye convert camera_info.yaml --out lens.toml",
    arguments=_arguments,
    run=_run,
)
