"""Every command of README and `docs/start.md` is run here, against a city on free ports."""

import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest

from scm.maps.load import load_map
from scm.recorder.part import RecorderPart
from scm.runtime.lockstep import Lockstep
from scm.traffic.signals.part import TrafficPart
from scm.world.part import WorldPart
from tests.e2e.city_process import CityProcess, city, wait_for

README = Path(__file__).parents[2] / "README.md"
START = README.parent / "docs/start.md"
REST = README.parent / "docs/rest.md"


LOCKSTEP = ".venv/bin/python examples/travel_times.py"  # has a test of its own, below
SEARCH = ".venv/bin/scm mismatch recordings/sample"  # what it finds has a test of its own
IN_CITY = ("make ", "tcp/", "http://", "--live")  # by one of them a command is about a city


def commands(*pages: Path) -> list[str]:
    """Return the shell lines of the fenced blocks of pages, without comments, each once."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages or (README, START))
    blocks = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    lines = [line.partition("  #")[0].strip() for block in blocks for line in block.splitlines()]
    return [line for line in dict.fromkeys(lines) if line]


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CityProcess]:
    """One city that the README's commands talk to."""
    with city(tmp_path_factory.mktemp("runs"), "--agents", "0", "--hosted", "1") as process:
        yield process


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five seconds of a city, as the recorder leaves them."""
    path, city_map = tmp_path_factory.mktemp("recorded") / "today.mcap", load_map("driving_school")
    parts = (WorldPart(city_map, hosted=(("n1", "nigel"),)), TrafficPart(city_map))
    with Lockstep([*parts, RecorderPart(path)]) as lockstep:
        lockstep.run_for(5.0)
    return path


@pytest.fixture
def workplace(tmp_path: Path, root: Path, recorded: Path) -> Path:
    """A folder that looks like the project's, so that commands leave nothing behind in it."""
    return furnished(tmp_path, root, recorded)


def furnished(folder: Path, root: Path, recorded: Path) -> Path:
    """Return a folder, with what the README's commands expect to be in it."""
    for name in ("examples", "recordings", "maps", "Makefile", "pyproject.toml"):
        (folder / name).symlink_to(root / name)
    (folder / ".venv").symlink_to(sys.prefix)
    (folder / "runs").mkdir()
    shutil.copy(recorded, folder / "runs")
    return folder


