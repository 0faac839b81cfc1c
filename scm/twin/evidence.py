"""What the windows of one car show of each watched number: the detector's scores, with places."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats
from scm.clock import seconds
from scm.records.twins import Kind, TwinChange
from scm.twin.detector import INFORMATION, NEAR, WHOLE, Usual, weighed
from scm.twin.windows import WatchedNumber, Windows

OWN: tuple[Kind, ...] = ("car", "tag")  # causes of a change that are the car's
SAME_S = 10.0  # changes that began within that may be one
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
        scores, information: Of each number, (n, numbers); `whole`: scores of windows however far
            they stray.
        inflation: Variance of sums of scores over that of independent windows, (numbers,).
        most: Windows that are remembered.
        is_steady: Whether the car strays as it did when that was learned by which they are weighed.
    """

    numbers: Sequence[WatchedNumber]
    t_s: Floats
    places: Floats
    cameras: NDArray[np.str_]
    scores: Floats
    information: Floats
    whole: Floats
    inflation: Floats
    most: int = MOST
    is_steady: bool = True

    @classmethod
    def none(cls, numbers: Sequence[WatchedNumber]) -> "Evidence":
        """Return that of a car that was not seen yet."""
        empty, count = np.empty((0, len(numbers))), len(numbers)
        names = np.empty(0, dtype=np.str_)
        return cls(
            numbers, np.empty(0), np.empty((0, 2)), names, empty, empty, empty, np.ones(count)
        )  # fmt: skip

    def add(self, windows: Windows, usual: Usual, cameras: NDArray[np.str_]) -> None:
        """Add new windows, and by which camera each was seen; the oldest are forgotten."""
        shown = weighed(windows, usual)
        self.t_s = np.concatenate((self.t_s, windows.begin_s))[-self.most :]
        self.places = np.concatenate((self.places, windows.places))[-self.most :]
        self.cameras = np.concatenate((self.cameras, cameras))[-self.most :]
        self.scores = np.concatenate((self.scores, shown[NEAR]))[-self.most :]
        self.information = np.concatenate((self.information, shown[INFORMATION]))[-self.most :]
        self.whole = np.concatenate((self.whole, shown[WHOLE]))[-self.most :]
        self.inflation = usual.inflation[SPAN]


@dataclass(frozen=True, slots=True)
class Witness:
    """A car whose windows count.

    Attributes:
        begin_s: Zero of the evidence's clock, on the city's [s].
        first_s, last_s: Windows before and after count no more: it changed by itself there.
    """

    evidence: Evidence
    begin_s: float
    first_s: float = -math.inf
    last_s: float = math.inf


def witness(
    evidence: Evidence, begin_s: float, changes: Iterable[TwinChange], since_s: float, *,
    is_own: bool,
) -> Witness:  # fmt: skip
    """Return what a car shows about a change, from its own last change before it to its next.

    Args:
        evidence: Of the car.
        begin_s: Zero of the evidence's clock, on the city's.
        changes: Of the car; those whose own they are count.
        since_s: When the change began, on the city's clock.
        is_own: Whether it is this car's: its later ones do not end it.
    """
    own = [seconds(one.since_ns) for one in changes if one.cause in OWN]
    first_s = max((t_s for t_s in own if t_s < since_s - SAME_S), default=-math.inf)
    last_s = min((t_s for t_s in own if t_s > since_s + SAME_S), default=math.inf)
    return Witness(evidence, begin_s, first_s, math.inf if is_own else last_s)
