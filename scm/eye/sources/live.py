"""Frames of a live camera: read in a thread of its own that keeps only the newest.

The thread opens the camera, reads it until it is gone, and opens it again after a pause that
doubles from 0.5 s to 5 s, until the source is closed. Whatever a driver raises becomes trouble.
"""

import threading
from collections.abc import Callable
from contextlib import suppress

from scm.clock import Clock, WallClock, nanoseconds
from scm.eye.source import Frame
from scm.eye.sources.capture import Capture, DamagedFrameError
from scm.eye.sources.watch import Tally, Watch
from scm.v2x.messages.world_snapshot import WorldSnapshot

PAUSES_S = (0.5, 5.0)
CLOSE_S = 3.5


class LiveSource:
    """A camera that may come and go.

    Args:
        name: For what is said: `/dev/video0`, `rtsp://...` without its password.
        open_camera: Opens it; raises an `EyeError` that says why it cannot.
        delay_s: From exposure to arrival at the least, where the camera's stamps cannot tell.
        clock: Of arrivals; need not be the clock that `take` is called by.
        pauses_s: Before the first and before the last tries to open it again.
    """

    def __init__(
        self,
        name: str,
        open_camera: Callable[[], Capture],
        delay_s: float = 0.0,
        clock: Clock | None = None,
        pauses_s: tuple[float, float] = PAUSES_S,
    ) -> None:
        self.name = name
        self._open = open_camera
        self._clock = clock or WallClock()
        self._pauses_s = pauses_s
        self._watch = Watch(nanoseconds(delay_s))
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._capture: Capture | None = None
        self._newest: Frame | None = None
        self._lead_ns: int | None = None
        self._given_ns: int | None = None

    @property
    def trouble(self) -> str | None:
        """What is wrong now, in words; None: nothing."""
        with self._lock:
            said = self._watch.trouble(self._clock.now_ns()) if self._thread else None
        return f"{self.name}: {said}" if said else None

    @property
    def tally(self) -> Tally:
        """Counts since the start."""
        with self._lock:
            return self._watch.tally

    def take(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the newest frame not yet taken, None if there is none; never waits."""
        del light
        self._begin()
        self._follow(now_ns - self._clock.now_ns())
        with self._lock:
            newest, self._newest = self._newest, None
        if newest is None or self._lead_ns is None:
            return None
        t_ns = min(newest.t_ns + self._lead_ns, now_ns)
        if self._given_ns is not None and t_ns <= self._given_ns:
            return None
        self._given_ns = t_ns
        return Frame(t_ns, newest.image, newest.stamped)

    def close(self) -> None:
        """End the thread and let go of the camera; safe to call twice.

        A driver that will not return is waited for at most `CLOSE_S`; its thread then ends as soon
        as it does.
        """
        self._stop.set()
        with self._lock:
            self._newest = None
            if self._capture is not None:
                with suppress(Exception):
                    self._capture.interrupt()
        if self._thread is not None:
            self._thread.join(CLOSE_S)

    def _begin(self) -> None:
        if self._thread is None and not self._stop.is_set():
            self._watch.begin(self._clock.now_ns())
            name = f"frames of {self.name}"
            self._thread = threading.Thread(target=self._run, name=name, daemon=True)
            self._thread.start()

    def _follow(self, lead_ns: int) -> None:
        """Learn how far the caller's clock is ahead of ours: he read his before he called."""
        if self._lead_ns is None or lead_ns > self._lead_ns:
            self._lead_ns = lead_ns

    def _run(self) -> None:
        first_s, longest_s = self._pauses_s
        pause_s = first_s
        while not self._stop.is_set():
            good = self._watch.tally.good
            said = self._session()
            with self._lock:
                self._watch.gone(said)
            if self._watch.tally.good > good:
                pause_s = first_s
            self._stop.wait(pause_s)
            pause_s = min(2.0 * pause_s, longest_s)

    def _session(self) -> str:
        """Open the camera and read it until it is gone; return why it is."""
        try:
            capture = self._open()
        except Exception as cause:  # noqa: BLE001  a driver may raise anything; the eye must live
            return f"cannot open it: {cause}"
        with self._lock:
            self._capture = capture
            self._watch.opened()
        try:
            while not self._stop.is_set():
                self._read(capture)
        except Exception as cause:  # noqa: BLE001  same
            return str(cause) or type(cause).__name__
        finally:
            with self._lock:
                self._capture = None
            with suppress(Exception):
                capture.close()
        return "closed"

    def _read(self, capture: Capture) -> None:
        capture.wait()
        arrival_ns = self._clock.now_ns()
        try:
            grabbed = capture.fetch()
        except DamagedFrameError as cause:
            with self._lock:
                self._watch.damaged(str(cause), arrival_ns)
            return
        with self._lock:
            frame = self._watch.accept(grabbed, arrival_ns)
            if frame is None or self._stop.is_set():
                return
            if self._newest is not None:
                self._watch.passed_over()
            self._newest = frame
