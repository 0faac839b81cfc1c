"""A whole city, and a real browser that looks at its pages.

`running` is a city in lockstep, with all its parts: it takes a third of the time of a real one, and
slows down where the machine is busy. Files whose tests need processes, a bus or real time (a part
is killed, hands drive a car) take the city as a user starts it, `live_city`, for `running`;
`tests/conftest.py` lists the others. One city serves all tests that one process runs: each leaves
it as it found it (no stop engaged, cars of its own removed).
Set SCM_PICTURES to a folder to keep what `look` photographs.
"""

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from scm.maps.load import MAPS_DIR
from tests.e2e.city_process import CityProcess, city, wait_for
from tests.e2e.pages.driving import send_on
from tests.e2e.pages.town import Town, town
from tests.e2e.pages.visiting import LOOKS, SIZES, Visit, in_both_themes, judge, photograph

HERE = Path(__file__).parent
CHROMIUM = shutil.which("chromium") or "/usr/bin/chromium"
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--in-process-gpu",  # it paints in software: a process of its own would copy everything
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Look at the recordings early, while the city's is short; skip where no browser is.

    CI has to have one.
    """
    early = ("test_events_page.py", "test_recordings_page.py")
    items.sort(key=lambda item: item.path.parent != HERE or item.path.name not in early)
    if Path(CHROMIUM).exists() or "CI" in os.environ:
        return
    reason = f"no browser: {CHROMIUM} is missing (apt-get install chromium)"
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.skip(reason=reason))


@pytest.fixture(scope="package")
def slow_eye(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The map of both cities: its Eye looks a fifth as often, as it takes the most time."""
    text = (MAPS_DIR / "driving_school.toml").read_text("utf-8")
    assert text.count("rate_hz = 10.0") == 1
    path = tmp_path_factory.mktemp("map") / "driving_school.toml"
    path.write_text(text.replace("rate_hz = 10.0", "rate_hz = 2.0"), "utf-8")
    return str(path)


@pytest.fixture(scope="package")
def live_city(slow_eye: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[CityProcess]:
    """`scm up driving_school`: four hosted cars, two agents, signals, Eye and recorder."""
    with city(tmp_path_factory.mktemp("pages"), city_map=slow_eye) as process:
        wait_for(lambda: len(process.get("/vehicles")["vehicles"]) == 6, 90.0, "six cars are there")
        yield process


@pytest.fixture(scope="package")
def running(slow_eye: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Town]:
    """The same in lockstep."""
    with town(slow_eye, tmp_path_factory.mktemp("town"), cars=4, whole=True) as process:
        assert len(process.get("/vehicles")["vehicles"]) == 6
        yield process


@pytest.fixture(autouse=True)
def in_order(running: CityProcess | Town) -> None:
    """Begin each test in a city that drives, whatever the one before it left.

    A starved machine makes the monitor latch a fault; a test that failed may leave it stopped.
    """
    if running.get("/stop")["engaged"]:
        running.web.put("/stop", json={"engaged": False, "by": "tests"}).raise_for_status()
    for row in running.get("/signals")["signals"]:
        if row["monitor"] is not None and row["monitor"]["fault"]:
            body = {"by": "tests", "reason": "the machine was busy"}
            path = f"/signals/{row['junction']}/monitor/reset"
            running.web.post(path, json=body).raise_for_status()
    for row in running.get("/vehicles")["vehicles"]:
        if row["owner"] == "world" and row["trip"] is None:  # a script drove it, and went
            send_on(running, row["vehicle"])


@pytest.fixture(scope="package")
def browser() -> Iterator[Any]:
    """Debian's Chromium."""
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture(scope="package")
def windows() -> list[Any]:
    """Windows that stand empty: a new one costs the browser a second, all scripts read anew."""
    return []


@pytest.fixture
def visit(
    browser: Any, windows: list[Any], running: CityProcess | Town, request: pytest.FixtureRequest
) -> Iterator[Callable[..., Visit]]:
    """Open an address of the dashboard in a window of its own, and wait until it is live."""
    opened, failed = [], request.session.testsfailed

    def open_at(path: str, size: str = "wide", theme: str = "light", script: str = "") -> Visit:
        """Visit `path`; a `script` that runs before the page's own takes a new window."""
        page = windows.pop() if windows and not script else browser.new_context().new_page()
        width, height = SIZES[size]
        page.set_viewport_size({"width": width, "height": height})
        page.emulate_media(color_scheme=theme)
        if script:
            page.add_init_script(script)
        visited = Visit(page)
        opened.append((visited, not script))
        page.goto(running.url + path)
        page.wait_for_selector('.link-state[data-link="live"]')
        return visited

    yield open_at
    for visited, is_plain in opened:
        if is_plain and request.session.testsfailed == failed and not visited.page.is_closed():
            visited.forget()
            windows.append(visited.page)
        else:
            visited.page.context.close()


@pytest.fixture
def look(visit: Callable[..., Visit]) -> Callable[..., Visit]:
    """Look at a page: it is quiet, accessible, asks nobody else, fits; photograph it."""

    def at(path: str, name: str, size: str, theme: str, ready: str = "main > *") -> Visit:
        """Visit `path`, wait for the selector `ready`, judge it in both themes, and keep pictures.

        They are called `name_size_theme.png`.
        """
        visited = visit(path, size, theme)
        visited.page.wait_for_selector(ready)
        for shown in in_both_themes(visited, theme):
            judge(visited)
            photograph(visited, f"{name}_{size}_{shown}")
        return visited

    return at


@pytest.fixture
def look_around() -> Callable[[Visit, str, str], None]:
    """Look at an open page in both sizes and both themes, each once."""

    def at(visited: Visit, part: str, name: str) -> None:
        """Judge the page, and keep `name_size_theme.png` with the selector `part` in view."""
        for size, theme in LOOKS:
            width, height = SIZES[size]
            visited.page.set_viewport_size({"width": width, "height": height})
            visited.page.emulate_media(color_scheme=theme)
            visited.page.locator(part).scroll_into_view_if_needed()
            judge(visited)
            photograph(visited, f"{name}_{size}_{theme}")

    return at
