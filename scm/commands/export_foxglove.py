"""`scm export foxglove`: a run of the city as a file that Foxglove draws."""

import argparse
import sys
from pathlib import Path

from scm.command import Command


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("recording", type=Path, metavar="RUN", help="the recorder's .mcap")
    parser.add_argument(
        "--out", default="-", metavar="FILE", help="where to write; -: standard output"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import RecordingError
    from scm.recorder.foxglove import write_foxglove
    from scm.recorder.run_index import read_index

    index = read_index(arguments.recording)
    if arguments.out == "-":
        for block in write_foxglove(index):
            sys.stdout.buffer.write(block)
        sys.stdout.buffer.flush()
        return 0
    path = Path(arguments.out)
    try:
        with path.open("xb") as stream:
            for block in write_foxglove(index):
                stream.write(block)
    except OSError as cause:
        msg = f"{path}: cannot be written: {cause.strerror or cause}"
        raise RecordingError(msg) from cause
    print(f"{path}: open it in Foxglove, and import the layout from the dashboard")
    return 0


COMMAND = Command(
    help="Write a run of the city as an MCAP file that Foxglove can draw.",
    example="scm export foxglove runs/today.mcap --out today.foxglove.mcap",
    arguments=_arguments,
    run=_run,
)
