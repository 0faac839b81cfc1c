"""`scm export csv`: the cars of a run as a table."""

import argparse

from scm.command import Command
from scm.commands.cut import span_arguments
from scm.commands.export_foxglove import export_arguments, write_blocks

MAX_SPAN_S = 1e7  # four months


def _arguments(parser: argparse.ArgumentParser) -> None:
    export_arguments(parser)
    parser.add_argument(
        "--vehicle",
        default="",
        metavar="NAME",
        help="export this car's own reports; default: all cars as the world saw them",
    )
    span_arguments(parser)


def _run(arguments: argparse.Namespace) -> int:
    from scm.api.recording_repository import cars_of
    from scm.api.replay import csv_of, no_rows
    from scm.errors import RecordingError
    from scm.recorder.run_index import read_index

    from_s, to_s = arguments.from_s, arguments.to_s
    end_s = MAX_SPAN_S if to_s is None else to_s
    if not 0.0 <= from_s <= end_s <= MAX_SPAN_S:
        got = f"{from_s:g} to {end_s:g} s"
        msg = f"span: got {got}, expected 0 or more, and the end behind the begin"
        raise RecordingError(msg)
    index = read_index(arguments.recording)
    vehicle, known = arguments.vehicle, cars_of(index)
    if vehicle and vehicle not in known:
        msg = f"{arguments.recording}: got vehicle {vehicle!r}, expected one of {', '.join(known)}"
        raise RecordingError(msg)
    table = csv_of(index, vehicle, from_s, to_s)
    if table is None:
        msg = f"{arguments.recording}: {no_rows(index, vehicle, from_s, to_s)}"
        raise RecordingError(msg)
    write_blocks(table, arguments.out)
    return 0


COMMAND = Command(
    help="Write the cars of a run of the city as CSV, in SI units.",
    example="scm export csv runs/today.mcap --vehicle n1 --from-s 60 --out n1.csv",
    arguments=_arguments,
    run=_run,
)
