"""The contract of a LIDAR's driver: what stands on a real car and looks around.

To add one, put a file with `LIDAR = LidarKind(...)` into `vehicle_agent/lidars`: copy one of these.
A driver is a state machine without port or clock: bytes in, turns out. The agent opens the port at
the kind's baud rate, writes what `begin` returns, feeds what comes, and writes `end` before it
closes; a port that was pulled and plugged back begins with a new driver. Bytes that make no sense
are counted and read over, never raised.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from scm.arrays import Floats
from scm.v2x.messages.lidar_scan import LidarScan


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """One turn of the scanner.

    Attributes:
        bearings: (n,) where each beam looked [rad], 0 straight ahead, + = left, in any order.
        ranges: (n,) likewise [m]; infinity is a miss.
    """

    bearings: Floats
    ranges: Floats


class Lidar(Protocol):
    """One conversation with one scanner.

    Attributes:
        skipped: Bytes that made no sense.
    """

    skipped: int

    def begin(self) -> bytes:
        """Return what starts it."""
        ...

    def hear(self, data: bytes) -> Sequence[Turn]:
        """Take what came; return the turns that it completes."""
        ...

    def end(self) -> bytes:
        """Return what stops it."""
        ...


@dataclass(frozen=True, slots=True)
class LidarKind:
    """One kind of scanner.

    Attributes:
        baud: Of its port.
        beams: In the messages that are made of its turns: a turn is shared out evenly.
        range_min_m: Nearest that it sees; likewise `range_max_m`.
        open: Makes a driver.
        dtr: How the port's DTR line must be while it is used.
        clockwise: How it turns, seen from above.
    """

    baud: int
    beams: int
    range_min_m: float
    range_max_m: float
    open: Callable[[], Lidar]
    dtr: bool = True
    clockwise: bool = False


def scan_of(
    turn: Turn, kind: LidarKind, vehicle: str, t_ns: int, turn_ns: int | None = None
) -> LidarScan:
    """Return a turn as a message: of all beams around a bearing the nearest range, else a miss.

    Args:
        turn: Of the scanner.
        kind: Of scanner.
        vehicle: Whose it is.
        t_ns: When the turn was over.
        turn_ns: How long it took; None: not known.
    """
    bins = np.rint(turn.bearings * (kind.beams / (2.0 * np.pi))).astype(np.int64) % kind.beams
    seen = (turn.ranges >= kind.range_min_m) & (turn.ranges <= kind.range_max_m)
    ranges = np.full(kind.beams, np.inf, dtype=np.float32)
    np.minimum.at(ranges, bins[seen], turn.ranges[seen].astype(np.float32))
    return LidarScan(
        vehicle=vehicle,
        t_ns=t_ns,
        beams=kind.beams,
        range_min_m=kind.range_min_m,
        range_max_m=kind.range_max_m,
        payload=ranges.astype("<f4").tobytes(),
        sweep_ns=turn_ns,
        period_ns=turn_ns,
        clockwise=kind.clockwise,
    )
