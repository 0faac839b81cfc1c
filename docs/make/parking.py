"""Makes the pictures of cars that park themselves and map rooms, in docs/pictures/dashboard.

Run with `python -m docs.make.parking [FOLDER]` in a clone. The cities run in lockstep: on a busy
machine their time goes slower, and no part is late.
"""

import base64
import sys
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

from scm.maps.load import MAPS_DIR
from scm.vehicles.car import load_car
from tests.e2e.city_process import wait_for
from tests.e2e.pages.conftest import ARGUMENTS, CHROMIUM
from tests.e2e.pages.town import Town, town
from tests.e2e.pages.visiting import SIZES
from vehicle_agent.autonomy.map_part import MapPart
from vehicle_agent.autonomy.parking import prepare
from vehicle_agent.autonomy.part import ParkPart, Wanted

PICTURES = Path(__file__).parents[1] / "pictures" / "dashboard"
ROOM = "parking_school_obstacles"
UNMAPPED = """
[[boxes]]
name = "unmapped"
x_m = 0.12
y_m = 0.1
length_m = 0.12
width_m = 0.1
mapped = false

[[spawns]]"""
FREE = b"\0"
PATIENCE_S = 300.0


def main() -> None:
    """Take them."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURES
    prepare(load_car("nigel"))
    with tempfile.TemporaryDirectory() as scratch, _browser() as browser:
        _parking(Path(scratch), browser, folder)
        _mapping(Path(scratch), browser, folder)


def _parking(scratch: Path, browser: Any, folder: Path) -> None:
    """A car that drives to its goal; round a box that is not on its map, with the costmap."""
    agent = ParkPart("park-n1", Wanted("n1", "goal", spawn="start"))
    with town(ROOM, scratch, cars=0) as city, city.joined(agent):
        page = _page(city, browser)
        wait_for(lambda: city.get("/vehicles/n1")["x_m"] > -0.1, PATIENCE_S, "it is half way")
        page.screenshot(path=folder / "parking_wide_light.png")
        page.close()
    text = (MAPS_DIR / f"{ROOM}.toml").read_text("utf-8").replace("\n[[spawns]]", UNMAPPED, 1)
    path = scratch / f"{ROOM}.toml"
    path.write_text(text, "utf-8")
    agent = ParkPart("park-n1", Wanted("n1", "goal", spawn="start"))
    with town(str(path), scratch, cars=0) as city, city.joined(agent):
        page = _page(city, browser, layers={"costmap": True}, theme="dark")
        wait_for(
            lambda: city.web.get("/vehicles/n1/plan").json().get("candidates"),
            PATIENCE_S,
            "it compares ways",
        )
        page.wait_for_selector(".costmap-key")
        page.wait_for_timeout(700)
        page.screenshot(path=folder / "costmap_wide_dark.png")
        page.close()


def _mapping(scratch: Path, browser: Any, folder: Path) -> None:
    """A car that maps the room."""
    with town(ROOM, scratch, cars=1) as city, city.joined(MapPart("map-n1", "n1")):
        page = _page(city, browser)
        wait_for(lambda: _is_on_its_way(city, 1.5), PATIENCE_S, "it has mapped most of the room")
        page.wait_for_timeout(700)
        page.screenshot(path=folder / "mapping_wide_light.png")
        page.close()


def _is_on_its_way(city: Town, free_m2: float) -> bool:
    """Return whether a mapping car has seen so much floor and drives to see more."""
    answer = city.web.get("/vehicles/n1/map")
    if answer.status_code != 200:
        return False
    row = answer.json()
    cells = zlib.decompress(base64.b64decode(row["cells"]))
    return bool(row["path"]) and cells.count(FREE) * row["cell_m"] ** 2 > free_m2


def _page(
    city: Town, browser: Any, layers: dict[str, bool] | None = None, theme: str = "light"
) -> Any:
    """Return the map page of a city with n1 chosen, once it is there."""
    wait_for(lambda: city.web.get("/vehicles/n1").status_code == 200, PATIENCE_S, "n1 is there")
    width, height = SIZES["wide"]
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=theme)
    shown = str(layers or {}).replace("True", "true").replace("'", '"')
    page.add_init_script(f"localStorage.setItem('scm-map-layers', '{shown}')")
    page.goto(f"{city.url}/map?vehicle=n1")
    page.wait_for_selector('.link-state[data-link="live"]')
    return page


@contextmanager
def _browser() -> Iterator[Any]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


if __name__ == "__main__":
    main()
