"""The pace of simulated time: it follows the clock, and what it cannot follow is counted as lost.

A tick covers the time since the last one, at most `LONGEST_TICK_NS`; the rest is lost and shows in
`real_time_factor`. The dynamics move in whole contact steps; what is left over waits for the next.
"""

from collections import deque

from scm.clock import NS_PER_S

CONTACT_STEP_NS = 5_000_000
LONGEST_TICK_NS = 100_000_000  # more at once would be too coarse for guards and drivers
WINDOW_NS = NS_PER_S  # of the real-time factor
LATE_PERIODS = 1.5  # a tick after a longer gap is late


class Pace:
    """Turns the clock's readings into contact steps.

    Attributes:
        late_ticks: Ticks that came later than one and a half periods after the one before.
        lost_ns: Time that passed without being simulated.
        simulated_ns: Time that was simulated since the start.
    """

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._last_ns: int | None = None
        self._owed_ns = 0
        self._history: deque[tuple[int, int]] = deque()
        self.late_ticks = 0
        self.lost_ns = 0
        self.simulated_ns = 0

    def steps(self, now_ns: int) -> int:
        """Return how many contact steps this tick has to make."""
        if self._last_ns is None:
            self._last_ns = now_ns
            self._history.append((now_ns, 0))
            return 0
        elapsed_ns = max(0, now_ns - self._last_ns)
        self._last_ns = max(now_ns, self._last_ns)
        self.late_ticks += elapsed_ns > LATE_PERIODS * self._period_ns
        covered_ns = min(elapsed_ns, LONGEST_TICK_NS)
        self.lost_ns += elapsed_ns - covered_ns
        whole, self._owed_ns = divmod(self._owed_ns + covered_ns, CONTACT_STEP_NS)
        self.simulated_ns += covered_ns
        self._remember(now_ns)
        return whole

    def until_ns(self, now_ns: int) -> int:
        """Return the time up to which the cars have been moved [ns]; at the start the present."""
        return now_ns if self._last_ns is None else self._last_ns - self._owed_ns

    @property
    def real_time_factor(self) -> float:
        """Simulated over elapsed time, over the last second; 1 before there is any."""
        if len(self._history) < 2:
            return 1.0
        (t0, s0), (t1, s1) = self._history[0], self._history[-1]
        return (s1 - s0) / (t1 - t0) if t1 > t0 else 1.0

    def _remember(self, now_ns: int) -> None:
        self._history.append((now_ns, self.simulated_ns))
        while len(self._history) > 2 and self._history[1][0] <= now_ns - WINDOW_NS:
            self._history.popleft()


class Every:
    """Something due at a fixed rate; never twice for one moment.

    Attributes:
        period_ns: Between two due moments.
    """

    def __init__(self, rate_hz: float, offset: float = 0.0) -> None:
        self.period_ns = round(NS_PER_S / rate_hz)
        self._offset_ns = round(offset * self.period_ns)
        self._next_ns: int | None = None

    def is_due(self, now_ns: int) -> bool:
        """Return whether a due moment has come since the last time this was true."""
        if self._next_ns is None:
            self._next_ns = now_ns + self._offset_ns
        if now_ns < self._next_ns:
            return False
        missed = (now_ns - self._next_ns) // self.period_ns
        self._next_ns += (missed + 1) * self.period_ns
        return True