@pytest.fixture(scope="module")
def at_work(
    running: CityProcess, root: Path, recorded: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[list["Future[subprocess.CompletedProcess[str]]"]]:
    """Set the client's examples to work beside each other, and beside what needs no city.

    One waits for a cycle's end, one for a search.
    """
    folder = furnished(tmp_path_factory.mktemp("at_work"), root, recorded)
    shutil.copy(recorded, running.folder)
    shell = [here(command, running, root) for command in commands(REST)]
    with ThreadPoolExecutor(len(shell)) as pool:
        yield [pool.submit(run, command, folder) for command in shell]


def here(command: str, running: CityProcess, root: Path) -> str:
    """Return a README command that talks to the test's city and the real data's folder."""
    command = command.replace("tcp/127.0.0.1:7447", running.endpoint)
    command = command.replace("http://127.0.0.1:8000", running.url)
    command = command.replace("../shared", str(root.parent / "shared"))
    shorter = "--cars 1 --plans brisk --via east_loop"  # all of it takes two minutes
    if command == SEARCH:
        return f"{command} --budget-s 0"
    live = command.endswith("--live")
    return f"{command} --connect {running.endpoint} {shorter}" if live else command


def is_in_city(command: str) -> bool:
    """Whether a command of the README is about a running city."""
    return any(sign in command for sign in IN_CITY)


@pytest.mark.parametrize("command", list(filter(is_in_city, commands())))
def test_readme_command_works_in_a_city(
    command: str, running: CityProcess, workplace: Path, root: Path
) -> None:
    if command.startswith("make "):  # a city without an end, or this very test: the recipe is there
        assert run(command.replace("make", "make -n", 1), root).returncode == 0
        return
    check: Callable[[str, CityProcess, Path], None] = joins if " join " in command else ends_well
    check(here(command, running, root), running, workplace)


@pytest.mark.usefixtures("at_work")
@pytest.mark.parametrize("command", [c for c in commands() if c != LOCKSTEP and not is_in_city(c)])
def test_readme_command_works(
    command: str, running: CityProcess, workplace: Path, root: Path
) -> None:
    if "../shared" in command and not (root.parent / "shared").is_dir():
        pytest.skip("../shared is not here: it holds other people's data")
    ends_well(here(command, running, root), running, workplace)


def ends_well(command: str, running: CityProcess, workplace: Path) -> None:
    """The command ends by itself, with success and something to read."""
    del running
    done = run(command, workplace)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    assert done.stdout.strip(), command
    assert '"status":4' not in done.stdout.replace(" ", ""), done.stdout


def joins(command: str, running: CityProcess, workplace: Path) -> None:
    """The agent's car appears on the map while the command runs."""
    agent = subprocess.Popen(command, shell=True, cwd=workplace, start_new_session=True)
    try:
        name = command.partition("--name ")[2].split()[0]

        def there() -> bool:
            return name in {row["vehicle"] for row in running.get("/vehicles")["vehicles"]}

        wait_for(there, 40.0, f"{name} is on the map")
    finally:
        subprocess.run(["pkill", "-INT", "-g", str(agent.pid)], check=False)
        agent.wait(timeout=5.0)


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a shell line in a folder."""
    return subprocess.run(
        command, shell=True, cwd=folder, capture_output=True, text=True, timeout=280.0, check=False
    )


def test_the_client_s_examples_work_beside_each_other(
    running: CityProcess, at_work: list["Future[subprocess.CompletedProcess[str]]"]
) -> None:
    wheel, signals, diagnosis = (example.result() for example in at_work)
    for done in (wheel, signals, diagnosis):
        assert done.returncode == 0, f"{done.args}\n{done.stdout}\n{done.stderr}"
    came = re.search(r"n1 came (\d+\.\d+) m by hand", wheel.stdout)
    assert came is not None, wheel.stdout
    assert float(came[1]) > 0.02, wheel.stdout
    # Where it was driven decides whether it can go on: before a wall it stands, and says so.
    assert re.search(r"n1 (goes on by itself|stands: it would hit a wall)", wheel.stdout), (
        wheel.stdout
    )
    assert re.search(r"\d+ colours ended as SPaT had promised, 0 otherwise", signals.stdout)
    plans = running.get("/signals/crossing/plans")["items"]
    assert [row["plan"] for row in plans] == ["brisk", "calm"]
    (report,) = running.get("/mismatch/reports")["items"]
    assert report["said"] in diagnosis.stdout
    assert f"{running.url}/mismatch/{report['name']}" in diagnosis.stdout


def test_every_example_is_on_the_start_page(root: Path) -> None:
    text = START.read_text(encoding="utf-8")
    assert all(path.name in text for path in (root / "examples").glob("*.py"))


def test_the_readme_is_short_and_its_links_lead_somewhere(root: Path) -> None:
    text = README.read_text(encoding="utf-8")
    assert text.count("\n") <= 90
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        assert target.startswith("http") or (root / target).exists(), target


def test_the_lockstep_example_is_faster_than_real_time(workplace: Path) -> None:
    assert LOCKSTEP in commands()
    began = time.monotonic()
    done = run(LOCKSTEP, workplace)
    elapsed = time.monotonic() - began
    assert done.returncode == 0, done.stdout + done.stderr
    found = re.search(r"(\d+) s of city", done.stdout)
    assert found, done.stdout + done.stderr
    assert float(found.group(1)) > elapsed
