"""What becomes of each frame of a live camera, and what to say of it; without a thread or clock."""

import dataclasses
from dataclasses import dataclass

from scm.clock import NS_PER_S, seconds
from scm.eye.source import Frame, Stamped
from scm.eye.sources.camera_clock import CameraClock
from scm.eye.sources.capture import Grabbed
from scm.eye.sources.frame_check import FrameCheck

STALL_NS = NS_PER_S
HOLD_NS = NS_PER_S
AGE_LARGEST_NS = 5 * NS_PER_S


@dataclass(frozen=True, slots=True)
class Tally:
    """Counts since the start.

    Attributes:
        good: Frames that could be used.
        passed_over: Good ones that a newer one replaced before anybody took them.
        damaged: Frames that could not be decoded.
        repeated: Frames with the time of the one before, or an earlier one.
        resized: Frames of another size than the first one.
        opened: How often the camera was opened.
    """

    good: int = 0
    passed_over: int = 0
    damaged: int = 0
    repeated: int = 0
    resized: int = 0
    opened: int = 0


class Watch:
    """One live camera's frames: checked, stamped, counted.

    Args:
        delay_ns: From exposure to arrival at the least, where the camera's stamps cannot tell.

    Attributes:
        tally: What came so far.
    """

    def __init__(self, delay_ns: int = 0) -> None:
        self.tally = Tally()
        self._delay_ns = delay_ns
        self._check = FrameCheck()
        self._clock = CameraClock()
        self._size: tuple[int, int] | None = None
        self._frame_ns: int | None = None
        self._heard_ns: int | None = None
        self._gone: str | None = None
        self._resized: str | None = None
        self._empty: str | None = None
        self._damaged: tuple[int, str] | None = None

    def begin(self, now_ns: int) -> None:
        """Count the time without a frame from here on."""
        if self._heard_ns is None:
            self._heard_ns = now_ns

    def opened(self) -> None:
        """Note that the camera was opened, perhaps again: its clock is a new one."""
        self._clock = CameraClock()
        self._count(opened=1)

    def gone(self, said: str) -> None:
        """Note that there is no camera now."""
        self._gone = said

    def damaged(self, said: str, now_ns: int) -> None:
        """Note a frame that could not be decoded."""
        self._count(damaged=1)
        self._damaged = (now_ns, said)

    def passed_over(self) -> None:
        """Note that nobody took a frame."""
        self._count(passed_over=1)

    def accept(self, grabbed: Grabbed, arrival_ns: int) -> Frame | None:
        """Return the frame with its time, None where it must not be used."""
        self._heard_ns = arrival_ns
        self._gone = None
        self._empty = self._check.look(grabbed.image, arrival_ns)
        if not self._is_first_size(grabbed):
            self._count(resized=1)
            return None
        t_ns, stamped = self._exposed(grabbed, arrival_ns)
        if t_ns is None or (self._frame_ns is not None and t_ns <= self._frame_ns):
            self._count(repeated=1)
            return None
        self._frame_ns = t_ns
        self._count(good=1)
        return Frame(t_ns, grabbed.image, stamped)

    def trouble(self, now_ns: int) -> str | None:
        """Return what is wrong now, the worst first."""
        said = [self._gone, self._silence(now_ns), self._resized]
        if self._damaged is not None and now_ns - self._damaged[0] < HOLD_NS:
            said.append(f"{self._damaged[1]} ({self.tally.damaged} damaged so far)")
        if self._gone is None:
            said += [self._empty, *self._clock.trouble(now_ns)]
        return "; ".join(text for text in said if text) or None

    def _silence(self, now_ns: int) -> str | None:
        if self._heard_ns is None or now_ns - self._heard_ns <= STALL_NS:
            return None
        return f"no frame for {seconds(now_ns - self._heard_ns):.1f} s"

    def _is_first_size(self, grabbed: Grabbed) -> bool:
        """Return whether the frame has the size of the first one: a lens is known for one size."""
        size = (grabbed.image.shape[1], grabbed.image.shape[0])
        self._size = self._size or size
        (width, height), (first_width, first_height) = size, self._size
        self._resized = None
        if size != self._size:
            first = f"{first_width} x {first_height}"
            self._resized = f"size changed from {first} to {width} x {height} px: frames left out"
        return size == self._size

    def _exposed(self, grabbed: Grabbed, arrival_ns: int) -> tuple[int | None, Stamped]:
        if grabbed.age_ns is not None and 0 <= grabbed.age_ns <= AGE_LARGEST_NS:
            return arrival_ns - grabbed.age_ns, "exposed"
        if grabbed.stamp_ns is None:
            return arrival_ns - self._delay_ns, "arrived"
        mapped_ns = self._clock.exposed(grabbed.stamp_ns, arrival_ns)
        return (None if mapped_ns is None else mapped_ns - self._delay_ns), "exposed"

    def _count(self, **more: int) -> None:
        counts = {name: getattr(self.tally, name) + count for name, count in more.items()}
        self.tally = dataclasses.replace(self.tally, **counts)
