"""Threads that never push another aside: they wake when a processor is free, or at the next turn.

A part sends a burst of messages each step. Every one wakes a thread of Zenoh, which on a busy
machine takes the processor from the very loop that sends: 400 states were put aside 250 times and
took 24 ms instead of 5. Linux asks a thread of the class SCHED_BATCH to wait for the end of the
running one's turn (a few milliseconds) and lets it start at once where a processor idles; the share
of the processor it gets is the same (sched(7)).
"""

import contextlib
import os
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def yielding() -> Iterator[None]:
    """Make every thread that is started within, and those they start, a yielding one.

    The caller's own thread is as before afterwards. Nothing happens on systems other than Linux,
    or where the caller was given a class of its own (`chrt`).
    """
    if sys.platform != "linux" or os.sched_getscheduler(0) != os.SCHED_OTHER:
        yield
        return
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
