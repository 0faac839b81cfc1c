"""Frames that come over the bus, from a camera whose computer is somewhere else."""

from scm.clock import nanoseconds
from scm.errors import EyeError
from scm.eye.picture import decode_picture
from scm.eye.source import Frame
from scm.eye.sources.capture import Grabbed
from scm.eye.sources.watch import Tally, Watch
from scm.runtime.part import Subscription
from scm.v2x.exchange import Incoming
from scm.v2x.key import check_name
from scm.v2x.messages.eye_picture_in import EyePictureIn
from scm.v2x.messages.world_snapshot import WorldSnapshot


class BusSource:
    """The pictures of one camera on the bus; only the newest is decoded, when it is taken.

    Args:
        camera: Whose, as in the key of `EyePictureIn`.
        delay_s: From exposure to arrival at the least, where the sender's clock is not ours.

    Attributes:
        hears: What the part must hear for it.

    Raises:
        MessageError: The camera's name may not stand in a key.
    """

    def __init__(self, camera: str, delay_s: float = 0.0) -> None:
        self.camera = check_name(camera, "camera")
        self.subscriptions = (Subscription(EyePictureIn, {"camera": camera}),)
        self._watch = Watch(nanoseconds(delay_s))
        self._newest: tuple[EyePictureIn, int] | None = None
        self._now_ns = 0
        self._closed = False

    @property
    def trouble(self) -> str | None:
        """What was wrong at the last `take`, in words; None: nothing."""
        said = self._watch.trouble(self._now_ns)
        return f"bus:{self.camera}: {said}" if said else None

    @property
    def tally(self) -> Tally:
        """Counts since the start."""
        return self._watch.tally

    def hear(self, item: Incoming) -> None:
        """Keep the picture, if this is one of ours."""
        message = item.message
        if isinstance(message, EyePictureIn) and message.camera == self.camera:
            if self._newest is not None:
                self._watch.passed_over()
            self._newest = (message, item.t_ns)

    def take(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the newest picture not yet taken, None if there is none."""
        del light
        self._now_ns = now_ns
        self._watch.begin(now_ns)
        newest, self._newest = self._newest, None
        if newest is None or self._closed:
            return None
        picture, arrival_ns = newest
        try:
            image = decode_picture(picture.payload, "a frame")
        except EyeError as cause:
            self._watch.damaged(str(cause), arrival_ns)
            return None
        age_ns = arrival_ns - picture.t_ns if picture.shares_clock else None
        return self._watch.accept(Grabbed(image, picture.t_ns, age_ns), arrival_ns)

    def close(self) -> None:
        """Take nothing more; safe to call twice."""
        self._closed = True
        self._newest = None
