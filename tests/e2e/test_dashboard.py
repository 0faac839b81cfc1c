"""The page in a real browser, over a real server, with a city made up by `demo_city`."""

import importlib.util
import os
import re
import shutil
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from scm.api.keys import KeyRing
from scm.store.memory import MemoryStore

CHROMIUM = shutil.which("chromium") or "/usr/bin/chromium"
ARGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]
pytestmark = [
    pytest.mark.e2e,
    pytest.mark.skipif(
        not Path(CHROMIUM).exists() and "CI" not in os.environ,
        reason=f"no browser: {CHROMIUM} is missing (apt-get install chromium)",
    ),
]

_spec = importlib.util.spec_from_file_location(
    "demo_city", Path(__file__).with_name("demo_city.py")
)
demo_city = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(demo_city)


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGS)
        yield chromium
        chromium.close()


@pytest.fixture
def served():
    with demo_city.ServedCity() as city:
        yield city


class Watched:
    """A page that remembers everything it complained about and every host it asked."""

    def __init__(self, page):
        self.page = page
        self.complaints = []
        self.hosts = set()
        self.pictures_ns = []  # exposures of the Eye's pictures, as they were served
        page.on("console", self._on_console)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.hosts.add(urlsplit(request.url).netloc))
        page.on("response", self._on_response)

    def _on_response(self, response):
        if "frame.jpg" in response.url:
            self.pictures_ns.append(int(response.headers["x-time-ns"]))

    def _on_console(self, message):
        if message.type in ("error", "warning"):
            self.complaints.append(message.text)


@pytest.fixture
def open_page(browser, served):
    contexts = []

    def open_at(width=1440, height=900, scheme="dark", script=""):
        context = browser.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme
        )
        contexts.append(context)
        context.add_init_script(script)
        watched = Watched(context.new_page())
        watched.page.goto(served.url)
        watched.page.wait_for_selector('.link-state[data-link="live"]')
        return watched

    yield open_at
    for context in contexts:
        context.close()


def wait_for(page, expression, argument=None):
    page.wait_for_function(expression, arg=argument, timeout=10_000)


