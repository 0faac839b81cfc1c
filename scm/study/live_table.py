"""How far a study is, while it runs."""

from typing import TextIO

from scm.clock import WallClock, seconds
from scm.progress import CLEARED, ProgressLine, bar
from scm.study.results import Results
from scm.study.row import Row
from scm.study.statistics import level_text, wilson


class LiveTable:
    """A line that is redrawn on a terminal, and a line for each case that did not end.

    Args:
        stream: Where to.
        results: Of the study; rows that are there already count as done.
        cases: How many there will be.
    """

    def __init__(self, stream: TextIO, results: Results, cases: int) -> None:
        self._stream, self._clock = stream, WallClock()
        self._began_ns = self._clock.now_ns()
        self._all, self._done, self._new = cases, len(results.rows), 0
        rows = list(results.rows.values())
        self._successes = sum(row.outcome == "success" for row in rows)
        self._bad = sum(not row.has_ended for row in rows)
        self._has_limits = any(
            limits.at_least is not None or limits.at_most is not None
            for limits in results.study.file.measures.values()
        )
        self._line = ProgressLine(stream, self.line, self.line)
        self._name = results.study.file.name

    def show(self, where: str) -> None:
        """Say what runs and where."""
        there = f", {self._done} are there" if self._done else ""
        self._stream.write(f"{self._name}: {self._all} cases{there}; {where}\n")
        self._line.show()

    def add(self, row: Row) -> None:
        """Count a case."""
        self._done += 1
        self._new += 1
        self._successes += row.outcome == "success"
        if not row.has_ended:
            self._bad += 1
            values = ", ".join(f"{k} = {level_text(value)}" for k, value in row.values.items())
            start = CLEARED if self._stream.isatty() else ""
            self._stream.write(f"{start}case {row.case} ({values}): {row.outcome}: {row.detail}\n")

    def line(self) -> str:
        """Return the line as it is now."""
        took_s = seconds(self._clock.now_ns() - self._began_ns)
        text = f"{bar(self._done / max(1, self._all))} {self._done} of {self._all}"
        if self._new:
            left_s = took_s / self._new * (self._all - self._done)
            text += f", {_span(left_s)} left"
        if self._has_limits and self._done:
            share = wilson(self._successes, self._done)
            text += f"; success {share.value:.1%} [{share.low:.1%}, {share.high:.1%}]"
        if self._bad:
            text += f"; {self._bad} did not end"
        return text

    def close(self) -> None:
        """End it."""
        self._line.close()


def _span(time_s: float) -> str:
    """Return a time as people say it."""
    if time_s < 90.0:
        return f"{time_s:.0f} s"
    return f"{time_s / 60.0:.0f} min" if time_s < 5400.0 else f"{time_s / 3600.0:.1f} h"
