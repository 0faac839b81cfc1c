"""The Eye's page as people use it: live picture, residuals, a calibration from end to end."""

import re
import tomllib

import cv2
import numpy as np
import pytest

from scm.eye.camera import camera_model
from scm.maps.load import load_map
from tests.e2e.pages.visiting import LOOKS

NUMBERS = ".eye-numbers tbody tr >> nth=1"
MEASURING_MS = 200_000  # a program of its own that counts: seconds, unless others count too
COLUMNS, ROWS, SQUARE_M, CELL_PX = 9, 6, 0.1, 40


@pytest.mark.parametrize(("size", "theme"), LOOKS)
def test_the_page_shows_picture_tags_and_residuals(look, size, theme):
    page = look("/eye", "eye", size, theme, ready=NUMBERS).page
    page.wait_for_selector("canvas.picture[data-frame]")
    assert page.locator(".eye-tags tbody tr").count() >= 2


def test_a_person_zooms_picks_a_tag_and_a_car(visit, running):
    page = visit("/eye").page
    page.wait_for_selector("canvas.picture[data-frame]")
    page.focus("canvas.picture")
    page.keyboard.press("+")
    page.wait_for_selector('canvas.picture[data-zoom="1.50"]')
    page.click("text=Whole picture")
    page.wait_for_selector('canvas.picture[data-zoom="1.00"]')
    page.uncheck("label:has-text('Outline') input")
    page.click(".eye-tags tr[data-tag='0'] button")
    page.wait_for_selector(".eye-tags tr.chosen[data-tag='0']")
    name = page.inner_text(".eye-numbers tbody tr >> nth=1 >> button")
    all_arrows = "() => Number(document.querySelector('.sheet canvas').dataset.arrows)"
    before = page.evaluate(all_arrows)
    page.click(f".eye-numbers button:text-is('{name}')")
    page.wait_for_function(f"() => ({all_arrows})() < {max(before, 1)}")
    told = running.get(f"/eye/cameras/overhead/residuals?vehicle={name}")
    assert [one["vehicle"] for one in told["vehicles"]] == [name]


def test_the_place_of_the_camera_is_found_put_in_force_and_put_back(visit, running, look_around):
    visited = visit("/eye/calibrate")
    page = visited.page
    typed(page, "text=Add a floor tag", {"x [m]": "-0.5", "yaw [rad]": "-1.5708", "edge [m]": ""})
    page.click("text=Find the place")
    page.wait_for_selector("input:focus:invalid")
    page.reload()
    page.wait_for_selector("input[aria-label='Tag 1: x [m]']")
    assert page.input_value("input[aria-label='Tag 1: x [m]']") == "-0.5"
    page.click("[aria-label='Remove tag 1']")
    page.click("text=Find the place")
    page.wait_for_selector(".eye-place progress")
    page.reload()  # whoever comes back finds it where it is
    page.wait_for_selector(".eye-place .result table", timeout=MEASURING_MS)
    (row,) = running.get("/eye/calibrations")["items"]
    assert (row["kind"], row["camera"]) == ("place", "overhead")
    found = tomllib.loads(running.get(f"/eye/calibrations/{row['name']}")["toml"])["cameras"][0]
    truth = load_map("driving_school").cameras[0]
    assert abs(found["z_m"] - truth.z_m) < 0.3
    page.click(".eye-place >> text=Put it in force")
    look_around(visited, "dialog", "eye_question")
    page.fill("dialog input[name=reason]", "tried by a test")
    page.click("dialog .primary")
    page.wait_for_selector("dialog [role=alert]:has-text('would flag them as unsure')")
    assert len(visited.complaints) == 1  # the browser's own, of the answer 409
    visited.complaints.clear()
    page.fill("dialog input[name=meant]", "another")
    page.click("dialog .danger")
    page.wait_for_selector("dialog input[name=meant]:invalid")
    page.fill("dialog input[name=meant]", "overhead")
    page.click("dialog .danger")
    page.wait_for_selector(f".bar .in-force b:text-is('place {row['name']}')")
    page.wait_for_selector(".eye-calibrations td .good:text-is('in force')")
    told = running.get("/eye/cameras/overhead")["state"]["in_force"]
    assert (told["by"], told["reason"]) == ("dashboard", "tried by a test")
    (deed,) = running.get("/audit?kind=CalibrationRequest")["items"]
    assert (deed["station"], deed["request"]["calibration"]) == ("eye", row["name"])
    assert running.get("/events?text=tried+by+a+test")["items"]
    look_around(visited, ".eye-calibrations", "eye_in_force")
    page.click("text=Put back…")
    page.fill("dialog input[name=reason]", "the test is over")
    back = {"by": "ada", "reason": "she was quicker"}
    running.web.post("/eye/cameras/overhead/calibration/back", json=back).raise_for_status()
    page.wait_for_selector("dialog", state="detached")
    page.wait_for_selector(".bar .in-force b:text-is('as started')")
    page.click(f"button[aria-label='Throw {row['name']} away']")
    page.click("dialog .danger")
    visited.until(lambda: not running.get("/eye/calibrations")["items"], "the shelf is empty")
    assert visited.complaints == []


