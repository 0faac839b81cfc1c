"""`scm export autodrive`: a recording as logs of AutoDRIVE's data recorder."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:
    from scm.recording.autodrive_write import Written

BEGINNING = "1970_01_01_00_00_00_000"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recording",
        nargs="+",
        type=Path,
        metavar="RECORDING",
        help="the .mcap of a run, or description files or their folders",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="where to write")
    parser.add_argument("--rate-hz", type=float, default=30.0, help="rows per second (%(default)g)")
    parser.add_argument("--vehicle", metavar="NAME", help="export only this car of several")
    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help="folder of the description's tables; default: beside it",
    )
    parser.add_argument(
        "--start",
        default=BEGINNING,
        metavar="STAMP",
        help="UTC time of a description's time 0 (%(default)s); a run has its own",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import RecordingError
    from scm.recorder.drives import SUFFIX

    runs = [path for path in arguments.recording if path.suffix == SUFFIX]
    if runs and len(arguments.recording) > 1:
        msg = f"{runs[0]}: a run is exported by itself, got {len(arguments.recording)} recordings"
        raise RecordingError(msg)
    written = _of_run(arguments) if runs else _of_described(arguments)
    for log in written:
        print(f"{arguments.out / log.file}: {log.rows} rows, {log.of}")
        if log.empty:
            print(f"  nothing is known of {', '.join(log.empty)}: left empty")
    return 0


def _of_run(arguments: argparse.Namespace) -> "Sequence[Written]":
    """Write the logs of a run, and the pictures of its cars."""
    from scm.recorder.autodrive_run import pictures_of, read_tracks
    from scm.recording.autodrive_write import write_logs

    (path,) = arguments.recording
    run = read_tracks(path, arguments.vehicle)
    for line in run.remarks:
        print(line)
    written = write_logs(
        arguments.out, run.cars, run.lights, start_ms=run.start_ms, rate_hz=arguments.rate_hz
    )
    for log in written:
        for camera, named in log.pictures.items():
            for k, picture in enumerate(pictures_of(path, log.of, camera) if named else ()):
                if k in named:
                    file = arguments.out / named[k]
                    file.parent.mkdir(exist_ok=True)
                    file.write_bytes(picture)
    return written


def _of_described(arguments: argparse.Namespace) -> "Sequence[Written]":
    """Write the logs of described recordings, car after car."""
    from scm.recorder.autodrive_described import car_track, light_tracks
    from scm.recorder.drives import recordings_of
    from scm.recording.autodrive import stamp_ms
    from scm.recording.autodrive_write import write_logs

    start_ms = stamp_ms(arguments.start)
    recordings = [
        recording
        for path in arguments.recording
        for recording in recordings_of(path, arguments.data, arguments.vehicle)
    ]
    return write_logs(
        arguments.out,
        [car_track(recording) for recording in recordings],
        light_tracks(recordings),
        start_ms=start_ms,
        rate_hz=arguments.rate_hz,
    )


COMMAND = Command(
    help="Write a recording as logs of AutoDRIVE's data recorder, for AutoDRIVE's tools.",
    example="scm export autodrive runs/today.mcap --out runs/today_autodrive",
    arguments=_arguments,
    run=_run,
)
