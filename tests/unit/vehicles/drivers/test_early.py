"""Jobs shared with a copy of the process: each is done, here or beside, and here in the end."""

import os
import sys
from pathlib import Path

import pytest

from scm.vehicles.drivers import early

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are copied here")


class Notebook:
    """Lines of a file that all processes write into."""

    def __init__(self, path):
        self.path = path
        self.here = os.getpid()

    def job(self, name, wait_for=None):
        """Return a job that writes its name and process, once a line with `wait_for` is there."""

        def write():
            while wait_for and not any(line.startswith(wait_for) for line in self.lines()):
                os.sched_yield()
            with self.path.open("a") as file:
                file.write(f"{name} {'here' if os.getpid() == self.here else 'beside'}\n")

        return write

    def lines(self):
        return self.path.read_text().splitlines() if self.path.exists() else []


@pytest.fixture
def notebook(tmp_path):
    return Notebook(tmp_path / "notes")


def test_all_jobs_are_done_in_this_process_in_the_end(notebook):
    early.share([notebook.job("a"), notebook.job("b"), notebook.job("c")])
    assert {line.split()[0] for line in notebook.lines() if line.endswith("here")} == set("abc")


def test_two_jobs_run_at_the_same_time(notebook):
    early.share([notebook.job("a", wait_for="b"), notebook.job("b")])
    first, second = notebook.lines()[:2]
    assert (first[0], second[0]) == ("b", "a")
    assert first.split()[1] != second.split()[1]


def test_what_is_done_beside_is_done_here_while_the_copy_goes_on(notebook, monkeypatch):
    monkeypatch.setattr(early, "_GRACE_S", 5.0)
    begin, end = notebook.job("c began"), notebook.job("c", wait_for="b here")

    def long():
        begin()
        end()

    early.share([notebook.job("a", wait_for="c began"), notebook.job("b"), long])
    lines = notebook.lines()
    assert "c beside" in lines or "a beside" in lines  # if the copy was first, it waits for us


def children():
    """The processes that this one has started and not waited for, other tests' among them."""
    return Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="ascii").split()


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="no /proc: not Linux")
def test_no_process_is_left_behind(notebook):
    before = children()
    early.share([notebook.job("a")])
    assert children() == before


def test_what_fails_beside_is_done_here(notebook):
    tell_of_trying, do = notebook.job("tried"), notebook.job("done", wait_for="tried")

    def fail_beside():
        if os.getpid() == notebook.here:
            return do()
        tell_of_trying()
        sys.exit("no room")

    early.share([fail_beside, fail_beside])
    assert notebook.lines() == ["tried beside", "done here", "done here"]


def test_an_error_of_a_job_is_raised_here(notebook):
    def fail():
        raise ValueError(notebook.path)

    with pytest.raises(ValueError, match="notes"):
        early.share([fail])


def test_a_driver_that_is_kept_needs_no_second_process(notebook, monkeypatch):
    monkeypatch.setattr(early, "is_kept", lambda _: True)
    early.compile_together([notebook.job("a"), notebook.job("b")])
    assert notebook.lines() == ["a here", "b here"]


def test_what_is_for_later_is_done_beside_first_and_then_here_in_a_thread(notebook):
    early.compile_later([notebook.job("a")]).join(10.0)
    assert notebook.lines() == ["a beside", "a here"]
