"""Delayed commands of a car: the integral of its commands over time, at a few instants.

The mean of a command over the last call, one delay earlier, is a difference of that integral:
smooth in the delay, exact where calls are regular and where there is no delay.
"""

import math
from collections.abc import Iterable, Mapping

import numpy as np

from scm.arrays import AnyArray, Bools, Floats, Ints
from scm.errors import TermError
from scm.vehicles.jit import array_kernel
from scm.vehicles.term import Term, reads

KNOTS = 64  # stored instants per car
SPACING_S = 8e-3  # minimum between two of them: 0.5 s in all, the longest delay
COMMANDS = ("throttle_command", "steering_command")
DELAYS = {"throttle_past": "drive.delay_s", "steering_past": "steering.delay_s"}


class CommandHistory:
    """The command history of a fleet whose effects read `throttle_past` or `steering_past`.

    Attributes:
        block_rows: Rows of the fleet's block: both commands, then both delayed ones.
        columns: Rows of the fleet's numbers with both delays; -1: none.
    """

    def __init__(self, capacity: int, block_rows: Ints, columns: Ints) -> None:
        self.block_rows, self.columns = block_rows, columns
        self._knots: Floats = np.zeros((capacity, KNOTS, 3))
        self._newest: Ints = np.zeros(capacity, dtype=np.int64)
        self._before: Floats = np.zeros((capacity, 2))

    @property
    def bytes_per_car(self) -> int:
        """Memory per car."""
        return (KNOTS * 3 + 1 + 2) * 8

    def reset(self, row: int | Ints, throttle: float, steering: float | None) -> None:
        """Restart cars with these past commands; None: the first command to come."""
        self._knots[row] = 0.0
        self._newest[row] = 0
        self._before[row] = throttle, math.nan if steering is None else steering

    def memory(self, row: int) -> tuple[AnyArray, ...]:
        """Return views of one car's history: knots, number of the newest, commands before."""
        return self._knots[row], self._newest[row : row + 1], self._before[row]

    def copy_row(self, source: int, row: int | slice) -> None:
        """Copy one car's history to another row, or to several."""
        for array in (self._knots, self._newest, self._before):
            array[row] = array[source]

    def apply(
        self, block: Floats, numbers: Floats, alive: Bools, first: int, last: int, span: float
    ) -> None:
        """Before a call of `span` seconds: store the commands and write the delayed ones.

        For a car that stands still in time, not `alive`, no time passes here either.
        """
        _apply(
            block, numbers, alive, self._knots, self._newest, self._before, self.block_rows,
            self.columns, first, last, span,
        )  # fmt: skip


def history_of(
    terms: Iterable[Term], places: Mapping[str, int], offsets: Mapping[str, tuple[int, int]],
    capacity: int,
) -> CommandHistory | None:  # fmt: skip
    """Return the command history of a fleet if one of its effects reads delayed commands.

    Args:
        terms: The effects.
        places: Rows of the fleet's numbers, by key.
        offsets: Rows of its block, by name.
        capacity: Of the fleet.

    Raises:
        TermError: when an effect reads a delayed command and the car has no such delay.
    """
    delayed = {name for term in terms for name in reads(term.function)} & DELAYS.keys()
    if not delayed:
        return None
    for name in sorted(delayed):
        if DELAYS[name] not in places:
            msg = f"an effect reads {name}, but no effect has the parameter {DELAYS[name]}"
            raise TermError(msg)
    rows = [offsets[name][0] for name in (*COMMANDS, *DELAYS)]
    columns = [places.get(key, -1) for key in DELAYS.values()]
    return CommandHistory(capacity, np.array(rows), np.array(columns))


@array_kernel
def _apply(
    block: Floats, numbers: Floats, alive: Bools, all_knots: Floats, newest: Ints,
    before: Floats, block_rows: Ints, columns: Ints, first: int, last: int, span: float,
) -> None:  # fmt: skip
    for row in range(first, last):
        if not alive[row]:
            continue
        knots, top = all_knots[row], newest[row]
        here = knots[top % KNOTS]
        start = here[0]
        end = start + span
        # a knot too close to the last one replaces it
        near = top > 0 and start - knots[(top - 1) % KNOTS, 0] < 0.999 * SPACING_S
        place = top if near else top + 1
        value = np.empty(3)
        value[0] = end
        now = np.empty(2)
        for k in range(2):
            given = min(max(block[block_rows[k], row], -1.0), 1.0)
            now[k] = given if given == given else 0.0  # noqa: PLR0124 a command that is no number
            if np.isnan(before[row, k]):
                before[row, k] = now[k]
            value[k + 1] = here[k + 1] + span * now[k]
        knots[place % KNOTS] = value
        newest[row] = place
        for k in range(2):
            past = now[k]
            if columns[k] >= 0 and numbers[columns[k], row] > 0.0:
                delay = numbers[columns[k], row]
                moved = _integral(knots, place, k, end - delay, before[row, k])
                moved -= _integral(knots, place, k, start - delay, before[row, k])
                past = moved / span
            block[block_rows[k + 2], row] = past


@array_kernel
def _integral(knots: Floats, newest: int, k: int, time: float, before: float) -> float:
    """Integral of command k up to a time; before the first knot it was `before`."""
    oldest = max(0, newest - KNOTS + 1)
    if time <= knots[oldest % KNOTS, 0]:
        return float(knots[oldest % KNOTS, k + 1] + before * (time - knots[oldest % KNOTS, 0]))
    j = newest
    while j > oldest + 1 and knots[(j - 1) % KNOTS, 0] >= time:
        j -= 1
    late, early = knots[j % KNOTS], knots[(j - 1) % KNOTS]
    share = (time - early[0]) / (late[0] - early[0])
    return float(early[k + 1] + share * (late[k + 1] - early[k + 1]))
