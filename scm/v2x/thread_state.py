"""Keep the Python state of a thread that is not Python's own, from one callback to the next.

CPython makes a thread state, with a stack of its own, when a thread that it did not start comes in,
and throws it away when the thread leaves: 8 us of the 11 us that the shortest callback of Zenoh
cost. Whoever comes in once more than he leaves keeps his.
"""

import ctypes
import threading

MAX_THREADS = 64
"""Threads of one process: what is kept for one outlives it (some 20 kB)."""


class ThreadStates:
    """The states kept in this process.

    Attributes:
        kept: Of how many threads.
    """

    def __init__(self) -> None:
        self.pinned = 0
        self._lock = threading.Lock()
        self._own = threading.local()  # lives in the thread's state: gone if that is not kept

    def pin(self) -> None:
        """Keep the state of the calling thread; costs next to nothing when it is kept already."""
        if getattr(self._own, "is_pinned", False):
            return
        with self._lock:
            if self.pinned >= MAX_THREADS:
                return
            self.pinned += 1
        self._own.is_pinned = True
        ctypes.pythonapi.PyGILState_Ensure()


THREAD_STATES = ThreadStates()
