"""`scm record`: everything on the bus into an MCAP file."""

import argparse
from pathlib import Path

from scm.command import Command, part_arguments, run_part


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    camera_arguments(parser)
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE", help="the .mcap to write"
    )
    parser.add_argument(
        "--frames-hz",
        type=float,
        default=1.0,
        metavar="HZ",
        help="pictures per second to record of each overhead camera, 0 for none (%(default)s); "
        "all else is recorded in full",
    )
    parser.add_argument(
        "--sparse",
        action="store_true",
        help="leave out each car's own states, sensors and radio frames; snapshots cover all cars",
    )


def camera_arguments(parser: argparse.ArgumentParser) -> None:
    """Add which of the cars' own cameras are recorded, and how often."""
    parser.add_argument(
        "--cameras-hz",
        type=float,
        default=0.0,
        metavar="HZ",
        help="if above 0, render the cars' own cameras and record so many pictures of each per "
        "second (%(default)s)",
    )
    parser.add_argument(
        "--cameras-of",
        action="append",
        default=[],
        metavar="CAR",
        help="only the cameras of this car; repeatable; default: all cars",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import LinkError
    from scm.recorder.part import RecorderPart

    part = RecorderPart(
        arguments.out,
        arguments.city,
        arguments.frames_hz,
        arguments.cameras_hz,
        arguments.cameras_of,
        sparse=arguments.sparse,
    )
    try:
        return run_part(part, arguments)
    except LinkError:
        part.file.discard()  # no city: the next try may use the same name
        raise


COMMAND = Command(
    help="Record everything on the bus; a kill loses at most half a second.",
    example="scm record --out runs/today.mcap",
    arguments=_arguments,
    run=_run,
)
