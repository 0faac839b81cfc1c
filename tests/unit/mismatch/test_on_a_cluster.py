"""Diagnoses on a Dask cluster are those made here."""

import json
import os
import pickle
import sys

import numpy as np
import pytest
from distributed import LocalCluster
from msgspec import structs

from scm.__main__ import main
from scm.clock import StepClock
from scm.dask_cluster import cluster_executor, connected
from scm.errors import RunError
from scm.mismatch.budget import Budget
from scm.mismatch.several.diagnose import cars_of, diagnose_several
from scm.mismatch.trial.run import on_shipped_cases
from scm.mismatch.validate.found_car import CarFiles
from tests.reality.several_cars import write_cars
from tests.unit.mismatch import made_fit
from tests.unit.mismatch.made_drive import nigel
from tests.unit.mismatch.stubbed_diagnosis import of_path, span


@pytest.fixture(scope="module")
def address():
    with LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=":0") as cluster:
        yield cluster.scheduler_address


def test_a_trial_on_a_cluster_has_the_table_of_one_made_here(address, tmp_path):
    """The diagnosis is a stub: it reads nothing of the recordings."""
    healthy = {"names": [], "car": "nigel", "equation": "", "depends_on": [], "listed": True,
               "parameters": {}}  # fmt: skip
    labels = dict.fromkeys(("case_000", "case_001"), healthy)
    for case in labels:
        (tmp_path / case / "drive").mkdir(parents=True)
        (tmp_path / case / "drive" / "recording.yaml").touch()
    (tmp_path / "labels.json").write_text(json.dumps(labels))
    here = on_shipped_cases(tmp_path, tmp_path / "here", of_path)
    with cluster_executor(address) as executor:
        there = on_shipped_cases(tmp_path, tmp_path / "there", of_path, executor=executor)
    assert there == here
    assert any("ValueError: no idea" in line for line in there)
    seen = (tmp_path / "there" / "found" / "case_000" / "seen.txt").read_text()
    process, drive = seen.split()
    assert (int(process) != os.getpid(), drive) == (True, str(tmp_path / "case_000" / "drive"))


def test_a_worker_process_runs_one_task_at_a_time(address):
    with cluster_executor(address) as executor:
        first, second = sorted(f.result() for f in [executor.submit(span) for _ in range(2)])
    assert first[1] <= second[0]


def test_several_cars_on_a_cluster_are_diagnosed_as_here(address, tmp_path, monkeypatch):
    write_cars(tmp_path, 2, 3.0, lambda _: {})
    cars = cars_of([tmp_path])
    here = diagnose_several(cars)
    turns, tasks = [], []
    with cluster_executor(address) as executor:
        submit = executor.submit
        monkeypatch.setattr(executor, "submit", lambda *t: tasks.append(t) or submit(*t))
        there = diagnose_several(cars, executor=executor, turn=lambda *t: turns.append(t))
    assert len(tasks) == 2
    found = [
        {name: structs.replace(one.diagnosis, runtime_s=0.0, processor_share=None)
         for name, one in several.cars.items()}
        for several in (here, there)
    ]  # fmt: skip
    assert found[0] == found[1]
    assert turns == [("car_1", 0, 3), ("car_2", 1, 3), ("all cars", 2, 3)]


@pytest.mark.parametrize("command", [["trial", "--trials"], ["mismatch"]])
def test_a_scheduler_that_is_not_there_is_refused(command, tmp_path, capsys):
    write_cars(tmp_path, 2, 3.0, lambda _: {})
    assert main([*command, str(tmp_path), "--scheduler", "nowhere"]) == 2
    assert "--scheduler nowhere: no Dask scheduler there" in capsys.readouterr().err


def test_without_dask_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(RunError, match=r"pip install 'scm\[study\]'"):
        connected("tcp://head:8786")


def test_a_hypothesis_of_another_process_drives_as_there():
    _, _, there = made_fit.trimmed()
    here = pickle.loads(pickle.dumps(there))
    changed = [there.numbers, {**there.numbers, "steering.trim_rad": 0.1}]
    innovations = [one.model(changed)[0] for one in (there, here)]
    np.testing.assert_array_equal(*innovations)
    assert np.ptp(innovations[0], axis=1).max() > 1.0


def test_cars_written_in_another_process_are_read_from_files_of_this_one():
    _, _, fitted = made_fit.trimmed()
    there = CarFiles(nigel(), ("drive",))
    written = there.written(fitted, ())
    here = pickle.loads(pickle.dumps(there))
    read = here.reread(written)
    assert read.path != written.path
    assert read.path.read_bytes() == written.path.read_bytes()
    assert read.values == written.values
    assert here.reread(nigel()) is nigel()


def test_a_budget_of_another_machine_has_as_much_time_left():
    clock = StepClock(5_000_000_000)
    there = Budget(10.0, clock)
    clock.set_ns(9_000_000_000)
    packed = pickle.dumps(there)
    here = pickle.loads(packed)
    assert here.spent_s() == there.spent_s() == 4.0
    here._clock.set_ns(12_000_000_000)
    assert here.spent_s() == 7.0
