"""A case that raises, hangs, dies or eats memory costs its own row; the next one runs."""

import subprocess
import sys
import threading

import psutil
import pytest

from scm.errors import StudyError
from scm.study.case_process import OUTPUT, CaseProcess, Task
from tests.unit.study.studying import loaded, write

SCENARIO = """
import os


def run(case, a=1.0, how="well"):
    print("here is case", case.number)
    if how == "raises":
        raise ValueError("no")
    if how == "exits":
        raise SystemExit(3)
    if how == "hangs":
        while True:
            pass
    if how == "dies":
        os.kill(os.getpid(), 9)
    if how == "gets_sigterm":
        os.kill(os.getpid(), 15)
    if how == "eats":
        eaten = []
        while True:
            eaten.append(bytearray(20_000_000))
    return {"total": a}
"""


@pytest.fixture(scope="module")
def process(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    more = "time_limit_s = 2.0\nmemory_limit_mb = 200"
    study = loaded(folder, scenario=SCENARIO, more=more, name="study", factors='how = "well"')
    running = CaseProcess(study, folder)
    yield running
    running.close()


def run(process, how, case=0):
    return process.run(Task(case=case, values={"a": 2.0, "how": how}))


@pytest.mark.parametrize(
    ("how", "outcome", "words"),
    [
        ("raises", "error", "ValueError: no (adds.py:8)"),
        ("exits", "error", "SystemExit: 3 (adds.py:10)"),
        ("hangs", "time_limit", "2 s"),
        ("dies", "error", "its process ended: signal 9"),
        ("eats", "memory_limit", "MB more than before, 200 allowed"),
    ],
)
def test_a_bad_case_says_so_and_the_next_one_runs(process, how, outcome, words):
    bad = run(process, how)
    assert (bad.outcome, bad.values["how"]) == (outcome, how)
    assert words in bad.detail
    good = run(process, "well", 5)
    assert (good.outcome, good.measures, good.case) == ("success", {"total": 2.0}, 5)


def test_a_case_outlives_a_scheduler_s_sigterm(process):
    assert run(process, "gets_sigterm").outcome == "success"


def test_one_process_serves_many_cases_and_its_memory_stays(process):
    for number in range(20):
        run(process, "well", number)
    before_mb = process.memory_mb()
    for number in range(300):
        assert run(process, "well", number).outcome == "success"
    assert process.memory_mb() < before_mb + 5.0


def test_what_scenarios_print_is_in_a_file_of_the_folder(process):
    run(process, "well", 77)
    assert "here is case 77" in (process.folder / OUTPUT).read_text()


def test_a_process_that_cannot_load_its_study_says_why(tmp_path):
    study = loaded(tmp_path, name="study")
    (tmp_path / "adds.py").write_text("import nowhere_at_all")
    with pytest.raises(StudyError, match="cannot be imported: ModuleNotFoundError"):
        CaseProcess(study, tmp_path)


def test_it_ends_when_its_owner_is_killed(tmp_path):
    write(tmp_path, name="study", scenario=SCENARIO, factors='how = "hangs"')
    program = (
        "import sys, pathlib\n"
        "from scm.study.case_process import CaseProcess, Task\n"
        "from scm.study.loaded_study import load\n"
        f"folder = pathlib.Path({str(tmp_path)!r})\n"
        "process = CaseProcess(load(folder / 'study.toml'), folder)\n"
        "print('started', flush=True)\n"
        "process.run(Task(case=0))\n"
    )
    owner = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert owner.stdout.readline() == "started\n"
    (child,) = psutil.Process(owner.pid).children()
    owner.kill()
    owner.wait()
    owner.stdout.close()
    psutil.wait_procs([child], 10.0)
    assert not child.is_running()


def test_a_process_may_be_closed_by_several_threads_at_once(tmp_path):
    study = loaded(tmp_path, scenario=SCENARIO, name="study", factors='how = "well"')
    running, failed = CaseProcess(study, tmp_path), []
    all_ready = threading.Barrier(16)

    def close():
        all_ready.wait()
        try:
            running.close()
        except OSError as cause:
            failed.append(cause)

    threads = [threading.Thread(target=close) for _ in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed
