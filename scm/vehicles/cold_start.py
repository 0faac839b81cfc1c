"""What a first start on a machine compiles, in two processes: two cores compile twice as fast.

A fork of this process compiles the longest job into the cache, from where this process loads it.
Later starts find everything in the cache.
"""

import contextlib
import gc
import logging
import multiprocessing
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from scm.log import event
from scm.vehicles.drivers import controller
from scm.vehicles.jit import version_folder

Job = Callable[[], object]

_TYPICAL_S = 30  # on two idle cores of a slow computer
_LOG = logging.getLogger(__name__)


def is_first_start() -> bool:
    """Return whether this version's kernels have never all been compiled on this machine."""
    return not _marker().exists()


def compile_together(jobs: Mapping[str, Job]) -> None:
    """Do jobs that compile or load, by what they compile; the first one is the longest.

    On a first start a fork compiles the first one meanwhile, if this process has one thread: a fork
    of more threads could wait for locks of those that it does not have. JAX's threads count too.
    """
    if not is_first_start():
        for job in jobs.values():
            job()
        return
    event(_LOG, "first_start", compiling=", ".join(jobs), only_once=True, takes_about_s=_TYPICAL_S)
    (_, longest), *others = jobs.items()
    with _no_garbage_collection():
        process = _fork(longest) if _has_one_thread() else None
        for _, job in others:
            job()
        if process is not None:
            process.join()
        longest()
    with contextlib.suppress(OSError):
        _marker().touch()


def _marker() -> Path:
    return version_folder(Path(controller.__file__).parent) / "complete"


def _has_one_thread() -> bool:
    """Return whether no other thread can hold a lock; Python does not see those of JAX."""
    return threading.active_count() == 1 and "jax" not in sys.modules


def _fork(job: Job) -> Any:
    """Do a job in a copy of this process; return None where processes cannot be copied.

    Its failure is not reported: this process does the job again, and reports its own.
    """
    if "fork" not in multiprocessing.get_all_start_methods():
        return None
    process = multiprocessing.get_context("fork").Process(target=job, daemon=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # numpy's threads survive a fork
        process.start()
    return process


@contextlib.contextmanager
def _no_garbage_collection() -> Iterator[None]:
    """Pause the garbage collector: among a compiler's many objects it takes a tenth more."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
