"""`scm fleet add`: let a station into the city, or give it new credentials."""

import argparse
from pathlib import Path

from scm.command import Command

DEFAULT = Path("fleet.toml")


def fleet_argument(parser: argparse.ArgumentParser) -> None:
    """Add which fleet file."""
    parser.add_argument(
        "--fleet", type=Path, default=DEFAULT, metavar="FILE", help="fleet file (%(default)s)"
    )


def _arguments(parser: argparse.ArgumentParser) -> None:
    from scm.v2x.rights import ROLES

    parser.description = (
        f"{COMMAND.help} The first one creates the fleet file and chooses how its stations "
        "authenticate. A station that is already in it gets new credentials; its old ones end when "
        "the router restarts."
    )
    parser.add_argument("name", metavar="NAME", help="of the station: a-z 0-9 _ -")
    parser.add_argument("--role", required=True, choices=ROLES, help="what it may do")
    auth = parser.add_mutually_exclusive_group()
    auth.add_argument(
        "--password", dest="auth", action="store_const", const="password",
        help="make a fleet with passwords, for this machine only (default)",
    )  # fmt: skip
    auth.add_argument(
        "--mtls", dest="auth", action="store_const", const="mtls",
        help="make a fleet with certificates over TLS, for a network",
    )  # fmt: skip
    parser.add_argument(
        "--host", action="append", default=[], metavar="ADDRESS",
        help="another address of the router, for its certificate",
    )  # fmt: skip
    fleet_argument(parser)


def _run(arguments: argparse.Namespace) -> int:
    from datetime import UTC, datetime

    from scm.clock import WallClock, seconds
    from scm.errors import AccessError
    from scm.v2x.fleet_file import Fleet, add, check_hosts, load_fleet, name_hosts

    now = datetime.fromtimestamp(seconds(WallClock().now_ns()), UTC)
    is_new = not arguments.fleet.exists()
    fleet = Fleet(arguments.fleet, arguments.auth or "password") if is_new else None
    fleet = fleet or load_fleet(arguments.fleet)
    if arguments.auth not in (None, fleet.auth):
        msg = f"fleet {fleet.path}: its stations use {fleet.auth}, not {arguments.auth}"
        raise AccessError(msg)
    check_hosts(arguments.host)
    made = add(fleet, arguments.name, arguments.role, now)
    name_hosts(fleet, arguments.host, now)
    file = fleet.credentials(made.station)
    print(f"{made.station}: {made.role}; credentials in {file}: copy it to where it runs, mode 600")
    print("A running router admits it after its next start.")
    return 0


COMMAND = Command(
    help="Admit a station to the city: writes it into the fleet file, with its credentials.",
    example="scm fleet add n7 --role vehicle --mtls --host 192.168.1.5",
    arguments=_arguments,
    run=_run,
)
