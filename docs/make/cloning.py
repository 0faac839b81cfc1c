"""Makes the pictures of a network that drives and of a demonstration, in docs/pictures.

Run with `python -m docs.make.cloning DEMONSTRATION MODEL [FOLDER]` in a clone.
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

from scm.camera.part import CameraPart
from scm.maps.load import load_map
from scm.vehicles.car import load_car
from tests.e2e.pages.conftest import ARGUMENTS, CHROMIUM
from tests.e2e.pages.town import town
from tests.e2e.pages.visiting import SIZES
from vehicle_agent.cloning.demonstration import Demonstration
from vehicle_agent.cloning.demonstration_page import demonstration_page
from vehicle_agent.cloning.driving import NetworkPart

PICTURES = Path(__file__).parents[1] / "pictures"
MAP = "driving_school"
PATIENCE_MS, DRIVEN_MS = 120_000.0, 12_000.0
WIDTH, HEIGHT = 900, 800


def main() -> None:
    """Take them."""
    demonstration, model = Path(sys.argv[1]), Path(sys.argv[2])
    folder = Path(sys.argv[3]) if len(sys.argv) > 3 else PICTURES
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        _network(browser, model, folder / "dashboard" / "network_wide_light.png")
        _demonstration(browser, Demonstration(demonstration), folder)
        browser.close()


def _network(browser: Any, model: Path, picture: Path) -> None:
    """The vehicle's page while a network drives."""
    camera, driver = CameraPart(load_map(MAP)), NetworkPart("drive-n1", "n1", model, spawn="")
    with (
        tempfile.TemporaryDirectory() as scratch,
        town(MAP, Path(scratch), cars=0) as city,
        city.joined(camera),
        city.joined(driver),
    ):
        width, height = SIZES["wide"]
        page = browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(PATIENCE_MS)
        page.goto(f"{city.url}/vehicles/n1")
        page.click("text=saliency")
        page.wait_for_timeout(DRIVEN_MS)
        page.wait_for_selector('[data-fact="saliency"]')
        page.screenshot(path=picture)
        page.close()


def _demonstration(browser: Any, demonstration: Demonstration, folder: Path) -> None:
    """Two sections of a demonstration's page."""
    page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
    page.set_content(demonstration_page(demonstration, load_car(demonstration.about.car)))
    for section in ("balancing", "augmentation"):
        page.locator(f"#{section}").screenshot(path=folder / f"{section}.png")
    page.close()


if __name__ == "__main__":
    main()
