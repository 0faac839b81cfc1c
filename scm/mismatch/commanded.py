"""A recorded command, held between its rows, as its mean over each step of a simulation."""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats


@dataclass(frozen=True, slots=True)
class Commanded:
    """A command that holds its value until the next row; zero before the first.

    Attributes:
        t: Times of the rows, rising strictly, (n,) [s].
        values: In [-1, 1], (n,).
    """

    t: Floats
    values: Floats

    def means(self, edges: Floats, delay: Floats) -> Floats:
        """Return the mean over each step, for several delays: (steps, delays).

        Taking the mean, not a sample, keeps a step's time exact and the result smooth in the delay.

        Args:
            edges: Times at which steps begin and end, (steps + 1,) [s].
            delay: From the row's time to its effect, (delays,) [s].
        """
        area = np.concatenate(([0.0], np.cumsum(self.values[:-1] * np.diff(self.t))))
        at = edges[:, None] - delay
        row = np.searchsorted(self.t, at, side="right") - 1
        since = np.where(row >= 0, at - self.t[np.maximum(row, 0)], 0.0)
        row = np.maximum(row, 0)
        return np.diff(area[row] + self.values[row] * since, axis=0) / np.diff(edges)[:, None]
