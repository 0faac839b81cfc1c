"""Frames that were taken before, played at their own pace from the first `take` on."""

from typing import Protocol

from scm.arrays import Image
from scm.clock import NS_PER_S
from scm.errors import EyeError
from scm.eye.source import Frame
from scm.v2x.messages.world_snapshot import WorldSnapshot

MOST_LEFT_OUT = 30
HOLD_NS = NS_PER_S
"""A picture that cannot be used is told of so long, or nobody would hear of a single one."""


class Reel(Protocol):
    """Pictures in a row, each with its time since the first."""

    def next_ns(self) -> int | None:
        """Return the time of the next picture [ns], None at the end."""
        ...

    def following_ns(self) -> int | None:
        """Return when the picture after the next is due [ns], None if that is the last."""
        ...

    def skip(self) -> None:
        """Leave the next picture out."""
        ...

    def show(self) -> Image:
        """Return the next picture and go on to the one after.

        Raises:
            EyeError: It cannot be read; the one after may be good.
        """
        ...

    def rewind(self) -> int:
        """Go back to the first picture; return how long after the first one this was [ns]."""
        ...

    def close(self) -> None:
        """Close what is open; safe to call twice."""
        ...


class Player:
    """A source that plays a reel.

    Pictures are decoded when they are taken, so the same calls give the same frames; of those
    already late at most `MOST_LEFT_OUT` are left out in one `take`.

    Args:
        name: For what is said.
        reel: What to play.
        loop: Begin again when it is over, time going on.

    Attributes:
        trouble: What is wrong now, in words; None: nothing.
    """

    def __init__(self, name: str, reel: Reel, loop: bool) -> None:
        self.trouble: str | None = None
        self._name = name
        self._reel = reel
        self._loop = loop
        self._started_ns: int | None = None
        self._size: tuple[int, int] | None = None
        self._spoiled_ns: int | None = None
        self._closed = False

    def take(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the frame that is due, leaving out those already late; None when over."""
        del light
        if self._closed:
            return None
        if self._started_ns is None:
            self._started_ns = now_ns
        for _ in range(MOST_LEFT_OUT):
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
        """Return when the reel was begun and when in it the next picture is, None when over."""
        next_ns = self._reel.next_ns()
        if next_ns is None and self._loop:
            started_ns += self._reel.rewind()
            next_ns = self._reel.next_ns()
        if next_ns is None:
            self.trouble = f"{self._name}: over"
        return started_ns, next_ns

    def _spoil(self, said: str, t_ns: int) -> None:
        self.trouble, self._spoiled_ns = said, t_ns

    def _show(self, t_ns: int) -> Frame | None:
        try:
            image = self._reel.show()
        except EyeError as cause:
            self._spoil(str(cause), t_ns)
            return None
        size = (image.shape[1], image.shape[0])
        self._size = self._size or size
        if size != self._size:
            was, now = (f"{width} x {height}" for width, height in (self._size, size))
            said = f"{self._name}: size changed from {was} to {now} px: frames left out"
            self._spoil(said, t_ns)
            return None
        if self._spoiled_ns is None or t_ns - self._spoiled_ns >= HOLD_NS:
            self.trouble = None
        return Frame(t_ns, image)
