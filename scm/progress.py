"""Progress of long work: on a terminal a line that is redrawn, elsewhere a line now and then."""

import threading
from collections.abc import Callable
from typing import TextIO

from scm.clock import Clock, seconds

CLEARED = "\r\033[K"
REDRAWN_S, REPEATED_S = 0.5, 20.0
BAR = 24


def bar(share: float) -> str:
    """Draw a share of 0 to 1."""
    filled = round(BAR * share)
    return "[" + "#" * filled + "." * (BAR - filled) + "]"


class ProgressLine:
    """Shows a line until it is closed, so that long work does not look like a hung program.

    Args:
        stream: Where to; a line that is drawn anew twice a second if it is a terminal.
        drawn: Returns the line for a terminal as it is now.
        written: Returns the line for anything else, which is written when `show` is called and
            every 20 s from then on.
    """

    def __init__(
        self, stream: TextIO, drawn: Callable[[], str], written: Callable[[], str]
    ) -> None:
        self._stream = stream
        self._is_terminal = stream.isatty()
        self._line = drawn if self._is_terminal else written
        self._over, self._changed = threading.Event(), threading.Event()
        self._lock = threading.Lock()
        self._repeating = threading.Thread(target=self._repeat, daemon=True)

    def show(self) -> None:
        """Show the line now: it has changed."""
        if not self._repeating.is_alive() and not self._over.is_set():
            self._repeating.start()
        self._changed.set()
        self._write()

    def close(self) -> None:
        """Take the line off a terminal; elsewhere end."""
        self._over.set()
        self._changed.set()
        if self._repeating.is_alive():
            self._repeating.join()
            if self._is_terminal:
                self._stream.write(CLEARED)
                self._stream.flush()

    def _repeat(self) -> None:
        while not self._over.is_set():
            self._changed.clear()
            if not self._changed.wait(REDRAWN_S if self._is_terminal else REPEATED_S):
                self._write()

    def _write(self) -> None:
        line = self._line()
        with self._lock:
            self._stream.write(CLEARED + line if self._is_terminal else line + "\n")
            self._stream.flush()


class Progress:
    """Shows the current step of long work, and how much of it is done.

    Args:
        stream: Where to.
        clock: For the seconds.
    """

    def __init__(self, stream: TextIO, clock: Clock) -> None:
        self._clock, self._began_ns = clock, clock.now_ns()
        self._step, self._done, self._of = "", 0, 0
        self._shown = ProgressLine(stream, self.line, self.line)

    def step(self, what: str, done: int = 0, of: int = 0) -> None:
        """Set the current step; `done` of `of` things, where they are counted.

        Only a new step is shown at once: a count may change many times a second.
        """
        is_new = what != self._step
        self._step, self._done, self._of = what, done, of
        if is_new:
            self._shown.show()

    def line(self) -> str:
        """Return the line as it is now."""
        took_s = seconds(self._clock.now_ns() - self._began_ns)
        if not self._of:
            return f"{took_s:5.0f} s  {self._step}"
        share = bar(self._done / self._of)
        return f"{took_s:5.0f} s  {self._step} {share} {self._done} of {self._of}"

    def close(self) -> None:
        """End it."""
        self._shown.close()
