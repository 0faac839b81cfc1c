"""What all tests share: where other people's data lies, and marks that come from the folder."""

import gc
import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from threadpoolctl import threadpool_limits

from scm.runtime.priority import NICER, stand_back

ROOT = Path(__file__).parent.parent
TESTS = ROOT / "tests"
SHARED = ROOT.parent / "shared"

os.environ["SCM_CARS"] = ""  # no car files of whoever runs the tests

PAGES = "tests/e2e/pages/"
AT_ANY_PACE = {
    f"tests/e2e/{name}.py"
    for name in (
        "pages/test_cars_page",
        "pages/test_events_page",
        "pages/test_eye_page",
        "pages/test_map_page",
        "pages/test_mismatch_page",
        "pages/test_recordings_page",
        "pages/test_shell",
        "pages/test_signals_of_a_town",
        "pages/test_signals_page",
        "pages/test_twins_page",
        "pages/test_vehicle_page",
        "test_mismatch_report",
        "test_own_car_example",
        "test_rest_fuzz",
    )
}
"""Files of `tests/e2e` that nothing binds to real time: their cities run in lockstep, or not."""
BESIDE_TYPES = tuple(
    f"tests/unit/{name}/" for name in ("twin", "v2x", "vehicle_agent", "vehicles", "world")
)
"""Folders of the tests that come last."""


def is_bound_to_real_time(nodeid: str) -> bool:
    """Return whether a test fails where other processes take its time."""
    path = nodeid.partition("::")[0]
    return path.startswith("tests/e2e/") and path not in AT_ANY_PACE


# How long an example takes says nothing on a machine that others use as well.
settings.register_profile(
    "busy_machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("busy_machine")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark every test of `tests/e2e` as such; first those bound to real time, then the others.

    The check of types takes a core for a minute, and would hardly get one beside the cities; last,
    it would keep one busy alone. So enough tests follow it to keep the others at work.
    """

    def turn(item: pytest.Item) -> int:
        is_last = item.nodeid.startswith(BESIDE_TYPES)
        return 1 if item.path.name == "test_project.py" else 2 * is_last

    items.sort(
        key=lambda item: (
            not is_bound_to_real_time(item.nodeid),
            "e2e" not in item.path.parts,
            turn(item),
        )
    )
    for item in items:
        if "e2e" in item.path.parts:
            item.add_marker(pytest.mark.e2e)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Start a process more than there are cores: the one with the cities mostly waits."""
    return len(os.sched_getaffinity(0)) + 1


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Let each process begin to load the tests at another place, and find the rest compiled.

    Pytest rewrites the assertions of every test file, which takes longer than to load it; in one
    order all would do the same work at the same time. What fails here fails again when collected.
    """
    worker = getattr(session.config, "workerinput", None)
    if worker is None or sys.dont_write_bytecode or session.config.args != ["tests"]:
        return
    files = sorted(TESTS.rglob("test_*.py"))
    begin = len(files) * int(worker["workerid"].removeprefix("gw")) // worker["workercount"]
    for path in (*files[begin:], *files[:begin]):
        if not (path.parent / "__init__.py").exists():  # pytest names what is in one otherwise
            with suppress(Exception, pytest.skip.Exception):
                importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Stand back behind the cities of another process, which are bound to real time.

    As far as a search does that a city starts: it would wait for all other tests to end otherwise.
    In a session of its own, for the kernel may weigh sessions, and processes only within one.
    """
    is_worker, is_bound = "PYTEST_XDIST_WORKER" in os.environ, is_bound_to_real_time(item.nodeid)
    if is_worker and not is_bound and os.getpriority(os.PRIO_PROCESS, 0) < NICER:
        with suppress(OSError):
            os.setsid()
        stand_back(os.getpid())


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Let one process run all tests that are bound to real time, and one all of any other file.

    The first mostly wait for cities, two of which would starve each other; the others stay
    together for what they share, as pages share a city and a browser.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            path = nodeid.partition("::")[0]
            if is_bound_to_real_time(nodeid):
                return "tests/e2e"
            return PAGES if path.startswith(PAGES) else path

    return ByFile(config, log)


def pytest_collection_finish() -> None:
    """Keep thousands of collected tests out of every later collection of garbage.

    It comes when five thousand objects are new, not 700: tests leave whole applications behind.

    Libraries calculate on one thread, as searches and the Eye let them: for small matrices a second
    one only waits, and takes a core for that.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(5_000, 10, 10)
    importlib.import_module("scipy.linalg")  # it has threads of its own, and might come later
    threadpool_limits(1)
    if "cv2" in sys.modules:
        sys.modules["cv2"].setNumThreads(1)


@pytest.fixture(scope="module")
def lasting_links() -> Iterator[None]:
    """Let links between stations of this process outlast a stall, which holds up both ends."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("scm.v2x.zenoh_config.LEASE_MS", 60_000)
        yield


@pytest.fixture(scope="session")
def root() -> Path:
    """The project's own folder."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """Other people's recordings and maps, which are not part of the project."""
    if not SHARED.is_dir():
        pytest.skip("../shared is not here: it holds other people's data")
    return SHARED
