"""Threads that do not preempt others: they run when a processor is free, or at the next slice.

A part sends a burst of messages each step. Each wakes a thread of Zenoh, which on a busy machine
preempts the sending loop: 400 states were interrupted 250 times and took 24 ms instead of 5. Linux
lets a thread of class SCHED_BATCH wait for the end of the running slice (a few milliseconds) and
start at once on an idle processor; its share of the processor is the same (sched(7)).
"""

import contextlib
import os
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def yielding() -> Iterator[None]:
    """Start threads inside the block, and threads that they start, with class SCHED_BATCH.

    The caller's own class is restored afterwards. Does nothing on systems other than Linux, or if
    the caller has a class of its own (`chrt`).
    """
    if sys.platform != "linux" or os.sched_getscheduler(0) != os.SCHED_OTHER:
        yield
        return
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
