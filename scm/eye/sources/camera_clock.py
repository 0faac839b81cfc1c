"""Maps a camera's own time stamps to our clock, by the minimum delay.

A frame exposed at `stamp` on the camera's clock arrives at `arrival` on ours. The difference is the
sum of clock offset and frame delay; delays vary, the offset hardly does, so the smallest recent
difference is used as the offset. The minimum delay itself cannot be separated from it and remains:
frames seem newer by that much.

Clocks drift: the smallest differences of 5 s each, over 5 minutes, give the slope (the Theil-Sen
estimator, robust to outliers). It is used after a minute.
"""

from collections import deque

import numpy as np

from scm.clock import NS_PER_S, seconds

SPAN_NS = 5 * NS_PER_S  # of which the quickest frame counts
SPANS, SPANS_RECENT, SPANS_LEAST = 60, 6, 12
JUMP_NS = NS_PER_S // 2  # a camera clock that steps back by more has jumped
MAX_LATE_NS = NS_PER_S // 2  # frames later than usual are reported
MAX_DRIFT = 1e-3  # of a crystal; more is a jump
REPORTED_DRIFT = 2e-4
REPORT_JUMP_NS = 2 * NS_PER_S  # for which a jump is reported


class CameraClock:
    """The mapping of one camera's clock, since the camera was opened.

    Attributes:
        drift: Relative rate by which the camera's clock is slower than ours; 0 until known.
    """

    def __init__(self) -> None:
        self.drift = 0.0
        self._spans: deque[tuple[int, int]] = deque(maxlen=SPANS)
        self._span = 0
        self._stamp_ns: int | None = None
        self._late_ns = 0
        self._jump: tuple[int, str] | None = None

    def exposed(self, stamp_ns: int, arrival_ns: int) -> int | None:
        """Return when a frame was exposed [ns, our clock], not after its arrival.

        None if its stamp equals the previous frame's, so that it is the same frame.
        """
        last_ns, self._stamp_ns = self._stamp_ns, stamp_ns
        if stamp_ns == last_ns:
            return None
        difference_ns = arrival_ns - stamp_ns
        if last_ns is not None and stamp_ns < last_ns:
            back_s = seconds(last_ns - stamp_ns)
            self._restart(arrival_ns, f"the camera's clock went back by {back_s:.3g} s")
        elif self._spans and difference_ns < self._offset_ns(arrival_ns) - JUMP_NS:
            ahead_s = seconds(self._offset_ns(arrival_ns) - difference_ns)
            self._restart(arrival_ns, f"the camera's clock jumped ahead by {ahead_s:.3g} s")
        self._note(arrival_ns, difference_ns)
        exposed_ns = min(stamp_ns + self._offset_ns(arrival_ns), arrival_ns)
        self._late_ns = arrival_ns - exposed_ns
        return exposed_ns

    def problem(self, now_ns: int) -> list[str]:
        """Return what is wrong with the camera's time stamps, in words."""
        text = []
        if self._jump is not None and now_ns - self._jump[0] < REPORT_JUMP_NS:
            text.append(self._jump[1])
        if self._late_ns > MAX_LATE_NS:
            text.append(f"frames come {seconds(self._late_ns):.1f} s later than the quickest")
        if abs(self.drift) > REPORTED_DRIFT:
            how = "slow" if self.drift > 0.0 else "fast"
            text.append(f"the camera's clock runs {abs(self.drift) * 1e6:.0f} ppm {how}")
        return text

    def _restart(self, now_ns: int, text: str) -> None:
        self._spans.clear()
        self.drift = 0.0
        self._jump = (now_ns, text)

    def _note(self, arrival_ns: int, difference_ns: int) -> None:
        """Store the smallest difference of each span of time."""
        span = arrival_ns // SPAN_NS
        if not self._spans or span != self._span:
            self._span = span
            self.drift = self._slope()
            self._spans.append((arrival_ns, difference_ns))
        elif difference_ns < self._spans[-1][1]:
            self._spans[-1] = (arrival_ns, difference_ns)

    def _slope(self) -> float:
        if len(self._spans) < SPANS_LEAST:
            return 0.0
        first_ns, first_difference_ns = self._spans[0]
        t = np.array([t_ns - first_ns for t_ns, _ in self._spans], dtype=float)
        d = np.array([d_ns - first_difference_ns for _, d_ns in self._spans], dtype=float)
        i, j = np.triu_indices(len(t), 1)
        slope = float(np.median((d[j] - d[i]) / (t[j] - t[i])))
        return min(max(slope, -MAX_DRIFT), MAX_DRIFT)

    def _offset_ns(self, now_ns: int) -> int:
        recent = list(self._spans)[-SPANS_RECENT:]
        return min(d_ns + round(self.drift * (now_ns - t_ns)) for t_ns, d_ns in recent)
