"""The signals page as an engineer uses it, with the real controller and monitor behind it."""

import pytest

from tests.e2e.city_process import wait_for
from tests.e2e.pages.visiting import LOOKS, SIZES, in_each_look, judge, photograph

pytestmark = pytest.mark.e2e

AT = "/signals/crossing"
READY = '.choices [data-plan="calm"]'


@pytest.mark.parametrize(("size", "theme"), LOOKS)
def test_it_looks_as_it_should(look, size, theme):
    visited = look("/signals", "signals", size, theme, READY)
    assert visited.page.locator(".head").count() == 2


def ink(page):
    """Return how many different colours the timing diagram shows."""
    return page.evaluate(
        """() => {
          const canvas = document.querySelector(".diagram canvas");
          const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
          const seen = new Set();
          for (let i = 0; i < data.length; i += 16) seen.add(data.slice(i, i + 3).join());
          return seen.size;
        }"""
    )


def test_lamps_and_diagram_show_what_the_controller_shows_and_time_runs(visit, running):
    visited = visit(AT)
    page = visited.page
    page.wait_for_selector(READY)

    def agrees():
        shown = page.evaluate(
            "() => [...document.querySelectorAll('.head')]"
            ".map((head) => [head.dataset.group, head.dataset.colour])"
        )
        told = running.get("/signals/crossing")["groups"]
        return dict(shown) == {group["group"]: group["colour"] for group in told}

    visited.until(agrees, "the lamps agree with the controller")
    lit = page.locator('.lamps i[data-lit="true"]')
    visited.until(lambda: len(lit.all_inner_texts()) == 2, "each group has one lamp lit")
    assert set(lit.all_inner_texts()) <= {"R", "Y", "G"}
    visited.until(lambda: ink(page) > 8, "the diagram is drawn")
    left = page.locator(".head .left b").all_inner_texts()
    visited.until(lambda: page.locator(".head .left b").all_inner_texts() != left, "it counts down")
    page.focus(".diagram canvas")
    before = page.inner_text(".tools output")
    page.keyboard.press("+")
    assert page.inner_text(".tools output") != before
    page.keyboard.press("ArrowLeft")
    page.wait_for_selector('.tools button[aria-label="Later"]:enabled')
    page.keyboard.press("Home")
    page.wait_for_selector('.tools button[aria-label="Later"]:disabled')
    box = page.locator(".diagram canvas").bounding_box()
    page.mouse.move(box["x"] + 0.65 * box["width"], box["y"] + box["height"] - 20)
    page.wait_for_function(
        "() => document.querySelector('.readout').textContent.includes('south west:')"
    )
    assert visited.complaints == []


def test_a_hold_is_asked_for_by_keyboard_shown_and_taken_back(visit, running):
    visited = visit(AT)
    page = visited.page
    page.wait_for_selector(READY)
    page.focus('[aria-label="hold south east"]')
    page.keyboard.press("Enter")
    page.wait_for_selector(".means >> text=up to two cycles")
    reason = "a parade " + "W" * 150
    page.keyboard.type(reason)
    page.keyboard.press("Enter")
    page.wait_for_selector('.held li[data-verb="hold"] >> text=dashboard: a parade')
    try:
        (wish,) = running.get("/signals/crossing/wishes")["items"]
        assert (wish["verb"], wish["groups"], wish["reason"]) == (
            "hold",
            ["south_east"],
            reason,
        )
        page.wait_for_selector(".pending >> text=actuated begins")
        page.wait_for_selector(".lately >> text=a parade")
        for size, _ in in_each_look(visited):
            wide = page.evaluate("() => document.documentElement.scrollWidth")
            assert wide <= SIZES[size][0]  # whatever people write
    finally:
        page.click(".held li button")
        wait_for(lambda: not running.get("/signals/crossing/wishes")["items"], 90.0, "withdrawn")
    page.wait_for_selector(".overrides .empty >> text=No override is in force")


def judged(visited, name):
    """Judge what is open on a page in both sizes and themes, and photograph it."""
    for size, theme in in_each_look(visited):
        judge(visited)
        photograph(visited, f"{name}_{size}_{theme}")


