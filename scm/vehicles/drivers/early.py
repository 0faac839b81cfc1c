"""What a first start compiles, shared with a second process: two cores compile twice as fast.

A copy of this process takes jobs from the same heap. What it compiles lies in the cache when this
process comes to need it, so nothing has to be sent back. Only the first start on a machine does
this: afterwards all of it lies in the cache.
"""

import contextlib
import gc
import logging
import os
import select
import signal
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from itertools import chain

from scm.log import event
from scm.vehicles.drivers.controller import decide
from scm.vehicles.jit import is_kept, load_compiler

Job = Callable[[], object]

_GRACE_S = 60.0
_MEEK = 10
_LOG = logging.getLogger(__name__)


def is_first_start() -> bool:
    """Return whether this machine has never compiled the driver, or it has changed since."""
    return not is_kept(decide)


def compile_together(jobs: Sequence[Job]) -> None:
    """Do jobs that compile or load, the dearest first; beside a second process if it is worth it.

    It is when the driver has to be compiled, and this process has one thread: a copy of more could
    wait for those that are not in it. Jobs may be done in either process, or in both.
    """
    if not is_first_start() or threading.active_count() > 1 or not hasattr(os, "fork"):
        for job in jobs:
            job()
        return
    event(_LOG, "first_start", doing="compiling physics and drivers, once", takes_s=5)
    with _uncollected():
        load_compiler()
        share(jobs)


def share(jobs: Sequence[Job]) -> None:
    """Do jobs in this process and a copy of it; here too what the copy has done, once it has.

    When nothing is left to take, what the copy has done is loaded while it does the rest. Should
    the copy fail at a job, this process is the one that says so.
    """
    heap, end = _heap(len(jobs)), os.pipe()
    left = list(range(len(jobs)))
    copy = _copied()
    if copy == 0:
        _help(jobs, heap, end[1])
    os.close(end[1])
    try:
        for number in chain(_taken(heap), _told(end[0])):
            jobs[number]()
            left.remove(number)
    finally:
        os.kill(copy, signal.SIGKILL)
        os.waitpid(copy, 0)
        os.close(end[0])
        os.close(heap)
    for number in left:
        jobs[number]()


def compile_later(jobs: Sequence[Job]) -> threading.Thread:
    """Do jobs in a copy of this process, then in a thread of this one, which is returned.

    For what somebody may come to need: the copy compiles, with what the city leaves it of the
    processors, and the thread has only to load, which makes a few steps late. Call it while this
    process has one thread.
    """
    copy = _copied()
    if copy == 0:
        os.nice(_MEEK)
        _help(jobs, _heap(len(jobs)))

    def load() -> None:
        os.waitpid(copy, 0)
        for job in jobs:
            job()

    thread = threading.Thread(target=load, name="compile_later", daemon=True)
    thread.start()
    return thread


def _copied() -> int:
    """Copy this process; return 0 in the copy, here the copy's number."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # numpy's threads, which survive it
        return os.fork()


def _heap(count: int) -> int:
    """Return what the numbers below a count can be read from, each once by one process."""
    heap, fill = os.pipe()
    os.write(fill, bytes(range(count)))
    os.close(fill)
    return heap


def _taken(heap: int) -> Iterator[int]:
    while number := os.read(heap, 1):
        yield number[0]


def _told(end: int) -> Iterator[int]:
    """Yield what the copy tells that it has done; it has no more to tell when it is gone."""
    while select.select([end], [], [], _GRACE_S)[0] and (number := os.read(end, 1)):
        yield number[0]


def _help(jobs: Sequence[Job], heap: int, tell: int | None = None) -> None:
    """Be the copy: do what is left on the heap, tell the number of each, and end without a word."""
    try:
        for number in _taken(heap):
            jobs[number]()
            if tell is not None:
                os.write(tell, bytes([number]))
    finally:
        os._exit(0)


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """Let no garbage be looked for: among a compiler's many objects it takes a tenth more."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
