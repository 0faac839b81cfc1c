"""The vehicle page: looked at, driven by keys, pads and a gamepad, given back."""

from contextlib import contextmanager

import pytest

from scm.clock import NS_PER_MS
from scm.runtime.part import BasePart, Service, Subscription
from scm.v2x.exchange import Answer, Call
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.echo_request import EchoReply, EchoRequest
from scm.v2x.messages.join_request import JoinReply, JoinRequest
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport
from scm.v2x.messages.network_view import NetworkView
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.vehicle_state import VehicleState
from tests.e2e.city_process import wait_for
from tests.e2e.pages.driving import CAR, drives_by_itself, row, send_on, take
from tests.e2e.pages.visiting import LOOKS, judge, photograph

AGENT, TIRED = "n5", "n9"
PADS = """
window.gamepad = null;
navigator.getGamepads = () => [window.gamepad];
"""


def speed(running, name=CAR):
    return row(running, name)["speed_mps"]


def give_back(visited, running, name=CAR):
    visited.page.click(".give-back")
    visited.page.wait_for_selector('.over[data-code="given_back"] >> text=goes on by itself')
    drives_by_itself(running, name)


class Tired(BasePart):
    """A real car's agent, as far as the city sees: it stands, and its battery is nearly empty.

    With a throttle it wants to drive.
    """

    name, role, period_ns = TIRED, "v", 50 * NS_PER_MS
    subscriptions = (Subscription(Presence, {"role": role, "station": TIRED}),)
    services = (Service(EchoRequest, {"vehicle": TIRED}),)

    def __init__(self, throttle):
        self.throttle, self.seq, self.session, self.place = throttle, 0, None, None

    def step(self, now_ns, inbox):
        self.seq += 1
        outbox = []
        for item in inbox:
            message = item.message
            if isinstance(message, EchoRequest):
                outbox.append(Answer(item, EchoReply(vehicle=TIRED, t_ns=now_ns)))
            elif isinstance(message, Presence):
                self.session = message.session
            elif isinstance(message, JoinReply):
                self.place = message
        if self.place is None:
            if self.session is not None and self.seq % 20 == 0:  # cars may stand everywhere now
                join = JoinRequest(vehicle=TIRED, session=self.session, kind="real")
                outbox.append(Call(join))
            return outbox
        state = VehicleState(
            vehicle=TIRED, t_ns=now_ns, seq=self.seq, x_m=self.place.x_m, y_m=self.place.y_m,
            yaw_rad=self.place.yaw_rad, speed_mps=0.0, yaw_rate_radps=0.0, steering_rad=0.0,
            throttle=self.throttle, source="eye", mode="idle", battery_v=11.08,
            battery_charge=0.1249,
        )  # fmt: skip
        report = MisbehaviourReport(
            suspect=TIRED, suspect_id=9, t_ns=now_ns, since_ns=now_ns, score=6.0, observations=(),
            evidence=(),
        )  # fmt: skip
        return [*outbox, state, report]

    def finish(self, now_ns):
        return [Call(RemoveRequest(vehicle=TIRED))]


class Network(BasePart):
    """As if a network drove: it steers to the left because of the first cell of its second row."""

    name, role, period_ns = "drive-n1", "client", 50 * NS_PER_MS
    subscriptions = (Subscription(CameraFrame, {"vehicle": CAR, "camera": "front"}),)

    def step(self, now_ns, inbox):
        return [
            NetworkView(
                vehicle=CAR, camera="front", t_ns=item.message.t_ns, network="paper",
                file="model.onnx", steering=0.5, throttle=0.9, delay_s=0.0312, inference_s=0.0042,
                top=0.3, rows=3, columns=4, saliency=(0.0, 0.02, 0.0, 0.0, -0.2, *7 * (0.0,)),
            )
            for item in inbox[-1:]
        ]  # fmt: skip


def cars(running):
    return len(running.get("/vehicles")["vehicles"])


def events_of(running, name):
    """Return the events of the car; the world looks at all cars once a second."""
    found = lambda: running.get(f"/events?vehicle={TIRED}&name={name}")["items"]  # noqa: E731
    return wait_for(found, 60.0, f"{name} is among the events")


