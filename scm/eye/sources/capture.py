"""What a live source needs of a camera that is open: wait for a frame, fetch it, let go."""

from dataclasses import dataclass
from typing import Protocol

from scm.arrays import Image
from scm.errors import EyeError


class DamagedFrameError(EyeError):
    """A frame came and cannot be used; the next one may be good."""


@dataclass(frozen=True, slots=True, eq=False)
class Grabbed:
    """One frame as the camera gave it.

    Attributes:
        image: (height, width, 3) blue, green, red, or (height, width) grey.
        stamp_ns: When it was exposed on the camera's own clock, whatever that counts from.
        age_ns: How long before its arrival it was exposed, from a camera that shares our clock;
            counts more than `stamp_ns`.
    """

    image: Image
    stamp_ns: int | None = None
    age_ns: int | None = None


class Capture(Protocol):
    """An open camera. One thread waits, fetches and closes; any thread may interrupt."""

    def wait(self) -> None:
        """Wait until a frame is there; seconds at the most.

        Raises:
            EyeError: The camera is gone.
        """
        ...

    def fetch(self) -> Grabbed:
        """Return the frame that `wait` found.

        Raises:
            DamagedFrameError: It cannot be used.
            EyeError: The camera is gone.
        """
        ...

    def interrupt(self) -> None:
        """Make a `wait` that another thread is in end soon, where the camera allows it."""
        ...

    def close(self) -> None:
        """Let go of the camera."""
        ...
