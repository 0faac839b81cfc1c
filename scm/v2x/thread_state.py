"""Keep the Python thread state of Zenoh's threads from one callback to the next.

CPython creates a thread state, with its own stack, when a foreign thread enters, and deletes it
when the thread leaves: 8 us of the 11 us of Zenoh's shortest callback. One extra
`PyGILState_Ensure` per thread keeps the state.
"""

import ctypes
import threading

MAX_THREADS = 64
"""Per process: a pinned state outlives its thread (some 20 kB)."""


class ThreadStates:
    """The pinned thread states of this process.

    Attributes:
        pinned: Number of threads.
    """

    def __init__(self) -> None:
        self.pinned = 0
        self._lock = threading.Lock()
        self._own = threading.local()  # lives in the thread's state

    def pin(self) -> None:
        """Pin the state of the calling thread; costs almost nothing if it is pinned already."""
        if getattr(self._own, "is_pinned", False):
            return
        with self._lock:
            if self.pinned >= MAX_THREADS:
                return
            self.pinned += 1
        self._own.is_pinned = True
        ctypes.pythonapi.PyGILState_Ensure()


THREAD_STATES = ThreadStates()
