"""A router as a process of its own, so that it can be killed: `python -m scm.selftest.router`."""

import sys

from scm.clock import NS_PER_S, WallClock
from scm.runtime.live import stop_on_signal
from scm.v2x.router import Router


def main(listen: str) -> None:
    """Route until a signal to stop arrives."""
    stop, clock = stop_on_signal(), WallClock()
    with Router(listen):
        while not clock.wait_until(clock.now_ns() + NS_PER_S, stop):
            pass


if __name__ == "__main__":
    main(sys.argv[1])
