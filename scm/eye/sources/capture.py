"""The contract of an open camera: wait for a frame, fetch it, close."""

from dataclasses import dataclass
from typing import Protocol

from scm.arrays import Image
from scm.errors import EyeError


class DamagedFrameError(EyeError):
    """A frame arrived damaged; the next one may be good."""


@dataclass(frozen=True, slots=True, eq=False)
class Grabbed:
    """One frame from the camera.

    Attributes:
        image: (height, width, 3) blue, green, red, or (height, width) grey.
        stamp_ns: Exposure time on the camera's own clock, with any origin.
        age_ns: Time from exposure to arrival, from a camera that shares our clock; takes
            precedence over `stamp_ns`.
    """

    image: Image
    stamp_ns: int | None = None
    age_ns: int | None = None


class Capture(Protocol):
    """An open camera. One thread waits, fetches and closes; any thread may interrupt."""

    def wait(self) -> None:
        """Wait until a frame arrives; a few seconds at most.

        Raises:
            EyeError: The camera is gone.
        """
        ...

    def fetch(self) -> Grabbed:
        """Return the frame that `wait` found.

        Raises:
            DamagedFrameError: It is damaged.
            EyeError: The camera is gone.
        """
        ...

    def interrupt(self) -> None:
        """Interrupt another thread's `wait`, if the camera allows it."""
        ...

    def close(self) -> None:
        """Release the camera."""
        ...
