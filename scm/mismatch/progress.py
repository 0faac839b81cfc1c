"""How far a diagnosis is.

The share done is an estimate: each thing that is tried has a usual place in the whole, measured on
drives of 90 s, and between two of them the bar creeps.
"""

import math
import threading
from typing import TextIO

from scm.clock import Clock, seconds
from scm.progress import ProgressLine, bar

WIDTH = 100
CREEP_S = 12.0
# What the text of a step begins with, and the usual share of the work done when it begins.
STEPS = (
    ("checking", 0.0), ("fitting", 0.04), ("trying", 0.15), ("refitting", 0.22),
    ("computing", 0.6), ("screening", 0.66), ("judging", 0.88), ("designing", 0.93),
    ("simulating", 0.94), ("no drive", 0.95), ("writing", 0.98),
)  # fmt: skip
ANOTHER_EFFECT, LAST_EFFECT, DISCOVERY = 0.16, 0.56, 0.7


class Progress:
    """Shows what is being tried, for how long, and about how much is done.

    Args:
        stream: Where to; with a bar if it is a terminal.
        clock: For the seconds.
    """

    def __init__(self, stream: TextIO, clock: Clock) -> None:
        self._stream, self._clock = stream, clock
        self._began_ns = self._step_ns = clock.now_ns()
        self._share, self._next, self._shown, self._text = 0.0, STEPS[1][1], 0.0, ""
        self._of, self._from, self._part = "", 0.0, 1.0
        self._lock = threading.Lock()
        self._shown_line = ProgressLine(stream, self.line, self._written)

    def turn(self, name: str, number: int, count: int) -> None:
        """Begin with one of several cars, or with what is done after them all.

        Args:
            name: Stands before what is tried.
            number: From 0; `count`: of all turns, which take equal shares.
            count: How many.
        """
        with self._lock:
            self._shown = 0.0
            self._share, self._next = 0.0, STEPS[1][1]
            self._of, self._from, self._part = f"{name}: ", number / count, 1.0 / count

    def notify(self, text: str) -> None:
        """Show what is tried from now on."""
        with self._lock:
            self._shown = self._done()
            self._share = _share(text, self._share)
            after = min((s for _, s in STEPS if s > self._share + 0.005), default=1.0)
            self._next = min(after, self._share + ANOTHER_EFFECT)
            self._text, self._step_ns = self._of + text, self._clock.now_ns()
        self._shown_line.show()

    def close(self) -> None:
        """Take the bar away."""
        self._shown_line.close()

    def line(self) -> str:
        """Return the bar as it is now."""
        done, text = self._now()
        return f"{bar(done)} {100.0 * done:3.0f} %  {self._elapsed_s():3.0f} s  {text}"[:WIDTH]

    def _written(self) -> str:
        done, text = self._now()
        return f"{self._elapsed_s():5.0f} s  {100.0 * done:3.0f} %  {text}"

    def _now(self) -> tuple[float, str]:
        with self._lock:
            return self._from + self._part * self._done(), self._text

    def _done(self) -> float:
        """Return the share done, never less than was shown before."""
        since = seconds(self._clock.now_ns() - self._step_ns)
        crept = 0.9 * (self._next - self._share) * (1.0 - math.exp(-since / CREEP_S))
        return max(self._shown, self._share + crept)

    def _elapsed_s(self) -> float:
        return seconds(self._clock.now_ns() - self._began_ns)


def _share(text: str, before: float) -> float:
    """Return about how much is done when a step begins, never less than before."""
    if text.startswith("trying") and before >= STEPS[3][1]:
        return max(before, min(before + ANOTHER_EFFECT, LAST_EFFECT))
    if text.startswith("refitting") and "outside" in text:
        return max(before, DISCOVERY)
    known = next((share for words, share in STEPS if text.startswith(words)), before)
    return max(before, known)
