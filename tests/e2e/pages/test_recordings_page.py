"""The recordings page: drives of the real city seen again, taken home, noted; scripts; studies."""

import csv
import os
import re
import shutil

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader

from scm.recorder.recover import recover
from scm.recorder.run_index import read_index
from scm.study.page import study_page
from scm.study.results import create_results
from scm.study.run import run_study
from tests.e2e.city_process import wait_for
from tests.e2e.pages.visiting import LOOKS, SIZES, THEMES, Visit, in_each_look, judge, photograph
from tests.unit.recorder.short_run import STUCK_S, write_run
from tests.unit.study.studying import Here, loaded

NAME = "morning_drive"
AT = f"/recordings/{NAME}"
DRIVEN_S = 12.0
PART, TABLE = 'dialog form[name="part"]', 'dialog form[name="table"]'
READY = '.sheet[data-shown="cars"]'
ALL_SHOWN = "() => document.querySelectorAll('.cars tbody tr').length === 6"
IN_REACH = """words => {
  const button = [...document.querySelectorAll("dialog[open] .notice")]
    .find((notice) => notice.textContent.includes(words))
    ?.querySelector("button");
  const box = button?.getBoundingClientRect();
  return box && document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2) === button;
}"""
SCRIPT = '"""Say a word."""\nimport time\nprint("a word", flush=True)\ntime.sleep(60)\n'


def judge_everywhere(visited, name):
    """Judge and photograph a page in every size and theme; it is left wide and light."""
    for size in reversed(SIZES):
        width, height = SIZES[size]
        visited.page.set_viewport_size({"width": width, "height": height})
        for theme in reversed(THEMES):
            visited.page.emulate_media(color_scheme=theme)
            visited.page.wait_for_selector(f':root[data-theme="{theme}"]')
            judge(visited)
            photograph(visited, f"{name}_{size}_{theme}")


@pytest.fixture(scope="module")
def drive(running, tmp_path_factory):
    """Keep what was recorded so far, with six cars in it, as a recording of its own."""
    (live,) = (row["name"] for row in running.get("/recordings")["items"])

    def is_long():
        summary = running.get(f"/recordings/{live}/summary")
        length_s = summary["recording"]["length_s"] - summary["first_frame_s"]
        is_pictured = bool(summary["eye_cameras"])  # a busy machine has few pictures
        return len(summary["cars"]) == 6 and length_s > DRIVEN_S and is_pictured

    wait_for(is_long, 90.0, "six cars have driven for a while, and were pictured")
    path = running.folder / f"{NAME}.mcap"
    so_far = tmp_path_factory.mktemp("copy") / "so_far.mcap"  # the file itself grows meanwhile
    shutil.copyfile(running.folder / f"{live}.mcap", so_far)
    recover(so_far, path)
    yield running.get(f"/recordings/{NAME}/summary")
    path.unlink(missing_ok=True)


@pytest.fixture
def last_s(drive):
    """A moment near the end, when all cars drive."""
    return round(drive["recording"]["length_s"] - 3.0, 1)


@pytest.mark.parametrize(("size", "theme"), LOOKS)
def test_a_replay_is_calm_accessible_and_fits(look, last_s, size, theme):
    visited = look(f"{AT}?t={last_s}", "recordings", size, theme, ready=READY)
    visited.wait(ALL_SHOWN)
    assert visited.page.locator(".not-live").inner_text().upper().startswith("NOT LIVE")
    assert visited.page.title() == f"NOT LIVE · {NAME}"


def test_the_title_says_not_live_however_late_the_city_is_told(visit, running, drive):
    page = visit("/recordings").page
    late = []
    page.route("**/api/v1/map", lambda asked: late.append(asked))  # noqa: PLW0108
    page.goto(running.url + AT)
    page.wait_for_selector(".not-live")
    assert late
    page.unroute("**/api/v1/map")  # lets them go on
    page.wait_for_selector("h1 >> text=Driving School")
    page.wait_for_timeout(100)  # two effects that write the title would run one after the other
    assert page.title() == f"NOT LIVE · {NAME}"
    page.click("nav a:has-text('Recordings')")
    page.wait_for_selector("tbody tr")
    assert page.title() == "Recordings · Driving School"


