"""RPLIDAR A1, the scanner of the published Nigel: its serial protocol in the standard scan mode.

    request     A5 25 stop, then nothing for a millisecond, A5 20 scan
    descriptor  A5 5A 05 00 00 40 81
    node        quality << 2 | not S << 1 | S,  angle << 1 | 1 (u16, 1/64 deg, clockwise),
                distance (u16, 1/4 mm; 0: no answer)

S marks the first node of a turn. A node can only be checked by the two bits that must differ and
the one that must be set: after a lost byte, `SYNC_NODES` in a row must be valid.
On its USB adapter the motor turns while DTR is low.
The pause is sent as zeros, which begin no request: 24 take 2 ms at this rate.
Source: the protocol that its maker publishes, and its SDK's structures. The angle is the scanner's
own, clockwise from its front: mount it with its front forward.
"""

import numpy as np

from scm.arrays import Floats
from vehicle_agent.lidar import Lidar, LidarKind, Turn

STOP, SCAN = b"\xa5\x25", b"\xa5\x20"
PAUSE = bytes(24)
DESCRIPTOR = bytes.fromhex("a55a0500004081")
NODE_BYTES = 5
SYNC_NODES = 8
MAX_TURN_NODES = 2000
"""Nodes of one turn: 2000 samples a second, at least one turn a second."""


class RplidarA1:
    """One scanner.

    Attributes:
        skipped: Number of invalid bytes.
    """

    def __init__(self) -> None:
        self.skipped = 0
        self._buffer = bytearray()
        self._is_synchronised = False
        self._turn: list[bytes] = []
        self._has_begun = False

    def begin(self) -> bytes:
        """Return the bytes that stop the scanner and start a scan."""
        return STOP + PAUSE + SCAN

    def feed(self, data: bytes) -> list[Turn]:
        """Process received bytes; return the turns they complete."""
        self._buffer += data
        turns: list[Turn] = []
        while self._is_synchronised or self._synchronise():
            node = bytes(self._buffer[:NODE_BYTES])
            if len(node) < NODE_BYTES:
                break
            if not _is_node(node):
                self._is_synchronised, self._has_begun, self._turn = False, False, []
                continue
            del self._buffer[:NODE_BYTES]
            turns += self._add(node)
        return turns

    def end(self) -> bytes:
        """Return the bytes that stop the scanner."""
        return STOP

    def _synchronise(self) -> bool:
        """Drop bytes until `SYNC_NODES` nodes in a row are valid; False while too few are there."""
        while len(self._buffer) >= SYNC_NODES * NODE_BYTES:
            if self._buffer.startswith(DESCRIPTOR):
                del self._buffer[: len(DESCRIPTOR)]
                continue
            nodes = [
                self._buffer[at : at + NODE_BYTES]
                for at in range(0, SYNC_NODES * NODE_BYTES, NODE_BYTES)
            ]
            if all(map(_is_node, nodes)):
                self._is_synchronised = True
                return True
            del self._buffer[0]
            self.skipped += 1
        return False

    def _add(self, node: bytes) -> list[Turn]:
        """Add a node to its turn; return the turn it completes, if any."""
        ended: list[Turn] = []
        if node[0] & 1 or len(self._turn) >= MAX_TURN_NODES:
            if self._has_begun and self._turn:
                ended = [_turn_of(b"".join(self._turn))]
            self._turn, self._has_begun = [], bool(node[0] & 1)
        self._turn.append(node)
        return ended


def _is_node(node: bytes | bytearray) -> bool:
    return (node[0] ^ node[0] >> 1) & 1 == 1 and node[1] & 1 == 1


def _turn_of(nodes: bytes) -> Turn:
    """Return the nodes (n x 5 bytes) as bearings and ranges."""
    rows = np.frombuffer(nodes, dtype=np.uint8).reshape(-1, NODE_BYTES).astype(np.float64)
    degrees: Floats = ((rows[:, 1] + 256.0 * rows[:, 2]) // 2.0) / 64.0
    metres: Floats = (rows[:, 3] + 256.0 * rows[:, 4]) / 4000.0
    return Turn(-np.radians(degrees), np.where(metres > 0.0, metres, np.inf))


def _open() -> Lidar:
    return RplidarA1()


LIDAR = LidarKind(
    baud=115200, beams=360, range_min_m=0.15, range_max_m=12.0, open=_open, dtr=False,
    clockwise=True,
)  # fmt: skip
