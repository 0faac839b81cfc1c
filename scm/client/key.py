"""The API key of a program that was given none: of a file that only its owner can read.

A key on a command line stands in `ps` for all who use the machine, one in the environment wherever
a program prints that.
"""

import os
import stat
from pathlib import Path

from scm.errors import AccessError

NAMED_BY = "SCM_API_KEY_FILE"
OTHERS = stat.S_IRWXG | stat.S_IRWXO


def key_of_environment() -> str:
    """Return the key of the file that `SCM_API_KEY_FILE` names; empty: it names none.

    Raises:
        AccessError: when it cannot be read, can be read by others, or holds nothing.
    """
    named = os.environ.get(NAMED_BY)
    if not named:
        return ""
    path = Path(named)
    try:
        mode = path.stat().st_mode
        key = path.read_text("ascii").strip()
    except (OSError, ValueError) as cause:
        why = cause.strerror if isinstance(cause, OSError) else "expected an API key, got no ASCII"
        raise AccessError(f"{NAMED_BY} {path}: {why}") from cause
    if mode & OTHERS:
        got = stat.filemode(mode)
        msg = f"{NAMED_BY} {path}: got {got}, expected only its owner to read it: chmod 600 {path}"
        raise AccessError(msg)
    if not key:
        msg = f"{NAMED_BY} {path}: expected an API key, got nothing"
        raise AccessError(msg)
    return key
