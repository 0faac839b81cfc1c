"""`scm fleet authority`: write this city's authority for its neighbours."""

import argparse
from pathlib import Path

from scm.command import Command
from scm.commands.fleet_add import fleet_argument


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("out", type=Path, metavar="OUT", help="new file, such as lab_a.crt")
    parser.add_argument(
        "--host", action="append", default=[], metavar="ADDRESS",
        help="another address of this city, for its certificates",
    )  # fmt: skip
    fleet_argument(parser)


def _run(arguments: argparse.Namespace) -> int:
    from datetime import UTC, datetime

    from scm.clock import WallClock, seconds
    from scm.errors import AccessError
    from scm.v2x.certificates import fingerprint_of
    from scm.v2x.fleet_file import (
        Fleet,
        authority_certificate,
        check_hosts,
        load_fleet,
        name_hosts,
    )

    if arguments.out.exists():
        raise AccessError(f"{arguments.out}: is there already; expected a new file")
    now = datetime.fromtimestamp(seconds(WallClock().now_ns()), UTC)
    check_hosts(arguments.host)
    is_new = not arguments.fleet.exists()
    fleet = Fleet(arguments.fleet, "mtls") if is_new else load_fleet(arguments.fleet)
    certificate = authority_certificate(fleet, now)
    name_hosts(fleet, arguments.host, now)
    try:
        with arguments.out.open("x", encoding="utf-8") as file:
            file.write(certificate)
    except OSError as cause:
        msg = f"{arguments.out}: {cause.strerror}; expected a new file"
        raise AccessError(msg) from cause
    print(f"{arguments.out}: no secret; give it to the neighbour, and compare the fingerprint:")
    print(f"  {fingerprint_of(certificate)}")
    return 0


COMMAND = Command(
    help="Write the certificate of this city's authority, for a neighbouring city.",
    example="scm fleet authority lab_a.crt --host 192.168.1.5",
    arguments=_arguments,
    run=_run,
)
