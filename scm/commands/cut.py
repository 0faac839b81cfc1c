"""`scm cut`: copy part of a run into a new recording."""

import argparse
import sys
from pathlib import Path

from scm.command import Command


def span_arguments(parser: argparse.ArgumentParser) -> None:
    """Add which part of a run is meant."""
    parser.add_argument(
        "--from-s",
        type=float,
        default=0.0,
        metavar="S",
        help="start, in seconds since the run began (%(default)s)",
    )
    parser.add_argument(
        "--to-s", type=float, metavar="S", help="end, likewise; default: the end of the run"
    )


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("recording", type=Path, metavar="FILE", help="the .mcap of a run")
    span_arguments(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the new .mcap")


def _run(arguments: argparse.Namespace) -> int:
    from scm.recorder.cut import cut

    part = cut(arguments.recording, arguments.out, arguments.from_s, arguments.to_s)
    for damage in part.damage:
        print(f"left out: {damage}", file=sys.stderr)
    print(f"{part.path}: {part.messages} messages over {part.span_s:.1f} s")
    return 0


COMMAND = Command(
    help="Copy part of a run into a new recording.",
    example="scm cut runs/today.mcap --from-s 60 --to-s 180 --out runs/lap_3.mcap",
    arguments=_arguments,
    run=_run,
)
