"""`vehicle-agent show-demo`: what a network would learn from, as a page."""

import argparse
from pathlib import Path

from scm.command import Command


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("demonstration", type=Path, metavar="DIR", help="folder by record-demo")
    parser.add_argument(
        "--out", type=Path, default=Path("demo.html"), metavar="FILE", help="(%(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of all that is drawn (%(default)s)")


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import LearningError, RunError
    from scm.vehicles.car import load_car
    from vehicle_agent.cloning.demonstration import Demonstration

    try:
        from vehicle_agent.cloning.demonstration_page import demonstration_page
    except ModuleNotFoundError as cause:
        msg = f"{cause.name} is not installed: pip install 'scm[learn]'"
        raise RunError(msg) from cause
    demonstration = Demonstration(arguments.demonstration)
    page = demonstration_page(demonstration, load_car(demonstration.about.car), arguments.seed)
    try:
        arguments.out.write_text(page, encoding="utf-8")
    except OSError as cause:
        raise LearningError(f"--out {arguments.out}: {cause.strerror}") from cause
    print(f"{arguments.out}: {len(demonstration.samples)} frames of {demonstration.about.vehicle}")
    return 0


COMMAND = Command(
    help="show a demonstration before training: steering, balancing, augmentation",
    example="vehicle-agent show-demo demos/mine --out demo.html",
    arguments=_arguments,
    run=_run,
)
