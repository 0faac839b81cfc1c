"""Page 6: reports are read, and a search runs to its report."""

import shutil
import time
from pathlib import Path

import pytest

from scm.fleet import LockstepLink
from scm.maps.load import load_map
from scm.recorder.play import play, write_recording
from scm.runtime.lockstep import Lockstep
from scm.world.part import WorldPart
from tests.e2e.city_process import wait_for
from tests.e2e.pages.made_reports import made_reports, write_fleet
from tests.e2e.pages.visiting import LOOKS, judge

SEARCH_S = 240.0  # on a busy machine
TABLE = "recording: 1\nvehicle: nigel\ntables:\n  - file: a.csv\n    time: {column: t, unit: s}\n"
CHANNELS = "    channels: {command.throttle: {column: u}, pose.x: {column: x, unit: m}}\n"


@pytest.fixture(scope="module")
def reports(running):
    """The folder of reports, with some in it."""
    with made_reports(running.folder / "reports") as folder:
        write_fleet(folder / "fleet")
        yield folder


def arcs():
    """Return rows to and fro on the spot, left and right: no wall is met."""
    sides = [(1 if k % 12 < 6 else -1, 1 if k % 24 < 12 else -1) for k in range(32)]
    return [
        (0.5 * k, 0.4 * ahead * (0.6 + 0.2 * (k % 3)), 0.9 * left)
        for k, (ahead, left) in enumerate(sides)
    ]


@pytest.fixture(scope="module")
def searching(running, reports, tmp_path_factory):
    """Send a drive of a simulated car and start a real search of it; it runs meanwhile."""
    folder = tmp_path_factory.mktemp("sent")
    with Lockstep([WorldPart(load_map("parking_school"), hosted=(("n1", "nigel"),))]) as city:
        city.run_for(0.1)
        write_recording(play(LockstepLink(city), "n1", arcs()), "nigel", folder / "drive")
    packed = shutil.make_archive(str(folder / "drive"), "zip", folder / "drive")
    sent = running.web.post("/mismatch/uploads?name=turns", content=Path(packed).read_bytes())
    body = {"upload": sent.json()["upload"], "budget_s": 5}
    answer = running.web.post("/mismatch/jobs", json=body)
    assert answer.status_code == 202, answer.text
    return answer.json()["id"]


@pytest.mark.parametrize(("size", "theme"), LOOKS)
def test_the_report_can_be_looked_at(look, reports, size, theme):
    look("/mismatch/two-effects", "mismatch", size, theme, ready="#runs svg path.band-after")


def test_the_list_finds_a_report_and_opens_it(look, reports, searching):
    page = look("/mismatch", "mismatch_list", "wide", "light", ready=".jobs progress").page
    page.route("**/operations?*", lambda route: (time.sleep(1.0), route.continue_()))
    page.reload()  # a server that takes longer than the page waits until it asks anew
    page.wait_for_selector(".jobs progress")
    page.unroute("**/operations?*")
    assert page.locator(".reports .cards > li").count() >= 3
    page.fill("input[type=search]", "healthy")
    page.wait_for_function("() => document.querySelectorAll('.reports .cards > li').length === 1")
    page.click(".reports .cards a")
    page.wait_for_selector("h1 >> text=Nothing beyond noise")
    assert page.url.endswith("/mismatch/healthy")


def test_a_report_that_time_cut_short_says_what_it_left_and_gives_no_clean_bill(visit, reports):
    visited = visit("/mismatch/hurried")
    page = visited.page
    page.wait_for_selector(".card >> text=What it does not hold was not sought to the end")
    assert "Time ran out" in page.inner_text(".head .verdict")
    assert page.get_attribute(".head", "data-verdict") == "undecided"
    judge(visited)
    page.goto(page.url.replace("/hurried", ""))
    page.wait_for_selector("li[data-verdict=undecided] a[href$='/hurried'] >> text=Time ran out")


