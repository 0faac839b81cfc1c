"""`scm selftest` on a small city of its own: faults of signals are found, and recovered from."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.e2e


def selftest(*arguments, **more):
    command = [sys.executable, "-m", "scm", "selftest", *arguments]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=120, **more)


def test_a_fault_of_the_output_and_a_frozen_controller_are_found_in_time(tmp_path):
    out = tmp_path / "table.md"
    done = selftest("conflicting_greens", "frozen_controller", "--out", str(out))
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [line for line in out.read_text().splitlines() if line.endswith("| ok |")]
    assert len(rows) == 2, out.read_text()


def test_a_running_city_is_left_alone_without_a_yes():
    done = selftest("--connect", "tcp/127.0.0.1:1", input="\n")
    assert done.returncode == 0
    assert "no fault was injected" in done.stdout


def test_a_fault_that_does_not_exist_is_bad_input():
    done = selftest("conflicting_green")
    assert done.returncode == 2
    assert "conflicting_greens" in done.stderr
