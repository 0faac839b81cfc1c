"""`scm fleet list`: who may enter the city."""

import argparse
from typing import TYPE_CHECKING

from scm.command import Command
from scm.commands.fleet_add import fleet_argument

if TYPE_CHECKING:
    from scm.v2x.fleet_file import Fleet


def _run(arguments: argparse.Namespace) -> int:
    from scm.v2x.fleet_file import load_fleet

    fleet = load_fleet(arguments.fleet)
    print(f"{len(fleet.members)} stations with {fleet.auth}")
    for member in sorted(fleet.members.values(), key=lambda member: member.name):
        print(f"  {member.name:<16} {member.role:<9} {_state(fleet, member.name)}")
    for name in fleet.neighbours:
        print(f"  {name:<16} neighbour {_authority(fleet, name)}")
    return 0


def _authority(fleet: "Fleet", name: str) -> str:
    from scm.v2x.certificates import fingerprint_of

    return f"authority {fingerprint_of(fleet.authority_of(name).read_text('utf-8'))}"


def _state(fleet: "Fleet", name: str) -> str:
    from scm.errors import AccessError
    from scm.v2x.credentials import read_credentials

    try:
        found = read_credentials(fleet.credentials(name), name)
    except AccessError:
        return "its credentials are not here"
    if not found.certificate:
        return "password"
    from scm.v2x.certificates import expiry_of

    return f"certificate until {expiry_of(found.certificate):%Y-%m-%d}"


COMMAND = Command(
    help="List the stations that may enter the city, and until when.",
    example="scm fleet list",
    arguments=fleet_argument,
    run=_run,
)
