"""A drive that a report asks for, played by a car of a real city."""

import pytest

from tests.e2e.pages.made_reports import made_reports
from tests.e2e.pages.visiting import judge


@pytest.fixture(scope="module")
def running(live_city):
    """The city as a user starts it: a program drives its car over the bus."""
    return live_city


@pytest.fixture(scope="module")
def reports(running):
    """The folder of reports, one of which asks for a drive."""
    with made_reports(running.folder / "reports", "undecided") as folder:
        yield folder


def owner_of(running, vehicle):
    rows = {row["vehicle"]: row["owner"] for row in running.get("/vehicles")["vehicles"]}
    return rows[vehicle]


def test_a_suggested_drive_is_sent_to_a_car_and_stopped(visit, reports, running):
    visited = visit("/mismatch/undecided")
    page = visited.page
    page.wait_for_selector(".drive select")
    asked = page.locator(".panel.question h2").all_inner_texts()
    assert [text.removeprefix("Undecided").strip() for text in asked] == [
        "Motor gain or payload?", "Motor gain or aero drag?",
    ]  # fmt: skip
    page.wait_for_selector(".card.question dd code:text-is('scm play')")
    page.select_option(".drive select", "n2")
    page.click("button:has-text('Drive this with n2')")
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    assert owner_of(running, "n2") == "world"
    page.click("button:has-text('Drive this with n2')")
    page.click("dialog .primary")
    visited.until(lambda: owner_of(running, "n2") == "script", "the drive has the car")
    judge(visited)
    page.click("button:has-text('Stop the drive')")
    visited.until(lambda: owner_of(running, "n2") == "world", "the car is given back")
    page.wait_for_selector(".driving >> text=The drive was stopped.")
    rows = running.get("/vehicles")["vehicles"]
    assert next(row for row in rows if row["vehicle"] == "n2")["trip"], "it goes on"
    assert running.get("/mismatch/reports/undecided")["told"] == 0


def test_a_drive_that_leads_off_the_floor_is_refused_in_words(visit, reports, running):
    way = reports / "undecided" / "next_drive" / "next_drive_way.csv"
    way.write_text("t_s,x_m,y_m,yaw_rad\n0,0,0,0\n40,50,0,0\n", "utf-8")
    page = visit("/mismatch/undecided").page
    page.wait_for_selector(".drive .warn >> text=off the floor")
    page.click("button:has-text('Drive this with')")
    page.click("dialog .primary")
    page.wait_for_selector(".driving[data-state=failed] >> text=expected room for all of it")
