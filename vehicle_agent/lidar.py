"""The contract of a LIDAR driver.

To add one, put a file with `LIDAR = LidarKind(...)` into `vehicle_agent/lidars`: copy one of these.
A driver is a state machine without port or clock: bytes in, turns out. The agent opens the port at
the kind's baud rate, writes what `begin` returns, feeds received bytes, and writes `end` before it
closes. A port that was unplugged and plugged in again gets a new driver. Invalid bytes are counted
and skipped, never raised.
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
        skipped: Number of invalid bytes.
    """

    skipped: int

    def begin(self) -> bytes:
        """Return what starts it."""
        ...

    def feed(self, data: bytes) -> Sequence[Turn]:
        """Process received bytes; return the turns they complete."""
        ...

    def end(self) -> bytes:
        """Return what stops it."""
        ...


@dataclass(frozen=True, slots=True)
class LidarKind:
    """One kind of scanner.

    Attributes:
        baud: Of its port.
        beams: In the messages made of its turns, evenly spaced over a turn.
        range_min_m: Nearest measured range; likewise `range_max_m`.
        open: Makes a driver.
        dtr: State of the port's DTR line while it is used.
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
    """Return a turn as a message: per beam the nearest range, infinity for none.

    Args:
        turn: Of the scanner.
        kind: Of scanner.
        vehicle: The car that carries it.
        t_ns: End of the turn.
        turn_ns: Duration of the turn; None: not known.
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
