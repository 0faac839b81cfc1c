"""`scm eye`: one part of the city, on its own."""

import argparse
from pathlib import Path

from scm.command import Command, part_arguments, run_part


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    parser.add_argument("--camera", help="which camera of the map; default: its first")
    parser.add_argument(
        "--frames",
        type=Path,
        metavar="FILE",
        help="a film or picture of the real camera; default: emulated",
    )


def _run(arguments: argparse.Namespace) -> int:
    import cv2

    from scm.eye.part import EyePart
    from scm.eye.sources.file import FileSource
    from scm.maps.load import load_map

    cv2.setNumThreads(1)  # the city needs the other cores, and one frame at a time is fast enough
    source = FileSource(arguments.frames) if arguments.frames else None
    part = EyePart(load_map(arguments.map), arguments.camera, arguments.seed, source)
    return run_part(part, arguments)


COMMAND = Command(
    help="AutoDRIVE Eye: poses of tags in the overhead camera's frames.",
    example="scm eye driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
