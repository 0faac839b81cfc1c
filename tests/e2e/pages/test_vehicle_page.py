"""The vehicle page in a real city: looked at, driven by keys, pads and a gamepad, given back."""

import pytest

from tests.e2e.city_process import wait_for

CAR, AGENT = "n1", "n5"
PADS = """
window.gamepad = null;
navigator.getGamepads = () => [window.gamepad];
"""


def row(running, name=CAR):
    return running.get(f"/vehicles/{name}")


def speed(running, name=CAR):
    return row(running, name)["speed_mps"]


def take(visited, running, name=CAR):
    """Take a car over on its open page, and wait until it stands under the wheel."""
    page = visited.page
    page.click("text=Take over")
    page.wait_for_selector('.wheel[data-state="held"]')

    def stands():
        car = row(running, name)
        return car["lease_left_ms"] is not None and abs(car["speed_mps"]) < 0.01

    visited.until(stands, "it stands under the wheel")


def give_back(visited, running, name=CAR):
    visited.page.click(".give-back")
    visited.page.wait_for_selector('.over[data-code="given_back"] >> text=goes on by itself')
    drives_by_itself(running, name)


def drives_by_itself(running, name=CAR):
    def drives():
        car = row(running, name)
        return car["lease_left_ms"] is None and car["mode"] == "drive" and car["trip"]

    wait_for(drives, 20.0, f"{name} drives by itself again")


@pytest.mark.parametrize("size", ["wide", "narrow"])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_table_of_all_vehicles_looks_right(look, size, theme):
    page = look("/vehicles", "vehicles", size, theme, ready="tr[data-car]").page
    assert page.locator("tr[data-car]").count() == 6


@pytest.mark.parametrize("size", ["wide", "narrow"])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_one_vehicle_looks_right(visit, look, size, theme):
    ready = '.film[data-seen="true"]'
    visited = look(f"/vehicles/{CAR}", "vehicle", size, theme, ready=ready)
    visited.page.wait_for_selector(".lidar canvas")


def test_a_car_is_found_by_typing_and_opened_by_the_keyboard(visit):
    page = visit("/vehicles").page
    page.wait_for_selector("tr[data-car]")
    page.fill("input[type=search]", AGENT)
    page.wait_for_function("() => document.querySelectorAll('tr[data-car]').length === 1")
    page.focus(f"tr[data-car={AGENT}] a")
    page.keyboard.press("Enter")
    page.wait_for_function(f"() => document.querySelector('.who select')?.value === '{AGENT}'")
    assert page.url.endswith(f"/vehicles/{AGENT}")


def test_a_car_that_is_not_there_is_told_in_words(visit):
    page = visit("/vehicles/nobody").page
    page.wait_for_selector("text=No vehicle named nobody")


def test_a_held_key_drives_and_a_released_one_stops_within_half_a_second(visit, running):
    visited = visit(f"/vehicles/{CAR}")
    page = visited.page
    take(visited, running)
    page.keyboard.down("w")
    visited.until(lambda: speed(running) > 0.05, "it drives while the key is held")
    page.wait_for_selector('.now[data-why="driving"]')
    command = "document.querySelector('[data-plot=throttle] .key b').textContent"
    page.wait_for_function(f"() => Number({command}) > 0")
    page.keyboard.up("w")
    stands_within(running, 0.5)
    page.wait_for_selector('.now[data-why="released"]')
    assert "ms" in page.inner_text('[data-fact="latency"]')
    give_back(visited, running)
    assert visited.complaints == []


def stands_within(running, seconds):
    """The car rests by its own clock so long after the newest command that was none."""
    began_ns = running.get("/vehicles")["t_ns"]
    wait_for(lambda: abs(speed(running)) < 0.01, 10.0, "it stands")
    assert running.get("/vehicles")["t_ns"] - began_ns < 1e9 * (seconds + 0.5), "and slack to ask"


