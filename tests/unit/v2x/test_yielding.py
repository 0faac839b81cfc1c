"""Threads that yield: which ones do, and that the caller's own does not."""

import os
import subprocess
import sys
import threading

import pytest

from scm.v2x.router import Router, free_endpoint
from scm.v2x.yielding import yielding

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="scheduling classes are Linux's"),
    pytest.mark.usefixtures("lasting_links"),
]


def class_in_a_new_thread() -> int:
    found: list[int] = []
    thread = threading.Thread(target=lambda: found.append(os.sched_getscheduler(0)))
    thread.start()
    thread.join()
    return found[0]


def test_threads_started_within_yield_and_later_ones_do_not() -> None:
    with yielding():
        assert class_in_a_new_thread() == os.SCHED_BATCH
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
    assert class_in_a_new_thread() == os.SCHED_OTHER


def test_the_caller_is_as_before_after_an_error() -> None:
    with pytest.raises(RuntimeError), yielding():
        raise RuntimeError
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


def test_a_class_that_a_user_gave_is_kept() -> None:
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    try:
        with yielding():
            pass
        assert os.sched_getscheduler(0) == os.SCHED_BATCH
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


FRESH = """
import os
from pathlib import Path

from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.router import free_endpoint

with ZenohBus("city", "alone", {endpoint!r}):
    classes = [os.sched_getscheduler(int(task.name)) for task in Path("/proc/self/task").iterdir()]
print(classes.count(os.SCHED_BATCH) > 0, os.sched_getscheduler(0) == os.SCHED_OTHER)
"""


def test_the_threads_of_a_process_first_bus_yield_and_its_owner_does_not() -> None:
    endpoint = free_endpoint()
    with Router(endpoint):
        fresh = [sys.executable, "-c", FRESH.format(endpoint=endpoint)]
        said = subprocess.run(fresh, capture_output=True, text=True, check=True, timeout=120)
    assert said.stdout.split() == ["True", "True"]