def test_cars_of_one_search_tell_what_they_share_and_lead_to_each_other(visit, reports):
    visited = visit("/mismatch/fleet.n1")
    page = visited.page
    page.wait_for_selector(".card >> text=Nothing that the cars have in common was found.")
    judge(visited)
    page.click(".card a:has-text('n2')")
    page.wait_for_selector(".card a:has-text('n1')")
    assert page.url.endswith("/mismatch/fleet.n2")


def test_maps_and_time_line_show_the_same_moment(visit, reports):
    page = visit("/mismatch/two-effects").page
    page.locator("#when svg").hover(position={"x": 300, "y": 120})
    page.wait_for_selector("#when svg path.moment", state="attached")
    dot = page.locator("#where svg circle.moment").first
    before = dot.get_attribute("cx")
    page.focus("input[aria-label='Moment of the recording']")
    for _ in range(30):
        page.keyboard.press("ArrowRight")
    assert dot.get_attribute("cx") != before
    told = page.inner_text("p.moment")
    assert " s at x " in told
    assert "yaw moment" in told
    page.locator("#where svg").first.hover(position={"x": 100, "y": 100})
    assert page.inner_text("p.moment") != told
    page.check("#show-after")
    assert page.locator("#where .side-after").first.is_visible()
    assert not page.locator("#where .side-before").first.is_visible()


def test_alternatives_and_files_can_be_read(visit, reports, running):
    visited = visit("/mismatch/two-effects")
    page = visited.page
    page.wait_for_selector("#tried >> text=The error does not grow with time.")
    page.click("nav a:has-text('free runs')")
    assert page.url.endswith("/mismatch/two-effects")
    with page.expect_download() as saved:
        page.click("a.button:has-text('report.json')")
    assert saved.value.suggested_filename == "two-effects-report.json"
    judge(visited)


def test_a_report_that_is_not_there_is_said(visit, reports):
    visited = visit("/mismatch/nothing-here")
    visited.page.wait_for_selector("[role=alert] >> text=nothing-here")


def test_a_recording_of_ones_own_is_sent_and_searched(visit, reports, running, tmp_path):
    folder = tmp_path / "short drive"
    folder.mkdir()
    (folder / "recording.yaml").write_text(TABLE + CHANNELS, "utf-8")
    (folder / "a.csv").write_text("t,u,x\n0,0,0\n1,0.1,0.1\n2,0.1,0.2\n", "utf-8")
    visited = visit("/mismatch")
    page = visited.page
    page.click("button:has-text('My own recording')")
    page.set_input_files("input[name=folder]", str(folder))
    page.fill("input[name=vehicle]", "n 1")
    page.click(".start .primary")
    page.wait_for_selector("input[name=vehicle]:focus:invalid")
    page.fill("input[name=vehicle]", "")
    page.click(".start .primary")
    page.wait_for_selector(".jobs li:has-text('short-drive')")

    def report():
        rows = running.get("/mismatch/reports")["items"]
        return next((row for row in rows if row["name"].startswith("short-drive")), None)

    with running.paused():
        row = wait_for(report, SEARCH_S, "the report of what was sent", every_s=0.5)
    assert "does not allow a verdict" in row["said"]
    page.click(f".reports a[href='/mismatch/{row['name']}']")
    page.wait_for_selector(".head >> text=No verdict")
    page.click("button:has-text('Remove this report')")
    page.click("dialog .danger")
    visited.until(lambda: report() is None, "the report is removed")
    assert visited.complaints == []


def test_a_real_search_ends_in_a_report_that_can_be_read(visit, reports, running, searching):
    def ended():
        row = running.get(f"/operations/{searching}")
        return row if row["state"] not in ("waiting", "running") else None

    with running.paused():
        row = wait_for(ended, SEARCH_S, "the search ends", every_s=0.5)
    assert row["state"] == "done", row
    assert row["result"].startswith("/mismatch/turns-")
    page = visit(row["result"]).page
    page.wait_for_selector(".sheet h1")
    page.wait_for_selector("#runs svg path.band-after")
    assert "nigel" in page.inner_text(".head .facts")
