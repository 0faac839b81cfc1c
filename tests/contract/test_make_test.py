"""How `make test` spreads tests over processes, and ends when one of them dies."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import cv2
import pytest
from threadpoolctl import threadpool_info

NOTE = """
import os
from pathlib import Path

import pytest


def note(what):
    with (Path(__file__).parents[{up}] / what).open("a") as file:
        file.write(f"{{Path(__file__).stem}} {{os.environ['PYTEST_XDIST_WORKER']}}\\n")


@pytest.mark.parametrize("number", range(4))
def test_is_run(number):
    note("ran")


note("loaded")
"""
ABORT = "import os\n\n\ndef test_aborts():\n    os.abort()\n"


@pytest.fixture
def tree(tmp_path: Path, root: Path) -> Path:
    """A small project with this one's settings and four files of tests."""
    (tmp_path / "tests/e2e").mkdir(parents=True)
    for name in ("pyproject.toml", "tests/conftest.py"):
        (tmp_path / name).write_text((root / name).read_text())
    for folder, up in (("tests", 1), ("tests/e2e", 2)):
        for number in (1, 2):
            name = f"test_{Path(folder).name}_{number}.py"
            (tmp_path / folder / name).write_text(NOTE.format(up=up))
    return tmp_path


def made(root: Path, tree: Path) -> subprocess.CompletedProcess[str]:
    """Run the Makefile's command there, in two processes, with the plugins that it needs."""
    found = re.search(r"-m pytest (.*) \$\(PYTEST_ARGS\)", (root / "Makefile").read_text())
    assert found
    options = shlex.split(found[1].replace("-n auto", "-n 2"))
    command = [sys.executable, "-m", "pytest", *options]
    plugins = {
        "PYTHONDONTWRITEBYTECODE": "",
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "PYTEST_PLUGINS": "xdist.plugin,pytest_timeout",
        "PYTEST_DEBUG_TEMPROOT": str(tree),  # else it deletes what earlier runs left
    }
    return subprocess.run(
        command, cwd=tree, capture_output=True, text=True, check=False, timeout=200.0,
        env=os.environ | plugins,
    )  # fmt: skip


def test_a_file_stays_in_one_process_and_all_cities_in_another(root: Path, tree: Path) -> None:
    done = made(root, tree)
    assert done.returncode == 0, done.stdout + done.stderr
    ran = [line.split() for line in (tree / "ran").read_text().splitlines()]
    assert len(ran) == 16
    cities = {worker for name, worker in ran if "e2e" in name}
    assert len(cities) == 1
    for name in ("test_tests_1", "test_tests_2"):
        assert len({worker for told, worker in ran if told == name}) == 1


def test_no_two_processes_begin_to_load_at_the_same_file(root: Path, tree: Path) -> None:
    done = made(root, tree)
    assert done.returncode == 0, done.stdout + done.stderr
    loaded: dict[str, list[str]] = {}
    for line in (tree / "loaded").read_text().splitlines():
        name, worker = line.split()
        loaded.setdefault(worker, []).append(name)
    first, second = (loaded[worker] for worker in ("gw0", "gw1"))
    assert first == ["test_e2e_1", "test_e2e_2", "test_tests_1", "test_tests_2"]
    assert second == [*first[2:], *first[:2]]


def test_a_process_that_dies_ends_the_run_with_the_name_of_its_test(root: Path, tree: Path) -> None:
    (tree / "tests/test_abort.py").write_text(ABORT)
    done = made(root, tree)
    assert done.returncode == 1
    assert "crashed while running 'tests/test_abort.py::test_aborts'" in done.stdout


def test_libraries_calculate_on_one_thread() -> None:
    pools = threadpool_info()
    assert pools
    assert {pool["num_threads"] for pool in pools} == {1}
    assert cv2.getNumThreads() == 1
