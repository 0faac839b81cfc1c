"""Frames of a live camera, read in a thread of its own that stores only the newest.

The thread opens the camera, reads it until it fails, and opens it again after a pause that doubles
from 0.5 s to 5 s, until the source is closed. Any exception of a driver becomes a fault.
"""

import threading
from collections.abc import Callable
from contextlib import suppress

from scm.clock import Clock, WallClock, nanoseconds
from scm.eye.source import Frame
from scm.eye.sources.capture import Capture, DamagedFrameError
from scm.eye.sources.frame_monitor import FrameMonitor, Tally
from scm.v2x.messages.world_snapshot import WorldSnapshot

PAUSES_S = (0.5, 5.0)  # between attempts to open: first, and at most; doubled each time
CLOSE_TIMEOUT_S = 3.5


class LiveSource:
    """A camera that may come and go.

    Args:
        name: For messages: `/dev/video0`, `rtsp://...` without its password.
        open_camera: Opens it; raises an `EyeError` with the reason if it cannot.
        delay_s: Minimum delay from exposure to arrival, for cameras without usable stamps.
        clock: Of arrivals; may differ from the clock of `read`.
        pauses_s: First and longest pause before it is opened again.
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
        self._monitor = FrameMonitor(nanoseconds(delay_s))
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._capture: Capture | None = None
        self._newest: Frame | None = None
        self._lead_ns: int | None = None
        self._given_ns: int | None = None

    @property
    def problem(self) -> str | None:
        """What is wrong now, in words; None if nothing is."""
        with self._lock:
            text = self._monitor.problem(self._clock.now_ns()) if self._thread else None
        return f"{self.name}: {text}" if text else None

    @property
    def tally(self) -> Tally:
        """Counts since the start."""
        with self._lock:
            return self._monitor.tally

    def read(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the newest frame not yet read, None if there is none; never waits."""
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
        """End the thread and release the camera; safe to call twice.

        Waits for a blocked driver for at most `CLOSE_TIMEOUT_S`; its thread ends as soon as the
        driver returns.
        """
        self._stop.set()
        with self._lock:
            self._newest = None
            if self._capture is not None:
                with suppress(Exception):
                    self._capture.interrupt()
        if self._thread is not None:
            self._thread.join(CLOSE_TIMEOUT_S)

    def _begin(self) -> None:
        if self._thread is None and not self._stop.is_set():
            self._monitor.begin(self._clock.now_ns())
            name = f"frames of {self.name}"
            self._thread = threading.Thread(target=self._run, name=name, daemon=True)
            self._thread.start()

    def _follow(self, lead_ns: int) -> None:
        """Estimate how far the caller's clock is ahead of ours; it was read before the call."""
        if self._lead_ns is None or lead_ns > self._lead_ns:
            self._lead_ns = lead_ns

    def _run(self) -> None:
        first_s, longest_s = self._pauses_s
        pause_s = first_s
        while not self._stop.is_set():
            good = self._monitor.tally.good
            text = self._session()
            with self._lock:
                self._monitor.gone(text)
            if self._monitor.tally.good > good:
                pause_s = first_s
            self._stop.wait(pause_s)
            pause_s = min(2.0 * pause_s, longest_s)

    def _session(self) -> str:
        """Open the camera and read it until it fails; return why."""
        try:
            capture = self._open()
        except Exception as cause:  # noqa: BLE001  a driver may raise anything; the Eye must survive
            return f"cannot open it: {cause}"
        with self._lock:
            self._capture = capture
            self._monitor.opened()
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
                self._monitor.damaged(str(cause), arrival_ns)
            return
        with self._lock:
            frame = self._monitor.accept(grabbed, arrival_ns)
            if frame is None or self._stop.is_set():
                return
            if self._newest is not None:
                self._monitor.passed_over()
            self._newest = frame
