"""Start a program that dies with its parent, however the parent ends.

Run as a file it asks the kernel for a SIGKILL at the parent's death and becomes the program: the
process id stays the same, and the program needs to know nothing. The parent must start it from a
thread that lives as long as itself. Only Linux knows this; elsewhere the program just runs.

Worker processes of `multiprocessing` hold a leash instead: they end when the other end of a pipe is
closed, by whoever holds it or by his death, on every system.
"""

import os
import sys
import threading
from collections.abc import Sequence
from typing import Protocol

PR_SET_PDEATHSIG = 1
SIGKILL = 9
ENDED = 1


def with_parent(program: Sequence[str]) -> list[str]:
    """Return the command that runs a program and ends it when this process ends."""
    return [sys.executable, "-I", "-S", __file__, str(os.getpid()), *program]


class Leash(Protocol):
    """The reading end of a pipe that is never written to."""

    def poll(self, timeout: float | None) -> bool:
        """Wait until there is something to read, or nothing ever more."""
        ...


def end_with(leash: Leash) -> None:
    """End this process, whatever it is doing, as soon as the other end of `leash` is closed."""
    threading.Thread(target=_wait_and_end, args=(leash,), daemon=True).start()


def _wait_and_end(leash: Leash) -> None:
    try:
        leash.poll(None)
    finally:
        os._exit(ENDED)


def main(argv: Sequence[str]) -> None:
    """Become the program `argv[1:]` for as long as the process `argv[0]` lives."""
    if sys.platform == "linux":
        import ctypes  # noqa: PLC0415  costs a third of the start, and only Linux needs it

        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0)
    if os.getppid() == int(argv[0]):
        os.execv(argv[1], list(argv[1:]))


if __name__ == "__main__":
    main(sys.argv[1:])
