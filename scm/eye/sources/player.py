"""Plays recorded frames at their own rate from the first `read` on."""

from typing import Protocol

from scm.arrays import Image
from scm.clock import NS_PER_S
from scm.errors import EyeError
from scm.eye.source import Frame
from scm.v2x.messages.world_snapshot import WorldSnapshot

MAX_SKIPPED = 30  # frames in one read, so that a read stays short
HOLD_NS = NS_PER_S
"""How long a single unusable picture is reported as a fault."""


class Reel(Protocol):
    """A sequence of pictures with their times since the first."""

    def next_ns(self) -> int | None:
        """Return the time of the next picture [ns], None at the end."""
        ...

    def following_ns(self) -> int | None:
        """Return when the picture after the next is due [ns], None if that is the last."""
        ...

    def skip(self) -> None:
        """Skip the next picture."""
        ...

    def show(self) -> Image:
        """Return the next picture and advance.

        Raises:
            EyeError: It cannot be read; the next one may be good.
        """
        ...

    def rewind(self) -> int:
        """Go back to the first picture; return how long after the previous first it is [ns]."""
        ...

    def close(self) -> None:
        """Close what is open; safe to call twice."""
        ...


class Player:
    """A source that plays a reel.

    Pictures are decoded when they are read, so the same calls give the same frames; of those
    already late at most `MAX_SKIPPED` are skipped in one `read`.

    Args:
        name: For messages.
        reel: What to play.
        loop: Whether to restart at the end; time continues.

    Attributes:
        problem: What is wrong now, in words; None if nothing is.
    """

    def __init__(self, name: str, reel: Reel, loop: bool) -> None:
        self.problem: str | None = None
        self._name = name
        self._reel = reel
        self._loop = loop
        self._started_ns: int | None = None
        self._size: tuple[int, int] | None = None
        self._fault_ns: int | None = None
        self._closed = False

    def read(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the frame that is due, skipping late ones; None at the end."""
        del light
        if self._closed:
            return None
        if self._started_ns is None:
            self._started_ns = now_ns
        for _ in range(MAX_SKIPPED):
            following_ns = self._reel.following_ns()
            if following_ns is None or self._started_ns + following_ns > now_ns:
                break
            self._reel.skip()
        started_ns, next_ns = self._next(self._started_ns)
        self._started_ns = started_ns
        if next_ns is None or started_ns + next_ns > now_ns:
            return None
        return self._show(started_ns + next_ns)

    def close(self) -> None:
        """Close what is open; safe to call twice."""
        self._closed = True
        self._reel.close()

    def _next(self, started_ns: int) -> tuple[int, int | None]:
        """Return the reel's start and the time in it of the next picture, None at the end."""
        next_ns = self._reel.next_ns()
        if next_ns is None and self._loop:
            started_ns += self._reel.rewind()
            next_ns = self._reel.next_ns()
        if next_ns is None:
            self.problem = f"{self._name}: over"
        return started_ns, next_ns

    def _report_fault(self, text: str, t_ns: int) -> None:
        self.problem, self._fault_ns = text, t_ns

    def _show(self, t_ns: int) -> Frame | None:
        try:
            image = self._reel.show()
        except EyeError as cause:
            self._report_fault(str(cause), t_ns)
            return None
        size = (image.shape[1], image.shape[0])
        self._size = self._size or size
        if size != self._size:
            was, now = (f"{width} x {height}" for width, height in (self._size, size))
            text = f"{self._name}: size changed from {was} to {now} px: frames left out"
            self._report_fault(text, t_ns)
            return None
        if self._fault_ns is None or t_ns - self._fault_ns >= HOLD_NS:
            self.problem = None
        return Frame(t_ns, image)
