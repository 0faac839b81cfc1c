"""A path as its driver sees it: sampled once, and then looked up without asking the map again."""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.maps.route import Path

STEP = 0.02


class Track:
    """Samples of a path, one every two centimetres.

    Attributes:
        length: Of the path [m].
        closed: Whether its end is its beginning; then every position is taken modulo `length`.
        x, y, yaw: Of the samples (n,), yaw without jumps.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.length = path.length_m
        self.closed = path.closed
        count = max(2, round(self.length / STEP) + 1)
        self.s = np.linspace(0.0, self.length, count)
        self._step = self.length / (count - 1)
        poses = [path.at(float(s)) for s in self.s[:-1]]
        poses.append(path.at(0.0) if path.closed else path.at(self.length))
        self.x = np.array([pose.x for pose in poses])
        self.y = np.array([pose.y for pose in poses])
        self.yaw = np.unwrap(np.array([pose.yaw for pose in poses]))
        self._turn = float(self.yaw[-1] - self.yaw[0]) if path.closed else 0.0
        self._yaw = self.yaw.tolist()

    def local(self, s: float) -> float:
        """Return a position along the way as one on the path, [0, length]."""
        return s % self.length if self.closed else min(max(s, 0.0), self.length)

    def cell(self, s: float) -> int:
        """Return the index of the last sample at or before a position."""
        return min(int(self.local(s) / self._step), len(self._yaw) - 2)

    def heading(self, s: float) -> float:
        """Return the path's yaw at s without jumps, laps included [rad]."""
        laps, at = divmod(s, self.length) if self.closed else (0.0, self.local(s))
        cell = at / self._step
        low = min(int(cell), len(self._yaw) - 2)
        part = cell - low
        yaw = self._yaw[low] + part * (self._yaw[low + 1] - self._yaw[low])
        return float(yaw + laps * self._turn)

    def samples(self, start: float, end: float) -> tuple[Floats, Ints]:
        """Return positions from start to end, one a sample, and the samples' indices."""
        last = len(self.x) - 1
        first = math.ceil(start / self._step)
        index = np.arange(first, max(first, int(end / self._step) + 1), dtype=np.int64)
        if not self.closed:
            index = index[(index >= 0) & (index <= last)]
        s = np.asarray(index * self._step, dtype=np.float64)
        return s, index % last if self.closed else index