def test_the_list_tells_what_is_written_and_opens_a_replay_that_leaves_no_trace(
    visit, running, drive
):
    bad, half = running.folder / "bad.mcap", running.folder / "half.mcap"
    bad.write_bytes(b"no recording")
    whole = (running.folder / f"{NAME}.mcap").read_bytes()
    half.write_bytes(whole[: len(whole) // 2])
    os.utime(half, (0.0, 0.0))  # nobody writes to it any more
    visited = visit("/recordings", "narrow", "dark")
    page = visited.page
    try:
        page.wait_for_selector('tr[data-state="unreadable"] >> text=an MCAP file begins otherwise')
        why = page.locator('tr[data-recording="half"][data-state="cut off"] .why')
        assert "`" not in why.inner_text()
        assert why.locator("code").inner_text() == "scm recover half.mcap"
        judge_everywhere(visited, "recordings_list")
    finally:
        bad.unlink()
        half.unlink()
    page.wait_for_selector('tr[data-state="being written"]')
    page.click(f'tr[data-recording="{NAME}"] a')
    page.wait_for_selector(".not-live")
    page.go_back()
    page.wait_for_selector("tbody tr")
    assert not page.title().startswith("NOT LIVE")
    assert visited.complaints == []


def test_cars_stand_where_the_recording_has_them(visit, running, drive, last_s):
    page = visit(f"{AT}?t={last_s}").page
    page.wait_for_function(ALL_SHOWN)
    shown = {
        row.get_attribute("data-car"): float(row.locator(".number").inner_text().split()[0])
        for row in page.locator(".cars tbody tr").all()
    }
    path = f"/recordings/{NAME}/frames?from_s={last_s - 0.15:.2f}&to_s={last_s}"
    told = running.get(path)
    cars = {told["cars"][car[0]]["vehicle"]: car[4] for car in told["frames"][-1]["cars"]}
    assert set(shown) == set(cars)
    for name, speed_mps in cars.items():
        assert shown[name] == pytest.approx(speed_mps, abs=0.15)


def test_the_picture_is_the_newest_that_the_eye_had_by_then(visit, running, drive):
    end_s = drive["recording"]["length_s"]  # it was kept when there was one
    visited = visit(f"{AT}?t={end_s}")
    page = visited.page
    told = running.get(f"/recordings/{NAME}/frames?from_s={end_s}&to_s={end_s}")["pictures"]
    page.wait_for_selector(".seen[data-at]")
    shown_s = float(page.get_attribute(".seen", "data-at"))
    assert shown_s == max(picture["t_s"] for picture in told)
    assert page.evaluate("document.querySelector('.seen img').naturalWidth") == 1280
    assert page.locator(".seen .stamp").inner_text().upper() == "NOT LIVE"
    page.click(".seen")
    page.wait_for_selector(".seen.large")
    judge(visited)
    page.keyboard.press("Escape")
    page.wait_for_selector(".seen:not(.large)")
    page.locator("input[type=range]").fill("0")
    page.wait_for_selector("text=No picture was recorded by then")


def jpeg(width_px):
    return cv2.imencode(".jpg", np.full((width_px * 9 // 16, width_px, 3), 90, np.uint8))[
        1
    ].tobytes()


def test_a_cars_own_camera_is_shown_where_it_was_recorded(visit, running):
    path = running.folder / "with_cameras.mcap"
    write_run(path, picture=jpeg(640), of_n1={2.0: jpeg(160), 4.0: jpeg(320)})
    visited = visit("/recordings/with_cameras?t=4.5")
    page = visited.page

    def shown(width_px, hint):
        wide = f"document.querySelector('.seen[data-at] img')?.naturalWidth === {width_px}"
        page.wait_for_function(f"() => {wide}")
        page.wait_for_selector(f".eye-then .hint >> text=Recorded at {hint}")

    try:
        shown(640, "0:03")
        page.select_option(".eye-then select", label="n1, front")
        shown(320, "0:04")
        judge(visited)
        page.locator("input[type=range]").fill("3.9")
        shown(160, "0:02")
        page.select_option(".eye-then select", label="overhead")
        shown(640, "0:03")
        page.click('tr[data-car="n1"] button')
        shown(160, "0:02")
        page.locator("input[type=range]").fill("1")
        page.wait_for_selector("text=No picture was recorded by then")
        assert visited.complaints == []
    finally:
        path.unlink()


def test_a_car_that_was_stuck_is_called_so_as_on_the_live_pages(visit, running):
    path = running.folder / "with_a_stuck_car.mcap"
    write_run(path, picture=jpeg(64))
    try:
        page = visit(f"/recordings/with_a_stuck_car?t={STUCK_S + 0.5}").page
        page.wait_for_selector('tr[data-car="n1"] .mode[title="pushes against n10"] >> text=stuck')
        assert page.inner_text('tr[data-car="n10"] .mode') == "drive"
        page.locator("input[type=range]").fill(f"{STUCK_S - 0.5}")
        page.wait_for_selector('tr[data-car="n1"] .mode >> text=drive')
    finally:
        path.unlink()


def test_it_plays_pauses_steps_and_jumps_by_mouse_and_keyboard(visit, drive, last_s):
    visited = visit(f"{AT}?t={last_s}")
    page = visited.page
    page.wait_for_selector(READY)
    slider = page.locator("input[type=range]")

    def at_s():
        return float(slider.input_value())

    page.click(".play")
    visited.until(lambda: at_s() > last_s + 0.5, "it plays")
    page.keyboard.press("l")
    page.wait_for_selector('.loop[aria-pressed="true"]')
    visited.until(lambda: at_s() < last_s - 1.0, "it begins again")
    page.click(".play")
    page.wait_for_selector('.play[aria-pressed="false"]')
    page.keyboard.press("End")
    visited.until(lambda: at_s() > last_s + 2.0, "the end is shown")
    page.keyboard.press("ArrowLeft")
    visited.until(lambda: at_s() < last_s + 2.4, "a second back")
    page.keyboard.press("+")
    assert page.locator(".buttons select").input_value() == "2"
    page.click(".events li button >> nth=0")
    first = drive["first_frame_s"]
    visited.until(lambda: at_s() < first + 3.0, "the first event is shown")
    slider.fill(str(last_s))
    visited.until(lambda: page.evaluate(ALL_SHOWN), "the slider leads where it is put")
    assert visited.complaints == []


def test_a_pause_of_a_day_is_skipped_and_the_page_says_so(visit, running, drive):
    path = write_run(running.folder / "paused.mcap", pause_s=86_400.0)
    visited = visit("/recordings/paused?t=10")
    page = visited.page
    page.click(".play")
    page.wait_for_selector("[role=status] >> text=Skipped 23 h 59 min 52 s")
    page.wait_for_selector(READY)  # what comes next is there
    said = page.locator("[role=status]", has_text="Skipped")
    assert said.is_visible()
    photograph(visited, "recordings_pause_skipped")
    page.locator("input[type=range]").fill("1")
    said.wait_for(state="detached")
    path.unlink()
    assert visited.complaints == []


def test_a_recording_that_is_being_written_grows_while_it_is_looked_at(visit, running):
    rows = running.get("/recordings")["items"]
    live = next(row["name"] for row in rows if row["state"] == "being written")
    visited = visit(f"/recordings/{live}")
    slider = visited.page.locator("input[type=range]")
    before = float(slider.get_attribute("max"))
    visited.until(lambda: float(slider.get_attribute("max")) > before, "it grows")


def test_files_to_take_home_hold_what_was_recorded(visit, drive, tmp_path):
    visited = visit(AT)
    page = visited.page
    page.click("text=Download")
    page.wait_for_selector("dialog .files")
    judge(visited)
    with page.expect_download() as waiting:
        page.click(f"text={NAME}.mcap")
    waiting.value.save_as(tmp_path / "run.mcap")
    assert read_index(tmp_path / "run.mcap").whole
    page.select_option("dialog select", "n2")
    with page.expect_download() as waiting:
        page.click("dialog button >> text=n2.csv")
    waiting.value.save_as(tmp_path / "n2.csv")
    assert len((tmp_path / "n2.csv").read_text().splitlines()) > 20 * DRIVEN_S
    with page.expect_download() as waiting:
        page.click(f"text={NAME}.foxglove.mcap")
    waiting.value.save_as(tmp_path / "fox.mcap")
    with (tmp_path / "fox.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    assert {"/tf", "/cars", "/map", "/signals", "/n1/state"} <= topics


def test_a_table_of_a_span_is_taken_home_and_what_is_wrong_with_it_is_said(
    visit, drive, last_s, tmp_path
):
    visited = visit(f"{AT}?t={last_s}")
    page = visited.page
    page.wait_for_function(ALL_SHOWN)
    page.click("text=Download")
    page.select_option("dialog select", "n2")
    page.focus(f"{TABLE} input[name=start]")
    page.keyboard.type(f"{last_s - 1.5:.1f}")
    page.click(f"{TABLE} .with-button button >> nth=1")
    with page.expect_download() as waiting:
        page.keyboard.press("Shift+Tab")
        page.keyboard.press("Enter")  # in the field: the form is sent
    assert re.fullmatch(rf"{NAME}-n2-[\d.]+-[\d.]+s\.csv", waiting.value.suggested_filename)
    waiting.value.save_as(tmp_path / "n2.csv")
    with (tmp_path / "n2.csv").open() as stream:
        times_s = [float(row["t_s"]) for row in csv.DictReader(stream)]
    assert last_s - 1.5 <= times_s[0] < times_s[-1] <= last_s

    page.fill(f"{TABLE} input[name=stop]", "0.5")
    page.keyboard.press("Enter")
    page.wait_for_selector("input[name=stop]:focus:invalid")
    told = page.evaluate("document.forms.table.stop.validationMessage")
    assert told == f"It has to end after {last_s - 1.5:g} s, where it begins."
    page.fill(f"{TABLE} input[name=start]", "0")
    page.fill(f"{TABLE} input[name=stop]", "0.000001")
    page.keyboard.press("Enter")
    page.wait_for_selector("dialog [role=alert] >> text=no row of n2 from 0 s to 1e-06 s")
    assert len(visited.complaints) == 1  # the browser's own, of the answer 404
    visited.complaints.clear()
    for size, theme in in_each_look(visited):
        judge(visited)
        photograph(visited, f"recordings_download_{size}_{theme}")


def test_a_part_is_cut_out_and_opened(visit, running, drive, last_s):
    visited = visit(f"{AT}?t={last_s}")
    page = visited.page
    page.wait_for_function(ALL_SHOWN)
    page.click("text=Download")
    begin_s, end_s = (round(last_s - before_s, 1) for before_s in (5.0, 0.0))
    name = f"{NAME}-{begin_s:g}-{end_s:g}s"
    page.fill(f"{PART} input[name=start]", f"{begin_s:g}")
    page.fill(f"{PART} input[name=stop]", f"{end_s:g}")
    page.click(f"{PART} >> text=Cut")
    with running.paused():
        visited.until(lambda: page.url.endswith(name), "the part is opened")
    page.wait_for_function(ALL_SHOWN)
    part = running.get(f"/recordings/{name}")
    assert part["length_s"] == pytest.approx(5.0, abs=0.5)
    running.web.delete(f"/recordings/{name}").raise_for_status()


def test_a_mismatch_job_is_asked_for_the_car_and_the_span_that_are_shown(
    visit, running, drive, last_s
):
    visited = visit(f"{AT}?t={last_s}")
    page = visited.page
    page.wait_for_function(ALL_SHOWN)
    page.click('tr[data-car="n2"] button')
    page.click("text=Mismatch job")
    page.click("dialog .with-button button >> nth=1")
    judge(visited)
    with page.expect_request("**/mismatch/jobs") as asked:
        page.click("dialog .primary")
    assert asked.value.post_data_json == {
        "recording": NAME,
        "vehicle": "n2",
        "car": "",
        "budget_s": 1800,
        "from_s": None,
        "to_s": last_s,
    }
    started = f"/operations/{asked.value.response().json()['id']}"
    running.web.delete(started).raise_for_status()  # half an hour's work for those who come next
    visited.until(lambda: running.get(started)["state"] == "cancelled", "it is called off")


def test_a_refusal_is_said_within_the_dialog_that_asked(visit, drive):
    visited = visit(AT)
    page = visited.page
    stale = {"recordings": [], "cars": ["no_such_car"], "most_upload_bytes": 1}  # removed since
    page.route("**/mismatch/offers", lambda route: route.fulfill(json=stale))
    page.click("text=Mismatch job")
    page.select_option("dialog select[name=car]", "no_such_car")
    page.click("dialog .primary")
    visited.wait(IN_REACH, "there is no car file named 'no_such_car'")
    assert len(visited.complaints) == 1  # the browser's own, of the answer 404
    assert page.locator("dialog[open]").count() == 1
    page.unroute("**/mismatch/offers")


def test_a_name_and_notes_stay_and_a_deleted_recording_goes(visit, running, drive):
    other = "to_be_deleted"
    source = running.folder / f"{NAME}.mcap"
    (running.folder / f"{other}.mcap").write_bytes(source.read_bytes())
    visited = visit(f"/recordings/{other}")
    page = visited.page
    page.click("text=Name and notes")
    page.fill("dialog input", "Rush hour")
    page.fill("dialog textarea", "n3 was pushed")
    page.click("dialog .primary")
    page.wait_for_selector(".about h2 >> text=Rush hour")
    assert running.get(f"/recordings/{other}")["notes"] == "n3 was pushed"
    page.click(".tools >> text=Delete")
    page.click("dialog .danger")
    page.wait_for_selector(f'tr[data-recording="{NAME}"]')
    assert not (running.folder / f"{other}.mcap").exists()
    assert visited.complaints == []


def test_a_recording_that_cannot_be_read_says_so(visit, running):
    bad = running.folder / "bad.mcap"
    bad.write_bytes(b"no recording")
    page = visit("/recordings/bad").page
    page.wait_for_selector("[role=alert] >> text=an MCAP file begins otherwise")
    os.utime(bad, (0, 0))  # nobody writes to it
    page.click("[role=alert] button:has-text('Delete')")
    page.click("dialog .danger")
    page.wait_for_selector("tr[data-recording]")
    assert not bad.exists()


def test_of_too_many_cars_for_one_answer_fewer_pictures_a_second_are_read(visit, drive):
    page = visit("/events").page
    asked = []

    def cut(route):
        answer = route.fetch()
        body = answer.json()
        asked.append((body["from_s"], body["hz"]))
        short = {"to_s": body["from_s"] + 3.0} if body["hz"] > 2.5 else {}
        route.fulfill(response=answer, json={**body, **short})

    page.route("**/frames?*", cut)
    page.goto(page.url.replace("/events", AT))
    page.wait_for_selector(READY)
    page.click("button.play")
    page.wait_for_timeout(500)
    page.unroute_all(behavior="wait")
    assert [hz for from_s, hz in asked if from_s == asked[0][0]] == [10.0, 5.0, 2.5]
    assert len(set(asked)) == len(asked)


def test_a_script_is_written_run_watched_and_stopped(visit, running):
    visited = visit("/recordings/scenarios")
    page = visited.page
    page.click(".scripts >> text=New")
    page.fill("dialog input", "say_a_word")
    page.click("dialog .primary")
    page.wait_for_selector("h2 >> text=say_a_word.py")
    page.fill(".code", SCRIPT)
    page.click(".script .tools >> text=Save >> nth=-1")
    page.wait_for_selector(".run button:not([disabled])")
    page.click(".run button")
    page.wait_for_selector("pre >> text=a word")
    judge_everywhere(visited, "scenarios")
    page.click(".runs >> text=Stop")
    page.wait_for_selector('.runs [data-state="cancelled"]')
    page.click(".script .tools >> text=Delete")
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    page.click(".script .tools >> text=Delete")
    page.click("dialog .danger")
    visited.until(
        lambda: all(row["shipped"] for row in running.get("/scenarios")["items"]), "it is deleted"
    )
    page.click(".scripts >> text=watch_city")
    visited.until(
        lambda: page.input_value(".run input") == f"--url {page.evaluate('location.origin')}",
        "it is offered this very city",
    )
    assert visited.complaints == []


def test_studies_are_listed_as_they_run_and_open_their_pages(visit, running, tmp_path):
    visited = visit("/recordings/studies")
    page = visited.page
    page.wait_for_selector(".studies .empty >> text=No study was run yet. scm study run FILE")
    studies = running.folder / "studies"
    study = loaded(tmp_path, factors="b = { uniform = [0.0, 3.0] }", more="samples = 20")
    whole = create_results(study, studies / "adding", [])
    run_study(whole, Here(study), lambda _: None)
    (studies / "adding" / "study.html").write_text(study_page(whole))
    half = create_results(study, studies / "adding-half", [])
    with pytest.raises(KeyboardInterrupt):
        run_study(half, Here(study, most=100), lambda _: None)
    half.write()
    (studies / "not_a_study").mkdir()
    try:
        page.wait_for_selector('tr[data-state="complete"] >> text=240 of 240')  # it is read again
        page.wait_for_selector('tr[data-state="unreadable"] >> text=with study.toml')
        running_row = page.locator('tr[data-study="adding-half"][data-state="running"]')
        assert running_row.locator("progress").evaluate("bar => bar.position") == 100 / 240
        judge_everywhere(visited, "studies")
        with page.context.expect_page() as opened:
            page.focus('tr[data-study="adding"] a')
            page.keyboard.press("Enter")
        shown = Visit(opened.value)
        shown.page.reload()  # from now on it is seen what it complains of
        shown.page.wait_for_selector("h1 >> text=Adding")
        assert shown.page.locator("figure svg").first.is_visible()
        for size, theme in LOOKS:
            width, height = SIZES[size]
            shown.page.set_viewport_size({"width": width, "height": height})
            shown.page.emulate_media(color_scheme=theme)
            assert shown.page.locator("main").bounding_box()["width"] <= width
            photograph(shown, f"study_{size}_{theme}")
        assert shown.complaints == []  # no script runs there: axe cannot look at it
        opened.value.close()
        half.add(study.run(0))
        half.write()
        running_row.locator("text=101 of 240").wait_for()
    finally:
        shutil.rmtree(studies)
    page.wait_for_selector(".studies .empty")
