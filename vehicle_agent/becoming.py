"""Options of a simulated car that becomes another one, which it does not report."""

import argparse
import math
from typing import TYPE_CHECKING

from scm.errors import RunError

if TYPE_CHECKING:
    from vehicle_agent.bodies.simulated import Change


def becomes_arguments(parser: argparse.ArgumentParser) -> None:
    """Add `--becomes` and `--after-s`."""
    parser.add_argument(
        "--becomes", metavar="FILE", help="car file that is true of it later, unreported: for "
        "trying scm twin",
    )  # fmt: skip
    parser.add_argument(
        "--after-s", type=float, default=0.0, metavar="S", help="when it becomes so (%(default)g)"
    )


def not_below_0(arguments: argparse.Namespace, *names: str) -> None:
    """Check numbers by the names of their arguments.

    Raises:
        RunError: names the option, and what was given.
    """
    for name in names:
        value = getattr(arguments, name)
        if not 0.0 <= value < math.inf:
            raise RunError(f"--{name.replace('_', '-')}: expected 0 or more, got {value:g}")


def change_of(arguments: argparse.Namespace) -> "Change | None":
    """Return what the car becomes; None: it stays as it is.

    Raises:
        RunError: when it would be before the begin.
    """
    if arguments.becomes is None:
        return None
    not_below_0(arguments, "after_s")
    from vehicle_agent.bodies.simulated import Change  # noqa: PLC0415  loads the compiler

    return Change(arguments.becomes, arguments.after_s)
