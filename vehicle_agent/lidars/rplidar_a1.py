"""RPLIDAR A1, the scanner of the published Nigel: its serial protocol in the standard scan mode.

    request     A5 25 stop, then nothing for a millisecond, A5 20 scan
    descriptor  A5 5A 05 00 00 40 81
    node        quality << 2 | not S << 1 | S,  angle << 1 | 1 (u16, 1/64 deg, clockwise),
                distance (u16, 1/4 mm; 0: no answer)

S marks the first node of a turn. The two bits that must differ and the one that must be set are
all that a node can be checked by: after a byte was lost, `SURE` in a row must fit.
On its USB adapter the motor turns while DTR is low.
The pause is said in zeros, which begin no request: 24 take 2 ms at this rate.
Source: the protocol that its maker publishes, and its SDK's structures. The angle is the scanner's
own, clockwise from its front: mount it with its front forward.
"""

import numpy as np

from scm.arrays import Floats
from vehicle_agent.lidar import Lidar, LidarKind, Turn

STOP, SCAN = b"\xa5\x25", b"\xa5\x20"
PAUSE = bytes(24)
DESCRIPTOR = bytes.fromhex("a55a0500004081")
NODE = 5
SURE = 8
LONGEST = 2000
"""Nodes of one turn: 2000 samples a second, one turn at least."""


class RplidarA1:
    """One scanner.

    Attributes:
        skipped: Bytes that made no sense.
    """

    def __init__(self) -> None:
        self.skipped = 0
        self._held = bytearray()
        self._is_in_step = False
        self._turn: list[bytes] = []
        self._has_begun = False

    def begin(self) -> bytes:
        """Return: stop whatever runs, then scan."""
        return STOP + PAUSE + SCAN

    def hear(self, data: bytes) -> list[Turn]:
        """Take what came; return the turns that it completes."""
        self._held += data
        turns: list[Turn] = []
        while self._is_in_step or self._get_in_step():
            node = bytes(self._held[:NODE])
            if len(node) < NODE:
                break
            if not _is_node(node):
                self._is_in_step, self._has_begun, self._turn = False, False, []
                continue
            del self._held[:NODE]
            turns += self._add(node)
        return turns

    def end(self) -> bytes:
        """Return: stop."""
        return STOP

    def _get_in_step(self) -> bool:
        """Drop bytes until `SURE` nodes in a row fit; False while too few are there."""
        while len(self._held) >= SURE * NODE:
            if self._held.startswith(DESCRIPTOR):
                del self._held[: len(DESCRIPTOR)]
                continue
            nodes = [self._held[at : at + NODE] for at in range(0, SURE * NODE, NODE)]
            if all(map(_is_node, nodes)):
                self._is_in_step = True
                return True
            del self._held[0]
            self.skipped += 1
        return False

    def _add(self, node: bytes) -> list[Turn]:
        """Add a node to its turn; return the turn that it ends, if it ends one."""
        ended: list[Turn] = []
        if node[0] & 1 or len(self._turn) >= LONGEST:
            if self._has_begun and self._turn:
                ended = [_turn_of(b"".join(self._turn))]
            self._turn, self._has_begun = [], bool(node[0] & 1)
        self._turn.append(node)
        return ended


def _is_node(node: bytes | bytearray) -> bool:
    return (node[0] ^ node[0] >> 1) & 1 == 1 and node[1] & 1 == 1


def _turn_of(nodes: bytes) -> Turn:
    """Return the nodes (n x 5 bytes) as bearings and ranges."""
    rows = np.frombuffer(nodes, dtype=np.uint8).reshape(-1, NODE).astype(np.float64)
    degrees: Floats = ((rows[:, 1] + 256.0 * rows[:, 2]) // 2.0) / 64.0
    metres: Floats = (rows[:, 3] + 256.0 * rows[:, 4]) / 4000.0
    return Turn(-np.radians(degrees), np.where(metres > 0.0, metres, np.inf))


def _open() -> Lidar:
    return RplidarA1()


LIDAR = LidarKind(
    baud=115200, beams=360, range_min_m=0.15, range_max_m=12.0, open=_open, dtr=False,
    clockwise=True,
)  # fmt: skip
