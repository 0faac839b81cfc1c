"""Frames from the bus, of a camera on another computer."""

from scm.clock import nanoseconds
from scm.errors import EyeError
from scm.eye.picture import decode_picture
from scm.eye.source import Frame
from scm.eye.sources.capture import Grabbed
from scm.eye.sources.frame_monitor import FrameMonitor, Tally
from scm.runtime.part import Subscription
from scm.v2x.exchange import Incoming
from scm.v2x.key import check_name
from scm.v2x.messages.eye_picture_in import EyePictureIn
from scm.v2x.messages.world_snapshot import WorldSnapshot


class BusSource:
    """The pictures of one camera on the bus; only the newest is decoded, when it is read.

    Args:
        camera: Name of the camera, as in the key of `EyePictureIn`.
        delay_s: Minimum delay from exposure to arrival, for senders with another clock.

    Attributes:
        subscriptions: The subscriptions that its part needs.

    Raises:
        MessageError: The camera's name is not valid in a key.
    """

    def __init__(self, camera: str, delay_s: float = 0.0) -> None:
        self.camera = check_name(camera, "camera")
        self.subscriptions = (Subscription(EyePictureIn, {"camera": camera}),)
        self._monitor = FrameMonitor(nanoseconds(delay_s))
        self._newest: tuple[EyePictureIn, int] | None = None
        self._now_ns = 0
        self._closed = False

    @property
    def problem(self) -> str | None:
        """What was wrong at the last `read`, in words; None if nothing was."""
        text = self._monitor.problem(self._now_ns)
        return f"bus:{self.camera}: {text}" if text else None

    @property
    def tally(self) -> Tally:
        """Counts since the start."""
        return self._monitor.tally

    def receive(self, item: Incoming) -> None:
        """Store the picture, if it is this camera's."""
        message = item.message
        if isinstance(message, EyePictureIn) and message.camera == self.camera:
            if self._newest is not None:
                self._monitor.passed_over()
            self._newest = (message, item.t_ns)

    def read(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the newest picture not yet read, None if there is none."""
        del light
        self._now_ns = now_ns
        self._monitor.begin(now_ns)
        newest, self._newest = self._newest, None
        if newest is None or self._closed:
            return None
        picture, arrival_ns = newest
        try:
            image = decode_picture(picture.payload, "a frame")
        except EyeError as cause:
            self._monitor.damaged(str(cause), arrival_ns)
            return None
        age_ns = arrival_ns - picture.t_ns if picture.shares_clock else None
        return self._monitor.accept(Grabbed(image, picture.t_ns, age_ns), arrival_ns)

    def close(self) -> None:
        """Stop; safe to call twice."""
        self._closed = True
        self._newest = None