def test_a_hidden_or_blurred_page_lets_go_though_the_key_is_held(visit, running):
    visited = visit(f"/vehicles/{CAR}")
    take(visited, running)
    visited.page.keyboard.down("w")
    visited.until(lambda: speed(running) > 0.05, "it drives while the key is held")
    visited.page.evaluate("() => window.dispatchEvent(new Event('blur'))")
    visited.page.wait_for_selector('.now[data-why="released"]')
    visited.until(lambda: abs(speed(running)) < 0.01, "it stands")
    visited.page.keyboard.up("w")
    give_back(visited, running)


def test_a_gamepad_drives_only_while_its_trigger_is_pulled(visit, running):
    visited = visit(f"/vehicles/{CAR}", script=PADS)
    take(visited, running)
    pad = """pulled => { window.gamepad = {
      connected: true, axes: [-0.5, -1, 0, 0],
      buttons: Array.from({ length: 17 }, (_, i) => ({ value: i === 7 ? pulled : 0 })),
    } }"""
    visited.page.evaluate(pad, 1)
    visited.until(lambda: speed(running) > 0.05, "it drives while the trigger is pulled")
    visited.until(lambda: row(running)["steering_rad"] > 0.0, "a stick to the left steers left")
    visited.page.evaluate(pad, 0)
    visited.until(lambda: abs(speed(running)) < 0.01, "it stands, whatever the stick says")
    give_back(visited, running)


def test_the_city_wide_stop_wins_over_a_held_key(visit, running):
    visited = visit(f"/vehicles/{CAR}")
    take(visited, running)
    visited.page.keyboard.down("w")
    visited.until(lambda: speed(running) > 0.05, "it drives while the key is held")
    stop = {"engaged": True, "by": "test", "reason": "a hand on the floor"}
    running.web.put("/stop", json=stop).raise_for_status()
    try:
        visited.until(lambda: abs(speed(running)) < 0.01, "it stands though the key is held")
        visited.page.wait_for_selector('.now[data-why="stopped"]')
    finally:
        running.web.put("/stop", json=stop | {"engaged": False}).raise_for_status()
    visited.until(lambda: speed(running) > 0.05, "it drives again: the key is still held")
    visited.page.keyboard.up("w")
    give_back(visited, running)


def test_an_agent_s_car_is_driven_and_goes_on_when_the_page_is_closed(visit, running):
    visited = visit(f"/vehicles/{AGENT}", "narrow")
    take(visited, running, AGENT)
    visited.page.hover('[data-pad="ahead"]')
    visited.page.mouse.down()
    visited.until(lambda: speed(running, AGENT) > 0.03, "it drives while the pad is held")
    visited.page.mouse.up()
    visited.until(lambda: abs(speed(running, AGENT)) < 0.01, "it stands")
    visited.page.close()
    drives_by_itself(running, AGENT)


def test_a_second_taker_is_told_who_has_it_and_takes_it_only_with_a_reason(visit, running):
    first = visit(f"/vehicles/{CAR}")
    take(first, running)
    second = visit(f"/vehicles/{CAR}")
    page = second.page
    page.wait_for_selector(".steal")
    assert page.locator("text=Take over").count() == 0
    lease = running.get(f"/leases/{CAR}")
    refused = running.web.post(f"/leases/{CAR}", json={"program": "lane_keeper"})
    assert (refused.status_code, refused.json()["code"]) == (409, "owned")
    assert lease["owner"] in refused.json()["detail"]
    page.fill(".steal input", "the first one sleeps")
    page.click("text=Take it anyway")
    page.wait_for_selector('.wheel[data-state="held"]')
    first.page.wait_for_selector('.over[data-code="lost"]')
    second.page.click(".give-back")
    page.wait_for_selector('.over[data-code="given_back"]')
    running.web.post(f"/vehicles/{CAR}/route", json={}).raise_for_status()
    drives_by_itself(running)
