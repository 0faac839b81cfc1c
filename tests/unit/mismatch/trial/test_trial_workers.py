"""Workers of a trial end with it, whatever ends it."""

import fcntl
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from scm.runtime.parent_watch import with_parent

SCRIPT = Path(__file__).with_name("sleeping_trial.py")
START_S, END_S = 120.0, 30.0


def until(condition, timeout_s, what):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, f"not within {timeout_s:g} s: {what}"
        time.sleep(0.05)


def is_alive(case):
    """Whether a worker still holds the lock of its case."""
    with (case / "alive").open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        return False


@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT", "SIGKILL"])
def test_workers_of_an_ended_trial_end_by_themselves(tmp_path, name):
    command = with_parent([sys.executable, str(SCRIPT), str(tmp_path)])
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True) as trial:
        cases = [tmp_path / "00", tmp_path / "01"]
        try:
            until(lambda: all((c / "began").exists() for c in cases), START_S, "workers at work")
            assert all(map(is_alive, cases))
            trial.send_signal(getattr(signal, name))
            until(lambda: not any(map(is_alive, cases)), END_S, f"no worker after {name}")
            assert trial.wait(END_S) != 0
        finally:
            with suppress(ProcessLookupError):
                os.killpg(trial.pid, signal.SIGKILL)
