"""A recorded command, held between its rows, as its mean over each step of a simulation."""

from dataclasses import dataclass, field

import numpy as np

from scm.arrays import Floats
from scm.vehicles.jit import array_kernel


@dataclass(frozen=True, slots=True)
class Commanded:
    """A command that holds its value until the next row; zero before the first.

    Attributes:
        t: Times of the rows, rising strictly, (n,) [s].
        values: In [-1, 1], (n,).
    """

    t: Floats
    values: Floats
    _area: Floats = field(init=False, repr=False)  # the command's integral up to each row

    def __post_init__(self) -> None:
        area = np.concatenate(([0.0], np.cumsum(self.values[:-1] * np.diff(self.t))))
        object.__setattr__(self, "_area", area)

    def means(self, edges: Floats, delay: Floats) -> Floats:
        """Return the mean over each step, for several delays: (steps, delays).

        Taking the mean, not a sample, keeps a step's time exact and the result smooth in the delay.

        Args:
            edges: Times at which steps begin and end, (steps + 1,) [s].
            delay: From the row's time to its effect, (delays,) [s].
        """
        out = np.empty((len(edges) - 1, len(delay)))
        _means(self.t, self.values, self._area, edges, delay, out)
        return out


@array_kernel
def _means(
    t: Floats, values: Floats, area: Floats, edges: Floats, delays: Floats, out: Floats
) -> None:
    for k in range(len(delays)):
        twin = 0
        while delays[twin] != delays[k]:
            twin += 1
        if twin < k:
            for i in range(len(out)):
                out[i, k] = out[i, twin]
            continue
        row, after = -1, len(t)  # the last row that is not later, and the first that is
        while after - row > 1:
            middle = (row + after) // 2
            if t[middle] <= edges[0] - delays[k]:
                row = middle
            else:
                after = middle
        before = 0.0
        for i in range(len(edges)):
            at = edges[i] - delays[k]
            while row + 1 < len(t) and t[row + 1] <= at:
                row += 1
            whole = area[row] + values[row] * (at - t[row]) if row >= 0 else 0.0
            if i > 0:
                out[i - 1, k] = (whole - before) / (edges[i] - edges[i - 1])
            before = whole
