"""`scm export foxglove`: a run of the city as a file that Foxglove draws."""

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

from scm.command import Command


def export_arguments(parser: argparse.ArgumentParser) -> None:
    """Add which run is to be written in another form, and where."""
    parser.add_argument("recording", type=Path, metavar="RUN", help="the recorder's .mcap")
    parser.add_argument(
        "--out", default="-", metavar="FILE", help="where to write; -: standard output"
    )


def write_blocks(blocks: Iterable[bytes], out: str) -> None:
    """Write a file, or to standard output.

    Raises:
        RecordingError: when the file is there already, or cannot be written.
    """
    from scm.errors import RecordingError

    if out == "-":
        sys.stdout.buffer.writelines(blocks)
        sys.stdout.buffer.flush()
        return
    try:
        with Path(out).open("xb") as stream:
            stream.writelines(blocks)
    except OSError as cause:
        msg = f"{out}: cannot be written: {cause.strerror or cause}"
        raise RecordingError(msg) from cause


def _run(arguments: argparse.Namespace) -> int:
    from scm.recorder.foxglove import write_foxglove
    from scm.recorder.run_index import read_index

    write_blocks(write_foxglove(read_index(arguments.recording)), arguments.out)
    if arguments.out != "-":
        print(f"{arguments.out}: open it in Foxglove, and import the layout from the dashboard")
    return 0


COMMAND = Command(
    help="Write a run of the city as an MCAP file that Foxglove can draw.",
    example="scm export foxglove runs/today.mcap --out today.foxglove.mcap",
    arguments=export_arguments,
    run=_run,
)
