"""Parts of a real city fall silent, die and come back: what its pages say of it."""

import pytest

from tests.e2e.city_process import wait_for
from tests.e2e.pages.driving import CAR, drives_by_itself, row, take
from tests.e2e.pages.visiting import judge, photograph


@pytest.fixture(scope="module")
def running(live_city):
    """The city as a user starts it: its parts are killed."""
    return live_city


def release(running):
    """Let the city drive again."""
    running.web.put("/stop", json={"engaged": False, "by": "tests"}).raise_for_status()


def test_a_silent_world_greys_the_page_then_says_so_and_comes_back_by_itself(visit, running):
    visited = visit("/map")
    page = visited.page
    with running.frozen("world"):
        page.wait_for_selector('.page[data-link="stale"]')
        page.wait_for_selector('.page[data-link="lost"] .banner.lost')
        page.click("#city-stop")
        page.wait_for_selector(".banner.lost >> text=The stop is not confirmed")
        photograph(visited, "stop_not_confirmed")
        page.click(".banner.lost >> text=Dismiss")
        page.wait_for_selector("text=The stop is not confirmed", state="detached")
    try:
        running.web.put("/stop", json={"engaged": True, "by": "tests"}).raise_for_status()
        page.wait_for_selector(".banner.stopped >> text=all cars stand")
        page.wait_for_selector(".banner.lost", state="detached")
    finally:
        release(running)
    assert [one for one in visited.complaints if "status of 50" not in one] == []


def test_signals_that_are_silent_are_said_to_be_and_come_back_by_themselves(visit, running):
    visited = visit("/signals/crossing")
    page = visited.page
    with running.frozen("traffic"):
        page.wait_for_selector(".banner.lost >> text=The signals of crossing are silent")
        page.wait_for_selector("text=its controller is silent")
        judge(visited)
        photograph(visited, "signals_silent")
    page.wait_for_selector(".banner.lost", state="detached")
    page.wait_for_selector("text=its controller is silent", state="detached")


def test_a_server_that_comes_back_is_heard_again_and_another_city_s_read_anew(visit, running):
    page = visit("/map").page
    page.evaluate("() => { window.sameDocument = true }")

    def rename(route):
        told = running.get("/map")
        route.fulfill(json=told | {"title": "Another town"})

    page.route("**/api/v1/map", rename)
    running.kill("api")
    page.wait_for_selector("h1 >> text=Another town")
    page.wait_for_selector('.page[data-link="live"]')
    page.wait_for_function("() => !document.querySelector('.banner.lost')")
    assert not page.evaluate("() => window.sameDocument")
    page.unroute("**/api/v1/map")


def test_a_fault_of_the_monitor_is_shown_kept_and_cleared_with_a_reason(visit, running):
    visited = visit("/signals/crossing")
    page = visited.page

    def fault():
        return running.get("/signals/crossing")["monitor"]["fault"]

    with running.frozen("traffic"):
        page.wait_for_selector('.monitor[data-state="fault"]')
        page.wait_for_selector(".runs[data-mode=silent]")
        visited.until(lambda: fault() == "stale", "the fault is latched")
    wait_for(lambda: running.get("/signals/crossing")["fresh"], 90.0, "the controller is back")
    page.click(".monitor .danger")
    page.fill("dialog input[name=reason]", "it was frozen by a test")
    page.keyboard.press("Enter")
    visited.until(lambda: fault() is None, "the fault is cleared")
    page.wait_for_selector(".lately >> text=it was frozen by a test")
    page.click(".monitor >> text=History")
    page.wait_for_selector("dialog .history >> text=stale")
    page.keyboard.press("Escape")
    page.wait_for_selector('.monitor[data-state="ok"]')
    wait_for(
        lambda: running.get("/signals/crossing")["mode"] == "plan", 30.0, "the plan runs again"
    )


def test_a_wheel_on_a_dead_line_says_so_and_is_given_back(visit, running):
    visited = visit(f"/vehicles/{CAR}")
    page = visited.page
    take(visited, running)
    page.keyboard.down("w")
    page.wait_for_selector('.now[data-why="driving"]')
    with running.frozen("api"):
        page.wait_for_selector('.now[data-why="no_reply"]')
        page.wait_for_selector(".banner.lost >> text=No connection to the server")
        page.wait_for_selector('.over[data-code="cut"]')
        page.keyboard.up("w")
        page.click("#city-stop")
        page.wait_for_selector(".banner.lost >> text=The stop is not confirmed")
        page.wait_for_selector(".notice >> text=The city did not answer in time.")
    wait_for(lambda: running.get("/stop")["engaged"], 60.0, "the late stop has arrived")
    running.web.put("/stop", json={"engaged": False, "by": "tests"}).raise_for_status()
    page.wait_for_selector('.page[data-link="live"]')
    wait_for(lambda: row(running)["lease_left_ms"] is None, 90.0, "its lease has ended")
    page.click("text=Let it drive")
    drives_by_itself(running)


GREY = """() => [...document.querySelectorAll("main .moves")].map(
    (one) => getComputedStyle(one).filter.includes("grayscale(1)"))"""


def test_what_moves_is_grey_while_nobody_tells_it_and_comes_back_by_itself(visit, running):
    visited = visit(f"/vehicles/{CAR}")
    page = visited.page
    page.evaluate("() => { window.sameDocument = true }")
    page.wait_for_selector('.film[data-seen="true"]')
    page.wait_for_selector(".lidar canvas")
    age = page.locator(".facts dd:has-text('ago')")
    with running.frozen("world"):
        visited.wait(f"() => (({GREY})()).every(Boolean)")
        assert page.locator("main .moves").count() == 6
        visited.until(lambda: " s" in age.inner_text(), "its age goes on")
        page.wait_for_selector(".film .late:has-text('old')")
        photograph(visited, "vehicle_silent")
    fresh = f"() => !({GREY})().some(Boolean)"
    visited.wait(fresh)
    running.kill("api")
    page.wait_for_selector(".film .late")
    visited.wait(fresh)
    assert page.evaluate("() => window.sameDocument")
