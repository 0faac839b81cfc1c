"""Slurm's jobs by submitit, options of sbatch, and a database that searches share."""

import logging

import pytest
import submitit

from scm.errors import RunError, StudyError
from scm.study.case_process import Task
from scm.study.engine import SlurmEngine, run_share, slurm_options
from scm.study.results import create_results
from scm.study.search import run_search
from tests.unit.study.studying import Here, loaded


def test_slurm_s_jobs_share_the_cases_and_a_bad_one_costs_only_its_own(tmp_path, monkeypatch):
    """Submitit's local executor runs jobs as Slurm does, on this machine; one has 2 and then 0."""
    monkeypatch.setattr("scm.study.engine.SHARES_PER_JOB", 1)
    scenario = (
        "import os\ndef run(case, a=1.0):\n    if a > 2.5: os._exit(4)\n    return {'total': a}\n"
    )
    study = loaded(tmp_path, scenario=scenario)
    folder = create_results(study, tmp_path / "out", []).folder
    logging.getLogger("submitit").setLevel(logging.ERROR)
    engine = SlurmEngine(submitit.LocalExecutor(tmp_path / "jobs"), study, folder, 2)
    rows = {row.case: row for row in engine.run(Task(case=n) for n in (2, 1, 0, 3))}
    assert {n: row.outcome for n, row in rows.items()} == {
        0: "success", 1: "success", 2: "error", 3: "success",
    }  # fmt: skip
    assert rows[2].detail == "its process ended: exit status 4"


class Cancelling:
    """Submitit's interface, in this process, where Slurm cancels the job of case 0 so often."""

    def __init__(self, study, times):
        self.study, self.times = study, times

    def map_array(self, call, folders, names, shares):
        assert call is run_share
        assert len(folders) == len(names) == len(shares) > 0
        return [Job(self, share) for share in shares]


class Job:
    job_id = "7_0"

    def __init__(self, executor, share):
        self.executor, self.share = executor, share

    def result(self):
        rows = [self.executor.study.run(task.case, task.values) for task in self.share]
        if rows[0].case == 0 and self.executor.times:
            self.executor.times -= 1
            raise submitit.core.utils.UncompletedJobError("cancelled")
        return rows


def on_slurm(tmp_path, times):
    study = loaded(tmp_path)
    folder = create_results(study, tmp_path / "out", []).folder
    return SlurmEngine(Cancelling(study, times), study, folder, 1)


def test_cases_of_a_cancelled_job_run_again(tmp_path):
    rows = list(on_slurm(tmp_path, 1).run([Task(case=n) for n in range(2)]))
    assert [(row.case, row.outcome) for row in rows] == [(1, "success"), (0, "success")]


def test_nothing_is_submitted_where_no_case_is_left(tmp_path):
    assert list(on_slurm(tmp_path, 0).run([])) == []


def test_jobs_that_are_always_cancelled_leave_their_cases_without_a_row(tmp_path):
    rows = on_slurm(tmp_path, 99).run([Task(case=n) for n in range(2)])
    assert next(rows).case == 1
    with pytest.raises(RunError, match="Slurm job 7_0: cancelled; 1 cases are left"):
        next(rows)


def test_options_of_sbatch_are_those_of_the_jobs():
    given, jobs = slurm_options("-p cpu -n 64 -t 30 --mem 4G --account=lab")
    assert jobs == 64
    assert given == {
        "partition": "cpu", "time": 30, "mem": "4G", "account": "lab", "cpus_per_task": 1,
        "array_parallelism": 64,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "words"), [("-n many", "invalid int value"), ("--gres gpu:1", "no option '--gres'")]
)
def test_options_that_are_not_known_are_named(text, words):
    with pytest.raises(RunError, match=words):
        slurm_options(text)


SEARCH = '[search]\nmeasure = "total"\ngoal = "minimize"\ncases = 6'


def test_commands_share_a_search_through_a_database(tmp_path):
    pgserver = pytest.importorskip("pgserver")
    server = pgserver.get_server(tmp_path / "pg", cleanup_mode="stop")
    url = server.get_uri()
    try:
        numbers = []
        for name, cases in (("one", 4), ("two", 6)):
            folder = tmp_path / name
            folder.mkdir()
            tables = SEARCH.replace("6", str(cases))
            study = loaded(folder, tables=tables, factors="b = { uniform = [0.0, 1.0] }")
            results = create_results(study, folder / "out", [])
            run_search(results, Here(study), lambda _: None, url)
            numbers.append(sorted(results.rows))
    finally:
        server.cleanup()
    assert numbers == [[0, 1, 2, 3], [4, 5]]


def test_a_storage_that_is_no_database_is_refused(tmp_path):
    study = loaded(tmp_path, tables=SEARCH)
    results = create_results(study, tmp_path / "out", [])
    with pytest.raises(StudyError, match=r"--storage: expected postgresql://\.\.\., got 'redis"):
        run_search(results, Here(study), lambda _: None, "redis://here")
