"""Studies by their command: on processes, and on a Dask cluster that loses a worker; resumed."""

import os
import re
import signal
import subprocess
import sys

import psutil
import pyarrow.parquet as pq
import pytest

from tests.e2e.city_process import wait_for

SCENARIO = '''"""A car drives for a moment; its luck and its city are its case's own."""

import time

MAP = "driving_school"


def run(case, mass=1.0, pause_s=0.0):
    with case.lockstep([case.world((("n1", "nigel"),), room=1)]) as city:
        city.run_for(0.2)
    time.sleep(pause_s)
    return {"draw": mass * case.generator("draw").normal(), "seed_s": case.seed % 97}
'''
STUDY = """
study = 1
scenario = "drive.py"
replications = 15

[factors]
mass = { uniform = [1.0, 2.0] }
"radio.loss" = [0.0, 0.5]
pause_s = 0.05

[measures.draw]
unit = "1"
[measures.seed_s]
unit = "s"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("studies")
    (made / "drive.py").write_text(SCENARIO)
    (made / "drive.toml").write_text(STUDY)
    return made


def command(folder, out, *more):
    words = [sys.executable, "-m", "scm", "study", "run", str(folder / "drive.toml")]
    return [*words, "--out", str(folder / out), *more]


def rows(folder, out):
    table = pq.read_table(folder / out / "cases.parquet").sort_by("case")
    return table.drop_columns(["seconds"]).to_pylist()


def run(folder, out, *more):
    done = subprocess.run(command(folder, out, *more), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def alone(folder):
    text = run(folder, "alone", "--workers", "1")
    assert "30 of 30 cases: 30 ended" in text
    return rows(folder, "alone")


def test_two_processes_that_are_killed_and_started_again_make_the_same_rows(folder, alone):
    with subprocess.Popen(
        command(folder, "killed", "--workers", "2"), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as first:
        parts = folder / "killed" / "parts"
        wait_for(lambda: list(parts.glob("*.parquet")), 60.0, "first rows are written")
        children = psutil.Process(first.pid).children(recursive=True)
        first.kill()
    psutil.wait_procs(children, 10.0)
    assert not any(child.is_running() for child in children)
    there = sum(pq.read_metadata(path).num_rows for path in parts.glob("*.parquet"))
    assert 0 < there < 30
    text = run(folder, "killed", "--workers", "2")
    assert "30 of 30 cases" in text
    assert rows(folder, "killed") == alone


def dask(*words):
    return subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_" + words[0], *words[1:]],
        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, start_new_session=True,
    )  # fmt: skip


@pytest.fixture
def cluster():
    """A Dask scheduler with three workers; yields its address and the workers' processes."""
    scheduler = dask("scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", ":0")
    address = None
    while address is None:
        found = re.search(r"Scheduler at: +(tcp://\S+)", scheduler.stderr.readline())
        address = found and found.group(1)
    options = ("--nthreads", "1", "--no-nanny", "--no-dashboard")
    workers = [dask("worker", address, *options) for _ in range(3)]
    yield address, workers
    for process in (*workers, scheduler):
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        process.stderr.close()


def test_a_cluster_that_loses_a_worker_makes_the_same_rows(folder, alone, cluster):
    address, workers = cluster
    with subprocess.Popen(
        command(folder, "cluster", "--scheduler", address),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    ) as running:  # fmt: skip
        parts = folder / "cluster" / "parts"
        wait_for(lambda: list(parts.glob("*.parquet")), 90.0, "first rows are written")
        (case_process,) = psutil.Process(workers[0].pid).children(recursive=True)
        workers[0].kill()
        text = running.stdout.read()
    assert running.returncode == 0, text
    assert rows(folder, "cluster") == alone
    wait_for(lambda: not case_process.is_running(), 10.0, "its case process ended with it")


def test_a_scheduler_that_is_not_there_is_named(folder):
    done = subprocess.run(
        command(folder, "nowhere", "--scheduler", "tcp://127.0.0.1:1"),
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "--scheduler tcp://127.0.0.1:1: no Dask scheduler there" in done.stderr


def test_a_case_is_replayed_with_its_dashboard_bit_for_bit(folder, alone):
    words = [sys.executable, "-m", "scm", "study", "replay", str(folder / "alone"), "7"]
    done = subprocess.run(
        [*words, "--speed", "50", "--port", "0", "--exit"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "dashboard: http://127.0.0.1:" in done.stdout
    assert f"draw = {alone[7]['draw']:.9g}" in done.stdout
    assert done.stdout.endswith("as before, bit for bit\n")
