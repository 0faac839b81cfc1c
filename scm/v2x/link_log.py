"""Why a link to a neighbour fails: Zenoh reports it in its own log and nowhere else."""

import os
import re
import threading
from types import TracebackType
from typing import Self

import zenoh

from scm.clock import NS_PER_S, Clock

RECENT_NS = 3 * NS_PER_S  # Zenoh tries again every half second
_FILTER = "error,zenoh_link_tls=warn,zenoh::net::runtime::orchestrator=debug"
_REASON = re.compile(
    r"(invalid peer certificate|received fatal alert): (.+?)(?: at /|\. Hint:|\.\. Retry|\]|$)"
)
_STDOUT = 1
# Authorities of two fleets may have the same name: then the signature shows it.
_UNKNOWN_TO_US = ("UnknownIssuer", "BadSignature")
_UNKNOWN_THERE = ("UnknownCA", "DecryptError")


def refusal_in(line: str, neighbour: str) -> str:
    """Return what a line of Zenoh's log says of a refused certificate; empty: nothing."""
    found = _REASON.search(line)
    if found is None:
        return ""
    by_us, reason = found[1].startswith("invalid"), found[2]
    if by_us and reason in _UNKNOWN_TO_US:
        return f"refused: its certificate is not from the authority known for {neighbour}"
    if by_us:
        return f"refused: the certificate of {neighbour}: {reason}"
    if reason in _UNKNOWN_THERE:
        return f"{neighbour} refuses this city: it knows another authority for it"
    return f"{neighbour} refuses the certificate of this city: {reason}"


class LinkLog:
    """Reads what Zenoh writes on the standard output of this process, inside its `with` block.

    One is enough for a process, which can print nothing itself from then on.
    """

    def __init__(self, neighbour: str, clock: Clock) -> None:
        self._neighbour = neighbour
        self._clock = clock
        self._lock = threading.Lock()
        self._newest = ("", 0)

    def __enter__(self) -> Self:
        """Redirect the standard output, and let Zenoh log to it."""
        self._before = os.dup(_STDOUT)
        reading, writing = os.pipe()
        os.set_blocking(writing, False)  # Zenoh's threads must never wait for this one
        os.dup2(writing, _STDOUT)
        os.close(writing)
        zenoh.init_log_from_env_or(_FILTER)
        self._thread = threading.Thread(target=self._read, args=(reading,), name="link log")
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.dup2(self._before, _STDOUT)  # closes the pipe
        os.close(self._before)
        self._thread.join()

    def _read(self, reading: int) -> None:
        with open(reading, encoding="utf-8", errors="replace") as lines:
            for line in lines:
                reason = refusal_in(line.rstrip(), self._neighbour)
                if reason:
                    with self._lock:
                        self._newest = (reason, self._clock.now_ns())

    def why(self) -> str:
        """Return why a link was refused within the last seconds; empty: none was."""
        with self._lock:
            reason, t_ns = self._newest
        return reason if self._clock.now_ns() - t_ns < RECENT_NS else ""
