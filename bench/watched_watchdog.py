"""A serial watchdog that reports when it knows of a zero throttle, and when it has sent it."""

import sys
import time
from collections.abc import Sequence

from scm.clock import Clock
from vehicle_agent.nigel import serial_watchdog
from vehicle_agent.nigel.cable import Cable
from vehicle_agent.nigel.host import Host, NigelCommand


def report(what: str) -> None:
    """Print an event for the benchmark, on the clock that all processes share."""
    print(f"{what} {time.monotonic_ns()}", flush=True)


class WatchedHost(Host):
    """A host that reports when its commanded throttle falls to zero."""

    _watched_moves = False
    owes = False

    def frames_due(self, command: NigelCommand, now_ns: int) -> list[bytes]:
        self.note(command.throttle)
        return super().frames_due(command, now_ns)

    def note(self, throttle: float) -> None:
        if self._watched_moves and throttle == 0.0:
            report("notice")
            WatchedHost.owes = True
        self._watched_moves = throttle != 0.0


class WatchedWatchdog(serial_watchdog.SerialWatchdog):
    """A watchdog that reports when it ends."""

    def finish(self, clock: Clock) -> None:
        self._host.note(0.0)
        super().finish(clock)


class WatchedCable(Cable):
    """A cable that reports when the first zeros were written."""

    def write(self, frames: Sequence[bytes]) -> None:
        super().write(frames)
        if frames and WatchedHost.owes:
            WatchedHost.owes = False
            report("written")


if __name__ == "__main__":
    setattr(serial_watchdog, "Cable", WatchedCable)  # noqa: B010
    setattr(serial_watchdog, "SerialWatchdog", WatchedWatchdog)  # noqa: B010
    setattr(serial_watchdog, "Host", WatchedHost)  # noqa: B010 the class of its host
    serial_watchdog.main(sys.argv[1:])
