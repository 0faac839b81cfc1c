"""`scm key list`: whose API keys there are."""

import argparse

from scm.command import Command
from scm.commands.key_add import key_ring, keys_argument


def _run(arguments: argparse.Namespace) -> int:
    from datetime import UTC, datetime

    with key_ring(arguments.keys) as keys:
        records = list(keys.records())
    print(f"{len(records)} keys in {arguments.keys}")
    for one in records:
        made = datetime.fromtimestamp(one.made_s, UTC)
        print(f"  {one.key_id}  {one.role:<9} {made:%Y-%m-%d}  {one.owner}")
    return 0


COMMAND = Command(
    help="List the API keys and their owners; secrets are not stored.",
    example="scm key list",
    arguments=keys_argument,
    run=_run,
)