def wait_until(page, condition, patience_ms=10_000):
    """Wait for something on our side; the page lives on meanwhile."""
    for _ in range(patience_ms // 20):
        if condition():
            return
        page.wait_for_timeout(20)
    assert condition()


def pixels(page):
    """A fingerprint of what is drawn on the map's canvas."""
    return page.evaluate("document.querySelector('.map canvas').toDataURL()")


def test_the_page_shows_the_living_city_and_asks_nobody_else(open_page, served):
    watched = open_page()
    page = watched.page
    page.wait_for_selector(".cars tbody tr")
    assert page.title().startswith("Driving School")
    assert page.locator(".cars tbody tr").count() == 6
    assert page.locator(".light").count() == 4
    wait_for(
        page,
        """() => [...document.querySelectorAll('.light')].every(light =>
            ['red', 'yellow', 'green'].includes(light.dataset.colour)
            && /^[RYG]$/.test(light.querySelector('.lamp').textContent)
            && /^[0-9.]+ s$/.test(light.querySelector('.left').textContent))""",
    )
    assert page.locator('.stations li[data-state="alive"]').count() >= 8
    assert "open" in page.locator(".events li").first.inner_text()
    before = pixels(page)
    wait_for(page, "old => document.querySelector('.map canvas').toDataURL() !== old", before)
    wait_for(page, "() => document.querySelectorAll('.residuals li').length === 6")
    wait_for(page, "() => document.querySelector('.picture').width === 720")
    assert watched.complaints == []
    assert watched.hosts == {urlsplit(served.url).netloc}


def test_every_car_moves_and_time_to_change_counts_down(open_page):
    page = open_page().page
    trips = "() => [...document.querySelectorAll('.cars .trip')].map(e => parseFloat(e.innerText))"
    wait_for(page, f"() => ({trips})().length === 6")
    before = page.evaluate(trips)
    wait_for(page, f"old => ({trips})().every((metre, i) => metre !== old[i])", before)
    left = "() => parseFloat(document.querySelector('.light .left').textContent)"
    start = page.evaluate(left)
    wait_for(page, f"old => ({left})() !== old", start)


def test_the_picture_of_the_eye_has_tags_drawn_over_it(open_page):
    page = open_page().page
    wait_for(
        page,
        """() => {
            const canvas = document.querySelector('.picture');
            if (!canvas || canvas.width !== 720) return false;
            const {data} = canvas.getContext('2d').getImageData(0, 0, 720, 380);
            let drawn = 0;
            for (let i = 0; i < data.length; i += 4)
                drawn += data[i] < 90 && data[i + 1] > 200 && data[i + 2] > 150;
            return drawn > 200;
        }""",
    )
    assert re.search(r"7 tags", page.locator(".eye .facts").inner_text())
    assert re.fullmatch(r"\d+\.\d mm", page.locator(".residuals li span").first.inner_text())


HEARS_OF_THE_EYE_WHEN_TOLD = """
EventSource.prototype.addEventListener = function (name, take) {
    const hear = (message) => {
        const { eye, ...others } = JSON.parse(message.data);
        if (eye?.length) window.heard = eye;
        const known = name === 'snapshot' ? { eye: [] } : {};
        take({ data: JSON.stringify({ ...others, ...known }) });
    };
    window.tell = (eye) => take({ data: JSON.stringify({ eye }) });
    EventTarget.prototype.addEventListener.call(this, name, hear);
};
"""


def test_a_page_that_hears_late_still_fetches_the_newest_picture_of_the_eye(open_page, served):
    def newest_ns():
        return served.view.picture().frames["overhead"][-1].message.t_ns

    watched = open_page(script=HEARS_OF_THE_EYE_WHEN_TOLD)
    page = watched.page
    wait_for(page, "() => window.heard")
    named_ns = int(page.evaluate("(window.old = window.heard)[0].frame_t_ns"))
    wait_until(page, lambda: newest_ns() > named_ns)
    served.city.eye_shut = True
    page.evaluate("window.tell(window.old)")
    wait_until(page, lambda: watched.pictures_ns)
    assert watched.pictures_ns[0] > named_ns
    wait_until(page, lambda: page.evaluate("window.heard[0].frame_t_ns") == str(newest_ns()))
    page.evaluate("window.tell(window.heard)")
    drawn = "newest => document.querySelector('.picture').dataset.frame === newest"
    wait_for(page, drawn, str(newest_ns()))


def test_how_far_the_eyes_picture_is_behind_the_map_is_said(open_page, served):
    served.city.eye_late_ns = 20_000_000_000
    page = open_page().page
    wait_for(page, "() => document.querySelector('.picture').dataset.frame")
    behind = "parseFloat(document.querySelector('.eye .facts .warn').textContent)"
    page.wait_for_selector(".eye .facts .warn")
    assert page.evaluate(behind) >= 20.0


def test_the_red_button_stops_the_city_and_releases_it(open_page, served):
    page = open_page().page
    page.click("#city-stop")
    page.wait_for_selector("dialog[open]")
    assert page.evaluate("document.activeElement.textContent") == "Stop all cars"
    page.keyboard.press("Enter")
    page.wait_for_selector(".banner.stopped")
    assert served.city.stopped.by == "dashboard"
    wait_for(page, "() => document.querySelectorAll('.mode[data-mode=stop]').length === 6")
    page.click("#city-stop")
    page.wait_for_selector("dialog[open]")
    page.keyboard.press("Enter")
    page.wait_for_selector(".banner.stopped", state="detached")
    assert served.city.stopped is None


def test_a_city_with_keys_asks_for_one_and_shows_itself_to_who_has_it(browser):
    ring = KeyRing(MemoryStore())
    key = ring.add("anna", "operator", 1)
    with demo_city.ServedCity(keys=ring) as city, browser.new_context() as context:
        page = context.new_page()
        page.goto(city.url)
        for given in ("scm_00000000_wrong", key):
            page.fill("dialog input[name=key]", given)
            with page.expect_response("**/api/v1/session"):
                page.click("dialog button.primary")
        page.wait_for_selector('.link-state[data-link="live"]')
        page.wait_for_selector(".cars tbody tr")
        wait_for(page, "() => document.querySelector('.picture').width === 720")
        page.click("#city-stop")
        page.wait_for_selector("dialog[open]")
        page.keyboard.press("Enter")
        page.wait_for_selector(".banner.stopped")
        assert city.city.stopped.by == "dashboard"


def test_the_red_button_asks_first(open_page, served):
    page = open_page().page
    page.click("#city-stop")
    page.wait_for_selector("dialog[open]")
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    assert served.city.stopped is None


def test_a_lost_vehicle_is_shown_as_lost(open_page, served):
    page = open_page().page
    page.wait_for_selector('[data-station="n6"][data-state="alive"]')
    served.city.lose("n6")
    page.wait_for_selector('[data-station="n6"][data-state="lost"]')
    page.wait_for_selector('[data-car="n6"][data-alive="false"]')
    wait_for(page, "() => document.querySelector('.events').innerText.includes('n6 is gone')")


def test_a_chosen_cars_camera_is_watched_for_as_long_as_it_is_shown(open_page, served):
    page = open_page().page
    assert served.view.watched("n2") == ()
    page.click('[data-car="n2"] .name')
    page.wait_for_selector('.film[data-seen="true"]')
    assert page.evaluate("document.querySelector('.film img').naturalWidth") == 1280
    assert served.view.watched("n2") == ("front",)
    page.click(".film")
    assert page.locator(".film").bounding_box()["width"] > 1000
    page.keyboard.press("Escape")
    assert page.locator(".film").bounding_box()["width"] < 400
    assert served.view.watched("n2") == ("front",)
    page.click('.tabs button:has-text("rear")')
    wait_until(page, lambda: served.view.watched("n2") == ("rear",))
    page.wait_for_selector('.film[data-seen="true"]')
    page.click('.car [aria-label="Close"]')
    page.wait_for_selector(".eye")
    wait_until(page, lambda: served.view.watched("n2") == ())
    assert set(served.city.pictured) == {("n2", "front"), ("n2", "rear")}


def test_a_car_without_cameras_says_so_and_none_is_asked_for(open_page, served):
    served.city.files |= {"n2": "dart", "n3": "f1tenth"}
    page = open_page().page
    page.click('[data-car="n1"] .name')
    page.click('.tabs button:has-text("rear")')
    page.click('[data-car="n2"] .name')
    page.wait_for_selector('.car:has-text("This car has no cameras.")')
    assert page.locator(".film, .tabs button").count() == 0
    page.click('[data-car="n3"] .name')  # has none at its rear, which was chosen before
    wait_until(page, lambda: served.view.watched("n3") == ("front",))
    assert page.locator(".tabs button").all_text_contents() == ["front"]
    assert served.view.watched("n2") == ()


def test_lights_are_switched_and_shown(open_page, served):
    page = open_page().page
    page.click('[data-car="n3"] .name')
    page.click('[aria-label="Headlights high"]')
    page.wait_for_selector('[aria-label="Headlights high"][aria-pressed="true"]')
    page.wait_for_selector('[data-lamp="tail"][data-on="true"]')
    page.click('[aria-label="Indicators hazard"]')
    page.wait_for_selector('[aria-label="Indicators hazard"][aria-pressed="true"]')
    page.click('[aria-label="Indicators off"]')
    page.wait_for_selector('[aria-label="Indicators hazard"][aria-pressed="false"]')
    assert served.city.switches["n3"].headlights == "high"


def test_silence_of_the_world_is_greyed_and_then_said(open_page, served):
    page = open_page().page
    served.city.silent = True
    page.wait_for_selector('.sheet[data-link="stale"]')
    page.wait_for_selector(".banner.lost")
    assert page.locator('.light[data-colour="unknown"]').count() == 4
    served.city.silent = False
    page.wait_for_selector(".banner.lost", state="detached")


def test_a_plan_is_chosen_and_a_fault_is_cleared(open_page, served):
    page = open_page().page
    page.select_option(".plan select", "busy")
    wait_for(page, "() => document.querySelector('.plan select').value === 'busy'")
    assert served.city.plan == "busy"
    served.city.fault = "conflict"
    page.wait_for_selector('.monitor[data-state="fault"]')
    wait_for(page, "() => document.querySelector('.lamp').textContent === 'F'")
    page.click(".monitor button")
    page.fill('dialog input[name="reason"]', "bulb replaced")
    page.keyboard.press("Enter")
    page.wait_for_selector('.monitor[data-state="ok"]')
    assert served.city.fault is None


def test_a_refusal_is_told_in_words(open_page, served):
    page = open_page().page
    page.wait_for_selector('[data-car="n2"]')
    served.city.ask_refuses = "n2 is driven by somebody else"
    page.click('[data-car="n2"] td:last-child button')
    page.click("dialog .danger")
    page.wait_for_selector(".notice.error")
    assert "driven by somebody else" in page.locator(".notice.error").inner_text()


@pytest.mark.parametrize(
    ("width", "height", "one_screen"), [(1440, 900, True), (1024, 768, True), (390, 844, False)]
)
def test_the_page_fits_its_window(open_page, width, height, one_screen):
    page = open_page(width, height, "light").page
    page.wait_for_selector(".residuals li")
    wide, high = page.evaluate(
        "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
    )
    assert wide <= width
    assert high <= height or not one_screen
    assert page.locator("#city-stop").is_visible()
    box = page.locator(".map .sheet").bounding_box()
    assert box["width"] > 300
    assert box["height"] > 150


def test_the_list_of_routes_needs_no_other_host(open_page, served):
    watched = open_page()
    watched.page.goto(f"{served.url}/docs")
    watched.page.wait_for_selector("details")
    assert watched.page.locator("details").count() >= 15
    assert watched.complaints == []
    assert watched.hosts == {urlsplit(served.url).netloc}
