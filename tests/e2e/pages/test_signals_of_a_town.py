"""The signals page of a city with two junctions, one of them with two rings and a barrier."""

import re

import pytest

from tests.e2e.pages.town import town
from tests.e2e.pages.visiting import in_each_look, judge, photograph

pytestmark = pytest.mark.e2e

RINGS = "#diagram-rings"
SAYS = f"words => document.querySelector('{RINGS}').textContent.includes(words)"


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """Market Town in lockstep, in the place of the city that the other pages look at."""
    with town("market_town", tmp_path_factory.mktemp("town")) as process:
        yield process


def read_out(page, ring):
    """Return what the pointer reads out along a ring's row, from long ago to now."""
    box = page.locator(".diagram canvas").bounding_box()
    found = set()
    for step in range(20, 64, 2):
        page.mouse.move(box["x"] + step / 100 * box["width"], box["y"] + 36 + 40 * ring)
        found.add(page.inner_text(".readout").split(":")[0])
    return found - {""}


def test_each_junction_is_chosen_and_its_rings_and_barriers_are_drawn(visit):
    visited = visit("/signals")
    page = visited.page
    page.wait_for_selector('.head[data-group="east_left"]')
    visited.wait(SAYS, "s ago, ")
    told = page.text_content(RINGS)
    assert "Ring 1: south, barrier, east. Ring 2: nobody, barrier, west, east left." in told
    times = told.partition("Barriers shown: ")[2]
    crossed_s = [int(ago) for ago in re.findall(r"(\d+) s ago", times)]
    assert 2 <= len(crossed_s) <= 4  # a cycle of 52.7 s has two, and 63 s are shown
    assert 70 > crossed_s[0] > crossed_s[1] + 5
    assert page.get_attribute(".diagram canvas", "aria-describedby") == RINGS[1:]
    assert read_out(page, 0) == {"south", "east"}
    assert read_out(page, 1) == {"west", "east left"}
    for size, theme in in_each_look(visited):
        judge(visited)
        photograph(visited, f"signals_town_{size}_{theme}")
    page.select_option("#junction", "station")
    page.wait_for_url("**/signals/station")
    page.wait_for_selector('.head[data-group="north"]')
    assert page.locator(".head").count() == 3
    visited.wait(SAYS, "Ring: east, west, north.")
    page.go_back()
    page.wait_for_selector('.head[data-group="east_left"]')
    assert page.input_value("#junction") == "market"


def test_a_stage_of_two_rings_is_edited_and_a_plan_keeps_its_offset(visit, running):
    visited = visit("/signals/market")
    page = visited.page
    page.click('[aria-label="Copy plan calm"]')
    page.wait_for_selector(".editor .why >> text=belong to the signal kernel")
    second = ".editor tbody tr:nth-child(2) .chip"
    page.check(f"{second} >> text=west")
    page.wait_for_selector(".verdict[data-state=bad] >> text=west and east left conflict")
    page.uncheck(f"{second} >> text=west")
    page.check(f"{second}:first-child >> text=east")
    page.wait_for_selector(".remark >> text=Stages 1 and 2 both have east: it stays green between")
    page.wait_for_selector('.editor .strip[aria-label*="east on into the next"] [data-on="true"]')
    page.fill("#plan-offset", "60")
    page.wait_for_selector(".verdict[data-state=bad] >> text=Offset: from 0 to less than the cycle")
    for size, theme in in_each_look(visited):
        judge(visited)
        photograph(visited, f"signals_town_editor_{size}_{theme}")
    page.goto(running.url + "/signals/station")
    page.click('[aria-label="Copy plan brisk"]')
    page.fill("#plan-name", "wave")
    page.fill("#plan-offset", "9.6")
    page.click(".editor .acts button:first-child")
    page.wait_for_selector(".verdict[data-state=good] >> text=Proven", timeout=120_000)
    page.click(".editor .acts .primary")
    page.wait_for_selector('.choices [data-plan="wave"] .cycle >> text=offset 9.6 s')
    assert running.get("/signals/station/plans/wave")["offset_s"] == 9.6
    page.click('[aria-label="Run plan wave"]')
    page.fill("dialog input[name=reason]", "in step")
    page.keyboard.press("Enter")
    page.wait_for_selector('[data-plan="wave"] .badge >> text=next')
    assert visited.complaints == []