def test_a_plan_is_made_proven_saved_asked_for_and_deleted(visit, running):
    visited = visit(AT)
    page = visited.page
    page.click('[aria-label="Copy plan calm"]')
    page.fill("#plan-name", "rush")
    page.click('nav a[href="/events"]')  # who looks elsewhere comes back to what was begun
    page.click('nav a[href="/signals"]')
    page.wait_for_selector(".editor")
    assert page.input_value("#plan-name") == "rush"
    green = '[aria-label="Green of stage 1 in seconds"]'
    page.fill(green, "1")
    page.wait_for_selector(".verdict[data-state=bad] >> text=below the min green")
    prove, save = page.locator(".editor .acts button").all()
    assert prove.is_disabled()
    page.check(".editor tbody tr:first-child .chip:nth-child(2) input")
    page.wait_for_selector(".verdict[data-state=bad] >> text=conflict and cannot share it")
    judged(visited, "signals_editor_faults")
    page.uncheck(".editor tbody tr:first-child .chip:nth-child(2) input")
    page.fill(green, "14")
    assert save.is_disabled()
    prove.click()
    proven = ".verdict[data-state=good] >> text=Proven: 212 states"
    with running.paused():
        page.wait_for_selector(proven, timeout=120_000)  # the search stands back behind all else
    judged(visited, "signals_editor_proven")
    page.fill(green, "14.5")  # what is proven is not this any more
    page.wait_for_selector(".verdict >> text=The search has to prove it")
    assert save.is_disabled()
    page.fill(green, "14")
    stages = [{"groups": ["south_east"], "green_s": 14}, {"groups": ["south_west"], "green_s": 8.7}]
    rival, new = {"stages": stages, "by": "bob", "about": "his"}, {"If-None-Match": "*"}
    running.web.put(f"{AT}/plans/rush", json=rival, headers=new).raise_for_status()
    page.wait_for_selector(proven)  # the words move the button
    save.click()  # somebody was faster: nothing is lost, and nobody's work goes unseen
    page.wait_for_selector(".editor .fault >> text=bob saved rush (his)")
    assert "412" in visited.complaints.pop()
    page.click(".editor .acts >> text=Save over it")
    page.wait_for_selector('.choices [data-plan="rush"] .badge >> text=proven')
    edited = "async (now) => (await import('scm/pages/signals/plans.js')).isEdited(...now)"
    plan = {"stages": stages, "offset_s": None}
    for green_s, is_edited in ((14, False), (14.2, True)):
        runs = {"offset_s": None, "stages": [{**stages[0], "green_s": green_s}, stages[1]]}
        assert page.evaluate(edited, [plan, runs]) == is_edited
    saved = running.get("/signals/crossing/plans/rush")
    assert (saved["source"], saved["stages"][0]["green_s"], saved["usable"]) == ("saved", 14, True)
    page.click('[aria-label="Run plan rush"]')
    judged(visited, "signals_run")
    page.fill("dialog input[name=reason]", "morning")
    page.keyboard.press("Enter")
    page.wait_for_selector('[data-plan="rush"] .badge >> text=next')
    assert running.get("/signals/crossing/status")["pending"] == "rush"
    page.evaluate("() => document.querySelectorAll('.notice button').forEach((b) => b.click())")
    again = running.web.put("/signals/crossing/plan", json={"plan": "calm", "by": "test"})
    assert again.json()["pending"] == ""
    page.click('[aria-label="Delete plan rush"]')
    page.click("dialog .danger")
    page.wait_for_selector('.choices [data-plan="rush"]', state="detached")
    assert running.web.get("/signals/crossing/plans/rush").status_code == 404
    tag = running.web.put("/signals/crossing/plans/rush", json=rival, headers=new).headers["etag"]
    try:
        page.wait_for_selector('.choices [data-plan="rush"] >> text=his')  # nobody reloads for it
    finally:
        running.web.delete("/signals/crossing/plans/rush", headers={"If-Match": tag})
    assert visited.complaints == []


def test_flash_is_shown_at_once_with_its_letter_and_ended_with_a_reason(visit, running):
    visited = visit(AT)
    page = visited.page
    page.wait_for_selector(READY)

    def answer(button, reason):
        page.click(f".overrides >> text={button}")
        page.fill("dialog input[name=reason]", reason)
        page.keyboard.press("Enter")

    page.click(".overrides >> text=Flash red…")
    judged(visited, "signals_flash")
    page.keyboard.press("Escape")
    answer("Flash red…", "works on the road")
    page.wait_for_selector('.runs[data-mode="flash"]')
    try:
        assert running.get("/signals/crossing")["mode"] == "flash"
        lit = page.locator('.lamps i[data-lit="true"]')
        visited.until(lambda: lit.all_inner_texts() == ["F", "F"], "both groups flash")
        page.wait_for_selector(".runs >> text=until somebody ends it")
        page.wait_for_selector(".banner >> text=The signals of crossing flash, since")
        lately = running.get("/disturbances")["disturbances"]
        assert [one["end_ns"] for one in lately if one["kind"] == "flash"][-1] is None
        photograph(visited, "signals_disturbed")
        rule = page.locator(".head >> text=stop, look, go in turn")
        visited.until(lambda: rule.count() == 2, "both groups say what to do")
        for width in (1920, 1440, 390):  # no words run under the buttons beside them
            page.set_viewport_size({"width": width, "height": 900})
            for line in page.locator(".head p").all():
                assert line.evaluate("line => line.scrollWidth <= line.clientWidth")
    finally:
        answer("End flash…", "done")
        wait_for(lambda: running.get("/signals/crossing")["mode"] != "flash", 90.0, "it goes on")
    page.wait_for_selector('.runs:not([data-mode="flash"])')


def test_what_was_told_is_judged_and_no_promise_was_broken(visit, running):
    wait_for(lambda: running.get("/signals/crossing/promises")["judged"] >= 2, 60.0, "some ended")
    told = running.get("/signals/crossing/promises")
    assert (told["early"], told["late"]) == (0, 0)
    page = visit(AT).page
    page.wait_for_selector('.facts [data-state="good"] dd >> text=0 of')


def test_a_junction_that_is_not_there_is_said_and_the_way_back_shown(visit):
    page = visit("/signals/moon").page
    page.click("main >> text=Go to crossing")
    page.wait_for_selector(READY)
    assert page.url.endswith(AT)
