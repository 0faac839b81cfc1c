"""`scm key revoke`: end an API key."""

import argparse

from scm.command import Command
from scm.commands.key_add import key_ring, keys_argument


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("key_id", metavar="ID", help="as `scm key list` shows it")
    keys_argument(parser)


def _run(arguments: argparse.Namespace) -> int:
    with key_ring(arguments.keys) as keys:
        ended = keys.revoke(arguments.key_id)
    print(f"the {ended.role} key of {ended.owner} has ended")
    return 0


COMMAND = Command(
    help="Revoke an API key, at once.",
    example="scm key revoke 1a2b3c4d",
    arguments=_arguments,
    run=_run,
)
