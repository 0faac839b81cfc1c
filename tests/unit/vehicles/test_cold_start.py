"""A first start compiles in two processes; later starts only load."""

import os
import sys
import threading

import pytest

from scm.vehicles import cold_start

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are copied here"),
    # JAX warns where another test loaded it; the forks here only write a line
    pytest.mark.filterwarnings("ignore:os.fork:RuntimeWarning"),
]


class Log:
    """Lines of a file that all processes write into."""

    def __init__(self, path):
        self.path = path
        self.here = os.getpid()

    def job(self, name, *, fails_in_fork=False):
        def write():
            forked = os.getpid() != self.here
            if forked and fails_in_fork:
                os._exit(1)
            with self.path.open("a") as file:
                file.write(f"{name} {'fork' if forked else 'here'}\n")

        return write

    def lines(self):
        return sorted(self.path.read_text().splitlines())


@pytest.fixture
def log(tmp_path, monkeypatch):
    monkeypatch.setattr(cold_start, "_marker", lambda: tmp_path / "complete")
    monkeypatch.setattr(threading, "active_count", lambda: 1)
    monkeypatch.delitem(sys.modules, "jax", raising=False)
    return Log(tmp_path / "log")


def test_the_first_job_is_compiled_in_a_fork_and_every_job_is_done_here(log):
    cold_start.compile_together({"a": log.job("a"), "b": log.job("b"), "c": log.job("c")})
    assert log.lines() == ["a fork", "a here", "b here", "c here"]


def test_a_second_start_needs_no_fork(log):
    cold_start.compile_together({"a": log.job("a")})
    assert not cold_start.is_first_start()
    cold_start.compile_together({"b": log.job("b")})
    assert "b fork" not in log.lines()


def test_a_process_with_threads_is_not_forked(log, monkeypatch):
    monkeypatch.setattr(threading, "active_count", lambda: 2)
    cold_start.compile_together({"a": log.job("a")})
    assert log.lines() == ["a here"]


def test_a_process_that_has_loaded_jax_is_not_forked(log, monkeypatch):
    monkeypatch.setitem(sys.modules, "jax", object())
    cold_start.compile_together({"a": log.job("a")})
    assert log.lines() == ["a here"]


def test_a_job_that_fails_in_the_fork_is_done_here(log):
    cold_start.compile_together({"a": log.job("a", fails_in_fork=True)})
    assert log.lines() == ["a here"]


def test_an_error_of_a_job_is_raised_here_and_the_start_stays_the_first(log):
    def fail():
        raise ValueError("no room")

    with pytest.raises(ValueError, match="no room"):
        cold_start.compile_together({"a": log.job("a"), "b": fail})
    assert cold_start.is_first_start()


def test_what_is_compiled_is_logged(log, caplog):
    with caplog.at_level("INFO"):
        cold_start.compile_together({"drivers": log.job("a"), "LIDAR": log.job("b")})
    assert "drivers, LIDAR" in caplog.text
