"""`scm plan prove`: the exhaustive proof of a signal plan."""

import argparse
import sys
from pathlib import Path

from scm.command import Command


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "file", metavar="FILE", help="plan as JSON with its junction's phases; -: standard input"
    )


def _run(arguments: argparse.Namespace) -> int:
    import msgspec

    from scm.errors import PlanError
    from scm.traffic.signals.custom_plans import prove_file
    from scm.v2x.plan_file import PlanFile

    try:
        if arguments.file == "-":
            text = sys.stdin.buffer.read()
        else:
            text = Path(arguments.file).read_bytes()
        file = msgspec.json.decode(text, type=PlanFile)
    except (OSError, msgspec.MsgspecError) as cause:
        raise PlanError(f"plan {arguments.file}: {cause}") from cause
    print(msgspec.json.encode(prove_file(file)).decode())
    return 0


COMMAND = Command(
    help="Prove that a signal plan is safe and runs as written.",
    example="scm plan prove runs/plans/crossing/rush.json",
    arguments=_arguments,
    run=_run,
)
