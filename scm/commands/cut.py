"""`scm cut`: a part of a run as a recording of its own."""

import argparse
import sys
from pathlib import Path

from scm.command import Command


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("recording", type=Path, metavar="FILE", help=".mcap of a city")
    parser.add_argument(
        "--from-s", type=float, default=0.0, metavar="S", help="since the run began (%(default)s)"
    )
    parser.add_argument("--to-s", type=float, metavar="S", help="likewise; without: to the end")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the new .mcap")


def _run(arguments: argparse.Namespace) -> int:
    from scm.recorder.cut import cut

    part = cut(arguments.recording, arguments.out, arguments.from_s, arguments.to_s)
    for said in part.damage:
        print(f"left out: {said}", file=sys.stderr)
    print(f"{part.path}: {part.messages} messages over {part.span_s:.1f} s")
    return 0


COMMAND = Command(
    help="Copy a part of a run into a recording of its own.",
    example="scm cut runs/today.mcap --from-s 60 --to-s 180 --out runs/lap_3.mcap",
    arguments=_arguments,
    run=_run,
)
