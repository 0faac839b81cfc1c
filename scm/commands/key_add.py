"""`scm key add`: an API key for a person or a program."""

import argparse
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from scm.command import Command
from scm.errors import AccessError

if TYPE_CHECKING:
    from scm.api.keys import KeyRing

DEFAULT = "sqlite:keys.db"


def keys_argument(parser: argparse.ArgumentParser) -> None:
    """Add where the keys are."""
    parser.add_argument(
        "--keys",
        default=DEFAULT,
        metavar="STORE",
        help="sqlite:PATH or postgresql://... (%(default)s)",
    )


@contextmanager
def key_ring(url: str) -> "Iterator[KeyRing]":
    """Open the keys that are there already; nothing is made where none are.

    Raises:
        AccessError: when there is no such file.
    """
    from contextlib import closing

    from scm.api.keys import KeyRing
    from scm.store.open import open_store

    path = url.removeprefix("sqlite:").removeprefix("//")
    if url.startswith("sqlite:") and not Path(path).exists():
        msg = f"keys {path}: there is no such file; `scm key add` makes one"
        raise AccessError(msg)
    with closing(open_store(url)) as store:
        yield KeyRing(store)


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("owner", metavar="OWNER", help="the owner's name, for people")
    parser.add_argument(
        "--role",
        required=True,
        choices=("viewer", "operator", "engineer", "admin"),
        help="each role includes those before it",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the key into a new file that only you can read, and do not print it; "
        "programs read it through `SCM_API_KEY_FILE`",
    )
    keys_argument(parser)


def _run(arguments: argparse.Namespace) -> int:
    from contextlib import closing

    from scm.api.keys import KeyRing
    from scm.clock import NS_PER_S, WallClock
    from scm.store.open import open_store

    with _output(arguments.out) as out, closing(open_store(arguments.keys)) as store:
        now_s = WallClock().now_ns() // NS_PER_S
        key = KeyRing(store).add(arguments.owner, arguments.role, now_s)
        if arguments.out is None:
            print(f"{arguments.role} key of {arguments.owner}, shown this once:")
        print(key, file=out)
    if arguments.out is not None:
        print(f"{arguments.role} key of {arguments.owner} in {arguments.out}: the only copy")
    return 0


@contextmanager
def _output(path: Path | None) -> Iterator[TextIO]:
    """Open where a key goes: the screen, or a new file that its owner alone can read.

    Raises:
        AccessError: when there is such a file already, or none can be made.
    """
    if path is None:
        yield sys.stdout
        return
    try:
        made = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except OSError as cause:
        msg = f"{path}: cannot be written: {cause.strerror}"
        raise AccessError(msg) from cause
    with os.fdopen(made, "w") as out:
        yield out


COMMAND = Command(
    help="Create an API key; it is shown once and valid at once.",
    example="scm key add anna --role operator",
    arguments=_arguments,
    run=_run,
)