@contextmanager
def tired(running, throttle=0.0):
    """Have a car in the city whose battery is low, and that was reported once."""
    with running.joined(Tired(throttle)):
        wait_for(lambda: cars(running) == 7, 120.0, "a place is free for it")
        yield
    wait_for(lambda: cars(running) == 6, 60.0, "it left")


def looks_right(visited, name):
    """Judge and photograph what is driven by hand just now, in both colours."""
    for theme in ("light", "dark"):
        visited.page.emulate_media(color_scheme=theme)
        visited.page.wait_for_selector('.now[data-why="driving"]')
        photograph(visited, f"{name}_{theme}")
        judge(visited, ".wheel")  # a page that is silent for 5 s gives the car back


@pytest.mark.parametrize(("size", "theme"), LOOKS)
def test_the_table_of_all_vehicles_looks_right(look, size, theme):
    page = look("/vehicles", "vehicles", size, theme, ready="tr[data-car]").page
    assert page.locator("tr[data-car]").count() == 6


@pytest.mark.parametrize(("size", "theme"), LOOKS)
def test_one_vehicle_looks_right(visit, look, size, theme):
    ready = '.film[data-seen="true"]'
    visited = look(f"/vehicles/{CAR}", "vehicle", size, theme, ready=ready)
    visited.page.wait_for_selector(".lidar canvas")


def test_a_network_that_drives_shows_commands_delay_and_the_saliency_of_a_frame(
    visit, running, look_around
):
    visited = visit(f"/vehicles/{CAR}")
    page = visited.page
    assert page.locator(".network").count() == 0
    with running.joined(Network()):
        page.wait_for_selector('[data-fact="delay"] >> text=31 ms')
        page.wait_for_selector('[data-fact="inference"] >> text=4.2 ms')
        page.wait_for_selector(".commands >> text=0.50 left")
        needle = page.get_attribute(".commands .needle", "transform")
        assert needle == "rotate(-30)"  # of the clock: to the left
        page.click("text=saliency")
        page.wait_for_selector('[data-fact="saliency"] >> text=up to 0.20')
        pixel = """() => {
            const canvas = document.querySelector(".film canvas"), { width, height } = canvas;
            const at = [width / 8, (0.3 + 0.7 / 2) * height];
            const [red, , blue] = canvas.getContext("2d").getImageData(...at, 1, 1).data;
            return blue - red;
        }"""
        page.wait_for_function(f"() => ({pixel})() > 60")
        look_around(visited, ".camera", "network")
        page.click("text=saliency")
    page.wait_for_selector(".network", state="detached")


def test_the_held_wheel_looks_right_under_keys_and_under_pads(visit, running):
    visited = visit(f"/vehicles/{CAR}")
    page = visited.page
    take(visited, running)
    page.fill(".most input", "0.1")  # a crawl: it stays on its lane
    page.keyboard.down("w")
    looks_right(visited, "wheel_wide")
    page.keyboard.up("w")
    page.set_viewport_size({"width": 390, "height": 844})
    page.hover('[data-pad="back"]')
    page.mouse.down()
    looks_right(visited, "wheel_narrow")
    assert page.get_attribute('[data-pad="back"]', "data-down") == "true"
    command_age = '[data-fact="command"]:has-text("ms")'
    page.wait_for_selector(command_age)
    page.mouse.up()
    give_back(visited, running)
    page.wait_for_selector(command_age, state="detached")


def test_a_low_battery_is_told_by_sign_and_word_and_once_in_the_events(visit, running):
    with tired(running):
        visited = visit("/vehicles", "narrow", "dark")
        page = visited.page
        low = f'tr[data-car={TIRED}] .charge.%s[data-battery="low"]:has-text("low")'
        page.wait_for_selector(low % "narrow")
        photograph(visited, "battery_table_narrow_dark")
        page.set_viewport_size({"width": 1440, "height": 900})
        page.wait_for_selector(low % "wide" + ":has-text('12 %')")
        photograph(visited, "battery_table_wide_dark")
        page.click(f"tr[data-car={TIRED}] a")
        page.wait_for_selector('.who .charge[data-battery="low"] >> text=battery low')
        told = page.inner_text('[data-fact="battery"]')
        assert " ".join(told.split()) == "11.08 V, 12 % low, estimated from its voltage"
        page.set_viewport_size({"width": 390, "height": 844})
        page.wait_for_selector("text=not on the air, was reported")
        judge(visited)
        photograph(visited, "battery_narrow_dark")
        events = events_of(running, "battery_low")
        assert [event["text"] for event in events] == [f"the battery of {TIRED} is low: 12 % left"]


