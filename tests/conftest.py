"""What all tests share: where other people's data lies, and marks that come from the folder."""

import gc
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SHARED = ROOT.parent / "shared"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark every test of `tests/e2e` as such, and let one process run them, from the start on.

    They mostly wait for cities, two of which would starve each other; the tests of any other file
    stay together too, for what they share.
    """
    items.sort(key=lambda item: "e2e" not in item.path.parts)
    for item in items:
        of_city = "e2e" in item.path.parts
        if of_city:
            item.add_marker(pytest.mark.e2e)
        item.add_marker(pytest.mark.xdist_group("cities" if of_city else str(item.path)))


def pytest_collection_finish() -> None:
    """Keep thousands of collected tests out of every later collection of garbage."""
    gc.collect()
    gc.freeze()


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
