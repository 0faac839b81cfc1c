"""A LIDAR on a port of its own: opened, started, read in every step of the agent, stopped.

A scanner that completes no turn for three seconds is started again, and a warning is logged.
"""

import logging
import threading
from functools import partial

from scm import registry
from scm.clock import NS_PER_S
from scm.errors import RunError
from scm.log import event
from scm.v2x.messages.lidar_scan import LidarScan
from vehicle_agent.lidar import Lidar, LidarKind, scan_of
from vehicle_agent.nigel.cable import Cable, open_serial

LIDARS = "vehicle_agent.lidars"
DRAIN_TURNS, DRAIN_S = 10, 0.005
MAX_SILENCE_NS = 3 * NS_PER_S
MAX_TURN_NS = NS_PER_S // 2  # scanners turn at least twice a second: longer means a lost turn

_log = logging.getLogger(__name__)


class LidarPort:
    """One scanner behind one port; it may be unplugged and plugged in again.

    Args:
        kind: Of the scanner.
        cable: To it.
    """

    def __init__(self, kind: LidarKind, cable: Cable) -> None:
        self._kind, self._cable = kind, cable
        self._driver: Lidar | None = None
        self._opened = self._active_ns = 0
        self._turned_ns: int | None = None  # end of the newest turn
        self._logged = self._quiet = ""

    def step(self, vehicle: str, now_ns: int) -> list[LidarScan]:
        """Return a message for each new turn; log trouble when it changes."""
        is_open = self._cable.keep_open(now_ns)
        is_new = self._cable.opened != self._opened
        if is_open and (is_new or now_ns - self._active_ns >= MAX_SILENCE_NS):
            self._quiet = "" if is_new else "no turn for 3 s: does it spin, is it of this kind?"
            self._opened, self._driver, self._active_ns = (
                self._cable.opened,
                self._kind.open(),
                now_ns,
            )
            self._turned_ns = None
            self._cable.write([self._driver.begin()])
        data = self._cable.read()
        turns = self._driver.feed(data) if self._driver is not None and data else ()
        turn_ns = self._turn_ns(len(turns), now_ns)
        if turns:
            self._active_ns, self._quiet = now_ns, ""
            self._turned_ns = now_ns
        self._log_trouble(self._cable.trouble or self._quiet)
        return [
            scan_of(turn, self._kind, vehicle, now_ns - after * (turn_ns or 0), turn_ns)
            for after, turn in zip(reversed(range(len(turns))), turns, strict=True)
        ]

    def _turn_ns(self, turns: int, now_ns: int) -> int | None:
        """Return how long each of the completed turns took; None: not known."""
        if not turns or self._turned_ns is None:
            return None
        turn_ns = (now_ns - self._turned_ns) // turns
        return turn_ns if turn_ns <= MAX_TURN_NS else None

    def _log_trouble(self, trouble: str) -> None:
        if trouble != self._logged:
            self._logged = trouble
            event(_log, "lidar", level=logging.WARNING, trouble=trouble or "none")

    def close(self) -> None:
        """Stop the scanner and release the port."""
        if self._driver is not None:
            self._cable.write([self._driver.end()])
        never = threading.Event()
        for _ in range(DRAIN_TURNS):
            if self._cable.is_drained():
                break
            never.wait(DRAIN_S)
        self._cable.close()


def open_lidar(port: str, kind: str) -> LidarPort:
    """Return a scanner of a kind, a file of `vehicle_agent/lidars`, behind a port.

    Raises:
        RunError: when there is no such kind.
    """
    found = registry.load(LIDARS, kind, "LIDAR", LidarKind, RunError)
    return LidarPort(found, Cable(port, found.baud, partial(open_serial, dtr=found.dtr)))
