"""The processes of a city that runs on this machine already."""

import os
from pathlib import Path
from signal import Signals

from scm.errors import RunError


def send_to_part(part: str, endpoint: str, number: Signals) -> None:
    """Send a signal to the process that runs a part of the city at an endpoint.

    Raises:
        RunError: when not exactly one such process runs here.
    """
    found = [
        int(entry.name)
        for entry in Path("/proc").iterdir()
        if entry.name.isdigit() and _runs(entry, part, endpoint)
    ]
    if len(found) != 1:
        msg = f"scm {part} --connect {endpoint}: got {len(found)} processes here, expected one"
        raise RunError(msg)
    os.kill(found[0], number)


def _runs(process: Path, part: str, endpoint: str) -> bool:
    try:
        words = (process / "cmdline").read_bytes().split(b"\0")
    except OSError:
        return False
    text = [word.decode(errors="replace") for word in words]
    return "scm" in text and part in text and endpoint in text
