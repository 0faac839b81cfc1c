"""`scm fleet neighbour`: trust the authority of a neighbouring city, or no longer."""

import argparse
from pathlib import Path

from scm.command import Command
from scm.commands.fleet_add import fleet_argument


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="CITY", help="name of the neighbour on the bus")
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument(
        "certificate", nargs="?", type=Path, metavar="FILE",
        help="what `scm fleet authority` wrote there",
    )  # fmt: skip
    which.add_argument("--remove", action="store_true", help="trust it no longer")
    fleet_argument(parser)


def _run(arguments: argparse.Namespace) -> int:
    from datetime import UTC, datetime

    from scm.clock import WallClock, seconds
    from scm.errors import AccessError
    from scm.v2x.certificates import fingerprint_of
    from scm.v2x.fleet_file import add_neighbour, load_fleet, remove_neighbour

    fleet = load_fleet(arguments.fleet)
    if arguments.remove:
        remove_neighbour(fleet, arguments.name)
        print(f"{arguments.name} is removed. A running city stays joined until its next start.")
        return 0
    try:
        certificate = arguments.certificate.read_text("utf-8")
        now = datetime.fromtimestamp(seconds(WallClock().now_ns()), UTC)
        add_neighbour(fleet, arguments.name, certificate, now)
    except (OSError, UnicodeDecodeError) as cause:
        reason = getattr(cause, "strerror", None) or cause
        msg = f"{arguments.certificate}: {reason}; expected what `scm fleet authority` writes"
        raise AccessError(msg) from cause
    except AccessError as cause:
        msg = f"{arguments.certificate}: {cause}"
        raise AccessError(msg) from cause
    print(f"{arguments.name} may join with a certificate of this authority:")
    print(f"  {fingerprint_of(certificate)}")
    return 0


COMMAND = Command(
    help="Trust the authority of a neighbouring city, for its gateway and nothing else.",
    example="scm fleet neighbour lab_b lab_b.crt",
    arguments=_arguments,
    run=_run,
)
