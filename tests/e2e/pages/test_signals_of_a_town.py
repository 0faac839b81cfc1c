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


COMING = """async ([turns, told]) => {
  const { comingOf } = await import("scm/pages/signals/diagram_paint.js");
  const greens = comingOf({ turns }, { fresh: true, mode: "plan", ...told }, { now: 100 });
  return greens.map(({ group, start, end }) => [group, start, end]);
}"""
DRAWN = """() => {
  const canvas = document.querySelector(".diagram canvas");
  const ratio = canvas.width / canvas.clientWidth;
  const [rings, phases] = [22 + 2 * 36, 22 + 2 * 56 + 12].map((px) => Math.round(ratio * px));
  const now = Math.round(ratio * (116 + 0.7 * (canvas.clientWidth - 120)));
  const paper = canvas.getContext("2d");
  const greenish = (top, height) => {
    const { data } = paper.getImageData(now + 4, top, canvas.width - now - 4, height);
    let found = 0;
    for (let i = 0; i < data.length; i += 4) {
      found += data[i + 1] > data[i] + 20 && data[i + 1] > data[i + 2] + 20;
    }
    return found;
  };
  return [greenish(0, rings), greenish(phases, canvas.height - phases)];  // rows of 36 to 56 px
}"""


def turn(groups, start_s, end_s):
    end_ns = None if end_s is None else end_s * 1e9
    return {"groups": groups, "start_ns": start_s * 1e9, "end_ns": end_ns}


def test_greens_to_come_are_drawn_and_their_barriers_told(visit):
    visited = visit("/signals/market")
    page = visited.page
    page.wait_for_selector('.head[data-group="east_left"]')
    visited.wait(
        f"() => /Barriers shown:.* in \\d+ s/.test(document.querySelector('{RINGS}').textContent)"
    )
    crossed = page.text_content(RINGS).partition("Barriers shown: ")[2]
    assert min(int(s) for s in re.findall(r"in (\d+) s", crossed)) <= 27  # that much is shown
    visited.until(lambda: min(page.evaluate(DRAWN)) > 200, "in the rows of rings and of phases")


def test_a_green_to_come_is_one_through_turns_that_follow_each_other(visit):
    page = visit("/signals/market").page
    lit = {"groups": [{"group": "south", "colour": "green"}, {"group": "east", "colour": "red"}]}
    turns = [
        turn(["south"], 90, 110),
        turn(["east", "west"], 113, 120),
        turn(["east", "left"], 120, 130),
        turn(["south"], 133, None),
    ]
    assert page.evaluate(COMING, [turns, lit]) == [
        ["south", 100, 110],  # it is green: from now on
        ["east", 113, 130],
        ["west", 113, 120],
        ["left", 120, 130],
        ["south", 133, None],
    ]
    assert page.evaluate(COMING, [[turn(["east"], 80, 99)], lit]) == []  # is over
    assert page.evaluate(COMING, [turns, {**lit, "mode": "flash"}]) == []
    assert page.evaluate(COMING, [turns, {**lit, "fresh": False}]) == []


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