def test_a_car_that_pushes_in_vain_is_stuck_in_table_page_and_events(visit, running):
    with tired(running, throttle=0.4):
        visited = visit("/vehicles")
        page = visited.page
        page.wait_for_selector(f'tr[data-car={TIRED}] .mode[data-mode="stuck"] >> text=stuck')
        photograph(visited, "stuck_table")
        page.click(f"tr[data-car={TIRED}] a")
        page.wait_for_selector('.who .mode[data-mode="stuck"]')
        told = page.wait_for_selector('[data-fact="stuck"]').inner_text()
        # Others may hit it.
        assert told.startswith(("commanded to drive but does not move", "pushes against"))
        judge(visited)
        photograph(visited, "stuck")
        (event,) = events_of(running, "stuck")
        assert event["text"].startswith(f"{TIRED} is stuck: it ")


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
    wait_for(lambda: abs(speed(running)) < 0.01, 60.0, "it stands")
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
    for let_go in (by_a_shortcut, by_a_menu, by_a_field):
        visited.page.keyboard.down("w")
        visited.page.wait_for_selector('.now[data-why="driving"]')
        let_go(visited.page)
        visited.page.wait_for_selector('.now[data-why="released"]')
        visited.page.keyboard.up("w")
        visited.page.keyboard.press("Escape")
    give_back(visited, running)


def by_a_shortcut(page):
    """Let the key go while Control is held: the browser may keep that to itself."""
    page.keyboard.down("Control")
    page.keyboard.up("w")
    page.keyboard.up("Control")


def by_a_menu(page):
    """Open a context menu, which is told what becomes of the key."""
    page.dispatch_event("main", "contextmenu")


def by_a_field(page):
    """Write into a field, where the letter is one."""
    page.evaluate("""() => {
        const field = document.querySelector("main").appendChild(document.createElement("input"));
        field.focus();
        field.remove();
    }""")


def test_two_windows_share_connections_and_leave_one_for_what_is_done(visit, running):
    visited = visit(f"/vehicles/{CAR}")
    visited.page.wait_for_selector('.film[data-seen="true"]')
    second = visited.page.context.new_page()
    second.goto(f"{running.url}/vehicles/n2")
    windows, full = (visited.page, second), ".film >> text=Other windows"
    visited.until(lambda: sum(one.locator(full).count() for one in windows) == 1, "one film waits")
    for mode, is_lit in (("low", True), ("off", False)):
        second.click(f'[aria-label="Headlights {mode}"]')
        visited.until(lambda lit=is_lit: ("head_low" in row(running, "n2")["lights"]) is lit, mode)
    second.close()
    visited.page.wait_for_selector('.film .moves[data-stale="false"]')
    assert visited.complaints == []


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
    visited.page.wait_for_selector('.now[data-why="driving"] >> text=You drive, by gamepad')
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
    assert page.get_by_text("Take over", exact=True).count() == 0
    lease = running.get(f"/leases/{CAR}")
    refused = running.web.post(f"/leases/{CAR}", json={"program": "lane_keeper"})
    assert (refused.status_code, refused.json()["code"]) == (409, "owned")
    assert lease["owner"] in refused.json()["detail"]
    page.fill(".steal input", "the first one sleeps")
    page.click("text=Take over anyway")
    page.wait_for_selector('.wheel[data-state="held"]')
    first.page.wait_for_selector('.over[data-code="lost"]')
    second.page.click(".give-back")
    page.wait_for_selector('.over[data-code="given_back"]')
    send_on(running)
    drives_by_itself(running)
