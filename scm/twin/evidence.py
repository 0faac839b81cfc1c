"""What the windows of one car show of each watched number: the detector's scores, with places."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats
from scm.twin.detector import INFORMATION, NEAR, Usual, weighed
from scm.twin.windows import WatchedNumber, Windows

MOST = 1800  # windows: 15 minutes of driving
SPAN = 2  # of the detector's, whose scatter stands for that of a place's windows: 40 s


@dataclass(slots=True)
class Evidence:
    """The newest windows of a car that is predicted by one file, n of them.

    Attributes:
        numbers: That are watched.
        t_s: When each window begins, on the recording's clock, (n,).
        places: In the middle of each, x and y, (n, 2) [m].
        cameras: By which the car was seen there, (n,); empty: not known.
        scores, information: Of each number, (n, numbers).
        inflation: Variance of sums of scores over that of independent windows, (numbers,).
        most: Windows that are remembered.
    """

    numbers: Sequence[WatchedNumber]
    t_s: Floats
    places: Floats
    cameras: NDArray[np.str_]
    scores: Floats
    information: Floats
    inflation: Floats
    most: int = MOST

    @classmethod
    def none(cls, numbers: Sequence[WatchedNumber]) -> "Evidence":
        """Return that of a car that was not seen yet."""
        empty, count = np.empty((0, len(numbers))), len(numbers)
        names = np.empty(0, dtype=np.str_)
        return cls(numbers, np.empty(0), np.empty((0, 2)), names, empty, empty, np.ones(count))

    def add(self, windows: Windows, usual: Usual, camera: str = "") -> None:
        """Add new windows; the oldest are forgotten."""
        shown = weighed(windows, usual)
        names = np.full(len(windows.begin_s), camera, dtype=np.str_)
        self.t_s = np.concatenate((self.t_s, windows.begin_s))[-self.most :]
        self.places = np.concatenate((self.places, windows.places))[-self.most :]
        self.cameras = np.concatenate((self.cameras, names))[-self.most :]
        self.scores = np.concatenate((self.scores, shown[NEAR]))[-self.most :]
        self.information = np.concatenate((self.information, shown[INFORMATION]))[-self.most :]
        self.inflation = usual.inflation[SPAN]
