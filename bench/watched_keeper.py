"""A keeper of the cable that says when it knows of a zero throttle, and when it has sent it."""

import sys
import time
from collections.abc import Sequence

from scm.clock import Clock
from vehicle_agent.nigel import serial_watchdog
from vehicle_agent.nigel.cable import Cable
from vehicle_agent.nigel.host import Host, Wish


def say(what: str) -> None:
    """Tell the bench, which reads our output, on the clock that all processes share."""
    print(f"{what} {time.monotonic_ns()}", flush=True)


class WatchedHost(Host):
    """A host that tells when what it is wished falls to zero."""

    _watched_moves = False
    owes = False

    def say(self, wish: Wish, now_ns: int) -> list[bytes]:
        self.note(wish.throttle)
        return super().say(wish, now_ns)

    def note(self, throttle: float) -> None:
        if self._watched_moves and throttle == 0.0:
            say("notice")
            WatchedHost.owes = True
        self._watched_moves = throttle != 0.0


class WatchedKeeper(serial_watchdog.Keeper):
    """A keeper that tells when it is to end."""

    def finish(self, clock: Clock) -> None:
        self._host.note(0.0)
        super().finish(clock)


class WatchedCable(Cable):
    """A cable that tells when the first zeros were written."""

    def write(self, frames: Sequence[bytes]) -> None:
        super().write(frames)
        if frames and WatchedHost.owes:
            WatchedHost.owes = False
            say("written")


if __name__ == "__main__":
    setattr(serial_watchdog, "Cable", WatchedCable)  # noqa: B010
    setattr(serial_watchdog, "Keeper", WatchedKeeper)  # noqa: B010
    setattr(serial_watchdog, "Host", WatchedHost)  # noqa: B010 what the keeper makes its host of
    serial_watchdog.main(sys.argv[1:])