def test_a_lens_is_measured_from_uploaded_pictures(visit, running, tmp_path, look_around):
    camera = load_map("driving_school").cameras[0]
    paths = drawn(camera, tmp_path)
    visited = visit("/eye/calibrate")
    page = visited.page
    page.fill("input[name=square_mm]", "")
    page.type("input[name=square_mm]", f"{1000 * SQUARE_M:.2f}")
    assert page.input_value("input[name=square_mm]") == "100.00"
    page.set_input_files("input[type=file]", [str(path) for path in paths])
    all_found = f".eye-lens .facts:has-text('{len(paths)} of {len(paths)} pictures')"
    with running.paused():
        page.wait_for_selector(all_found, timeout=MEASURING_MS)
        page.wait_for_selector(".coverage canvas[data-percent]")
        page.click("text=Measure the lens")
        page.wait_for_selector(".eye-lens .result dl", timeout=MEASURING_MS)
    (row,) = running.get("/eye/calibrations")["items"]
    found = tomllib.loads(running.get(f"/eye/calibrations/{row['name']}")["toml"])
    assert found["fx_px"] == pytest.approx(camera.fx_px, rel=0.01)
    assert re.search(r"seen in \d+ %", page.inner_text("figcaption"))
    page.wait_for_selector(f".eye-place option:text('{row['name']}')", state="attached")
    look_around(visited, ".eye-lens .result", "eye_lens")
    page.click("text=Throw all away")
    page.click("dialog .danger")
    page.wait_for_selector(".eye-lens .views", state="detached")  # what is below moves up
    page.click(f"button[aria-label='Throw {row['name']} away']")
    page.click("dialog .danger")
    visited.until(lambda: not running.get("/eye/calibrations")["items"], "the shelf is empty")
    assert running.get("/eye/cameras/overhead/views")["views"] == []
    assert visited.complaints == []


def typed(page, button, values):
    """Add a floor tag and type its numbers, key by key."""
    page.click(button)
    for title, text in values.items():
        field = page.locator(f"input[aria-label='Tag 1: {title}']")
        field.fill("")
        field.type(text)
        assert field.input_value() == text


def drawn(camera, folder):
    """Draw pictures of a chessboard through the camera's lens; return their paths."""
    model, rng = camera_model(camera), np.random.default_rng(3)
    cells = np.add.outer(np.arange(ROWS), np.arange(COLUMNS)) % 2
    page = (cells * 255).astype(np.uint8).repeat(CELL_PX, 0).repeat(CELL_PX, 1)
    page = np.pad(page, CELL_PX, constant_values=255)
    columns, rows = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
    flat = np.stack((columns, rows), axis=-1).reshape(-1, 1, 2).astype(np.float64)
    few = (cv2.TERM_CRITERIA_COUNT, 12, 0.0)
    ideal = cv2.undistortPoints(flat, model.matrix, model.distortion, None, None, None, few)
    rays = np.concatenate((ideal.reshape((*rows.shape, 2)), np.ones((*rows.shape, 1))), axis=-1)
    paths = []
    places = [(-0.3, -0.15), (0.3, -0.15), (0.0, 0.0), (-0.3, 0.15), (0.3, 0.15), (0.0, -0.12)]
    for i, (across, down) in enumerate(places):
        far = 2.4 if i % 2 else 1.9
        middle = np.array([across, down, 1.0]) * far
        turn = 0.6 * np.array([np.cos(2.4 * i), np.sin(2.4 * i), 0.2])
        rotation = cv2.Rodrigues(turn)[0]
        reach = (rotation[:, 2] @ middle) / (rays @ rotation[:, 2])
        on_board = (rays * reach[..., None] - middle) @ rotation[:, :2] * CELL_PX / SQUARE_M
        at = (on_board + np.array(page.shape[::-1]) / 2.0 - 0.5).astype(np.float32)
        seen = cv2.remap(page, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderValue=120)
        noisy = np.clip(seen + rng.normal(0.0, 2.0, seen.shape), 0, 255).astype(np.uint8)
        paths.append(folder / f"{i:02}.png")
        cv2.imwrite(str(paths[-1]), cv2.GaussianBlur(noisy, (0, 0), 0.7))
    return paths


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("/eye?camera=nowhere", "There is no camera called nowhere."),
        ("/eye/nowhere", "There is no such page of the Eye."),
    ],
)
def test_an_address_that_leads_to_no_camera_is_answered_in_words(visit, address, words):
    page = visit(address).page
    page.wait_for_selector(f".empty >> text={words}")
    page.click(".empty a")
    page.wait_for_selector(".at-eye select")
