"""`scm camera`: one part of the city, on its own."""

import argparse
import math

from scm.command import Command, part_arguments, run_part


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    parser.add_argument(
        "--light", type=float, default=1.0, help="its strength; 1 is a well-lit room (%(default)s)"
    )
    parser.add_argument(
        "--sun",
        type=float,
        nargs=2,
        default=(126.0, 54.0),
        metavar=("AZIMUTH_DEG", "ELEVATION_DEG"),
        help="direction of the light: counter-clockwise from the map's x axis, and elevation",
    )


def _run(arguments: argparse.Namespace) -> int:
    import cv2

    from scm.camera.daylight import Daylight
    from scm.camera.part import CameraPart
    from scm.clock import WallClock
    from scm.maps.load import load_map

    cv2.setNumThreads(1)  # the city needs the other cores
    azimuth, elevation = map(math.radians, arguments.sun)
    daylight = Daylight(arguments.light, azimuth, elevation)
    part = CameraPart(load_map(arguments.map), arguments.seed, daylight, WallClock())
    return run_part(part, arguments)


COMMAND = Command(
    help="Render the cars' own cameras while somebody subscribes to them.",
    example="scm camera driving_school --sun 45 30",
    arguments=_arguments,
    run=_run,
)
