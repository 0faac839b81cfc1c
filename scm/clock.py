"""Time for everything that waits. Nothing else in the project reads the system's clock.

`t_ns` is an integer count of nanoseconds, monotonic within a process. Live clocks are anchored to
the epoch once, at construction, and then follow the monotonic counter: a step of the system's time
(NTP, a person) never moves a dead-man or a signal phase.
"""

import threading
import time
from typing import Protocol

NS_PER_S = 1_000_000_000
NS_PER_MS = 1_000_000

TICK_NS = 25 * NS_PER_MS
"""What many at one router keep to when any instant would do: it wakes once for all of a beat."""


def next_tick_ns(t_ns: int) -> int:
    """Return the first beat at or after an instant [ns]: a whole multiple of `TICK_NS`."""
    return -(-t_ns // TICK_NS) * TICK_NS


def seconds(t_ns: int) -> float:
    """Return a span of nanoseconds as seconds."""
    return t_ns / NS_PER_S


def nanoseconds(t_s: float) -> int:
    """Return a span of seconds as whole nanoseconds."""
    return round(t_s * NS_PER_S)


def processor_s() -> float:
    """Return the processor time that this process has had so far, on all its threads [s]."""
    return time.process_time()


def waited_ns() -> int:
    """Return how long this thread has waited for a processor so far [ns]; 0: not known.

    Linux counts it per thread: the time in which it could have run, and another one did.
    """
    try:
        with open("/proc/thread-self/schedstat", encoding="ascii") as stat:  # noqa: PTH123 often
            return int(stat.read().split()[1])
    except (OSError, ValueError, IndexError):
        return 0


class Clock(Protocol):
    """What a part's runner needs of time."""

    def now_ns(self) -> int:
        """Return the present time [ns]."""
        ...

    def wait_until(self, t_ns: int, wake: threading.Event) -> bool:
        """Wait until `t_ns` or until `wake` is set; return whether `wake` is set."""
        ...


class WallClock:
    """The system's time, anchored to the epoch once and monotonic from then on."""

    def __init__(self) -> None:
        self._offset_ns = time.time_ns() - time.monotonic_ns()

    def now_ns(self) -> int:
        """Return nanoseconds since the epoch [ns]."""
        return self._offset_ns + time.monotonic_ns()

    def wait_until(self, t_ns: int, wake: threading.Event) -> bool:
        """Wait until `t_ns` or until `wake` is set; return whether `wake` is set."""
        remaining_s = seconds(t_ns - self.now_ns())
        return wake.wait(remaining_s) if remaining_s > 0.0 else wake.is_set()


class ProcessorClock:
    """This process's processor time: what is done in it does not depend on other processes."""

    def now_ns(self) -> int:
        """Return the processor time of all threads so far [ns]."""
        return time.process_time_ns()

    def wait_until(self, t_ns: int, wake: threading.Event) -> bool:
        """Return whether `wake` is set: this time does not pass while one waits."""
        del t_ns
        return wake.is_set()


class StepClock:
    """A clock that moves only when it is set, for lockstep runs and tests."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return the time it was last set to [ns]."""
        return self._now_ns

    def set_ns(self, t_ns: int) -> None:
        """Move to `t_ns`.

        Raises:
            ValueError: when `t_ns` lies before the present time.
        """
        if t_ns < self._now_ns:
            msg = f"a clock never goes back: now {self._now_ns} ns, asked for {t_ns} ns"
            raise ValueError(msg)
        self._now_ns = t_ns

    def wait_until(self, t_ns: int, wake: threading.Event) -> bool:
        """Move to `t_ns` at once; return whether `wake` is set."""
        self.set_ns(max(t_ns, self._now_ns))
        return wake.is_set()
