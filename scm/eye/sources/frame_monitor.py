"""Checks, time stamps and counts the frames of a live camera; without a thread or clock."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from scm.arrays import Image
from scm.clock import NS_PER_S, seconds
from scm.eye.source import Frame, Stamped
from scm.eye.sources.camera_clock import CameraClock
from scm.eye.sources.capture import Grabbed

STALL_NS = NS_PER_S
HOLD_NS = NS_PER_S
MAX_AGE_NS = 5 * NS_PER_S  # that a driver may state
SAMPLE_STEP_PX = 16
FROZEN_NS = NS_PER_S
BLACK, BLACK_SHARE = 20, 0.995
WHITE, WHITE_SHARE = 252, 0.5
MIN_GREY_RANGE = 3  # of a picture that is not one flat grey


@dataclass(frozen=True, slots=True)
class Tally:
    """Counts since the start.

    Attributes:
        good: Usable frames.
        passed_over: Good ones replaced by a newer one before they were read.
        damaged: Frames that could not be decoded.
        repeated: Frames with the time of the previous one, or an earlier one.
        resized: Frames of another size than the first one.
        opened: Number of times the camera was opened.
    """

    good: int = 0
    passed_over: int = 0
    damaged: int = 0
    repeated: int = 0
    resized: int = 0
    opened: int = 0


class FrameCheck:
    """Checks whether the frames of one live camera show anything."""

    def __init__(self) -> None:
        self._last = np.empty((0, 0), dtype=np.uint8)
        self._since_ns = 0

    def look(self, image: Image, t_ns: int) -> str | None:
        """Return what is wrong with a frame that arrived at `t_ns`, None if nothing is."""
        some = image[::SAMPLE_STEP_PX, ::SAMPLE_STEP_PX]
        some = np.ascontiguousarray(some if some.ndim == 2 else some[..., 1])
        if not np.array_equal(some, self._last):
            self._last, self._since_ns = some, t_ns
        return _empty(some) or self._frozen(t_ns)

    def _frozen(self, t_ns: int) -> str | None:
        still_ns = t_ns - self._since_ns
        if still_ns <= FROZEN_NS:
            return None
        return f"frames are frozen: the same picture for {still_ns / NS_PER_S:.1f} s"


def _empty(some: Image) -> str | None:
    if np.count_nonzero(some <= BLACK) >= BLACK_SHARE * some.size:
        return "frames are black"
    white = np.count_nonzero(some >= WHITE) / some.size
    if white > WHITE_SHARE:
        return f"frames are overexposed: {100.0 * white:.0f} % of the picture is white"
    if int(some.max()) - int(some.min()) < MIN_GREY_RANGE:
        return f"frames are one flat grey of {int(some.mean())}"
    return None


class FrameMonitor:
    """One live camera's frames: checked, stamped, counted.

    Args:
        delay_ns: Minimum delay from exposure to arrival, for cameras without usable stamps.

    Attributes:
        tally: Counts so far.
    """

    def __init__(self, delay_ns: int = 0) -> None:
        self.tally = Tally()
        self._delay_ns = delay_ns
        self._check = FrameCheck()
        self._clock = CameraClock()
        self._size: tuple[int, int] | None = None
        self._frame_ns: int | None = None
        self._arrival_ns: int | None = None
        self._gone: str | None = None
        self._resized: str | None = None
        self._empty: str | None = None
        self._damaged: tuple[int, str] | None = None

    def begin(self, now_ns: int) -> None:
        """Start to count the time without a frame."""
        if self._arrival_ns is None:
            self._arrival_ns = now_ns

    def opened(self) -> None:
        """Note that the camera was opened, perhaps again: its clock is a new one."""
        self._clock = CameraClock()
        self._count(opened=1)

    def gone(self, text: str) -> None:
        """Note that there is no camera now."""
        self._gone = text

    def damaged(self, text: str, now_ns: int) -> None:
        """Note a frame that could not be decoded."""
        self._count(damaged=1)
        self._damaged = (now_ns, text)

    def passed_over(self) -> None:
        """Note that a frame was not read."""
        self._count(passed_over=1)

    def accept(self, grabbed: Grabbed, arrival_ns: int) -> Frame | None:
        """Return the frame with its time, None if it must not be used."""
        self._arrival_ns = arrival_ns
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

    def problem(self, now_ns: int) -> str | None:
        """Return what is wrong now, the worst first."""
        text = [self._gone, self._silence(now_ns), self._resized]
        if self._damaged is not None and now_ns - self._damaged[0] < HOLD_NS:
            text.append(f"{self._damaged[1]} ({self.tally.damaged} damaged so far)")
        if self._gone is None:
            text += [self._empty, *self._clock.problem(now_ns)]
        return "; ".join(text for text in text if text) or None

    def _silence(self, now_ns: int) -> str | None:
        if self._arrival_ns is None or now_ns - self._arrival_ns <= STALL_NS:
            return None
        return f"no frame for {seconds(now_ns - self._arrival_ns):.1f} s"

    def _is_first_size(self, grabbed: Grabbed) -> bool:
        """Return whether the frame has the first one's size: a lens is calibrated for one size."""
        size = (grabbed.image.shape[1], grabbed.image.shape[0])
        self._size = self._size or size
        (width, height), (first_width, first_height) = size, self._size
        self._resized = None
        if size != self._size:
            first = f"{first_width} x {first_height}"
            self._resized = f"size changed from {first} to {width} x {height} px: frames left out"
        return size == self._size

    def _exposed(self, grabbed: Grabbed, arrival_ns: int) -> tuple[int | None, Stamped]:
        if grabbed.age_ns is not None and 0 <= grabbed.age_ns <= MAX_AGE_NS:
            return arrival_ns - grabbed.age_ns, "exposed"
        if grabbed.stamp_ns is None:
            return arrival_ns - self._delay_ns, "arrived"
        mapped_ns = self._clock.exposed(grabbed.stamp_ns, arrival_ns)
        return (None if mapped_ns is None else mapped_ns - self._delay_ns), "exposed"

    def _count(self, **more: int) -> None:
        counts = {name: getattr(self.tally, name) + count for name, count in more.items()}
        self.tally = dataclasses.replace(self.tally, **counts)
