"""`scm key list`: whose API keys there are."""

import argparse

from scm.command import Command
from scm.commands.key_add import keys_argument


def _run(arguments: argparse.Namespace) -> int:
    from contextlib import closing
    from datetime import UTC, datetime

    from scm.api.keys import KeyRing
    from scm.store.open import open_store

    with closing(open_store(arguments.keys)) as store:
        for one in KeyRing(store).records():
            made = datetime.fromtimestamp(one.made_s, UTC)
            print(f"{one.key_id}  {one.role:<9} {made:%Y-%m-%d}  {one.owner}")
    return 0


COMMAND = Command(
    help="Whose API keys there are; their secrets are not kept.",
    example="scm key list",
    arguments=keys_argument,
    run=_run,
)
