"""What `scm eye print` prints: true sizes, named cars, and the right way round."""

import math
import re
import xml.etree.ElementTree as ET

import cv2
import msgspec
import numpy as np
import pytest

from scm.__main__ import main
from scm.errors import EyeError
from scm.eye.calibrate.board import find_board
from scm.eye.camera import camera_model
from scm.eye.detect import detect_tags
from scm.eye.extrinsics import ExtrinsicsEstimator
from scm.eye.pose import car_pose
from scm.maps.load import load_map
from scm.records.city_map import VehicleTag
from scm.scenery.board import Board
from scm.scenery.bodies import NIGEL
from scm.scenery.paper import PAPERS_MM, pdf, svg
from scm.scenery.prints import TagPrint, board_page, map_print, tag_pages, vehicle_print

CITY = load_map("driving_school")
NAMESPACE = "{http://www.w3.org/2000/svg}"
MOVE = re.compile(r"M([-\d.]+) ([-\d.]+)h([-\d.]+)v([-\d.]+)h[-\d.]+z")


def drawn(page, px_per_mm):
    """Return the picture that an SVG file's own words make, grey, white paper."""
    root = ET.fromstring(svg(page))
    width, height = (float(root.get(side).removesuffix("mm")) for side in ("width", "height"))
    assert root.get("viewBox") == f"0 0 {width} {height}"
    picture = np.full((round(height * px_per_mm), round(width * px_per_mm)), 255, dtype=np.uint8)
    for path in root.iter(f"{NAMESPACE}path"):
        for found in MOVE.findall(path.get("d")):
            x, y, across, up = (round(float(one) * px_per_mm) for one in found)
            picture[y : y + up, x : x + across] = 0
    for line in root.iter(f"{NAMESPACE}line"):
        ends = [round(float(line.get(key)) * px_per_mm) for key in ("x1", "y1", "x2", "y2")]
        cv2.line(picture, ends[:2], ends[2:], 0)
    return picture


def words(page):
    return [text.text for text in ET.fromstring(svg(page)).iter(f"{NAMESPACE}text")]


def test_a_printed_roof_tag_is_found_at_true_size_its_arrow_to_the_front():
    """A camera over the printed sheet, the sheet turned by known angles."""
    (page,) = tag_pages([vehicle_print(CITY, "n7", "nigel")])
    sheet = cv2.GaussianBlur(drawn(page, 4.0), (3, 3), 0)
    for turn in (0.0, 0.4, math.pi / 2, -2.5):
        middle = (sheet.shape[1] / 2 - 0.5, sheet.shape[0] / 2 - 0.5)
        onto = cv2.getRotationMatrix2D(middle, math.degrees(turn), 0.7)  # counter-clockwise
        size = (1400, 1400)
        onto[:, 2] += np.array(size) / 2 - 0.5 - np.array(middle)
        (tag,) = detect_tags(cv2.warpAffine(sheet, onto, size, borderValue=200))
        assert tag.tag_id == 7
        px_per_m = 1000.0 * 4.0 * 0.7
        above = 1.0
        camera = msgspec.structs.replace(
            CITY.cameras[0], x_m=0.0, y_m=0.0, z_m=NIGEL.tag_position[2] + above, yaw_rad=0.0,
            tilt_x_rad=0.0, tilt_y_rad=0.0, width_px=1400, height_px=1400, cx_px=699.5,
            cy_px=699.5, fx_px=px_per_m * above, fy_px=px_per_m * above, distortion=(0.0,) * 5,
        )  # fmt: skip
        estimator = ExtrinsicsEstimator(camera_model(camera), CITY.tag)
        found = car_pose(estimator, NIGEL, np.array(tag.corners_px))
        assert math.remainder(found.pose.yaw - turn, math.tau) == pytest.approx(0.0, abs=0.01)
        assert found.size_ratio == pytest.approx(1.0, abs=0.005)
        assert not found.is_refused


def test_a_sheet_says_whose_tag_it_is_how_large_and_that_it_must_not_be_scaled():
    (page,) = tag_pages([vehicle_print(CITY, "n7", "nigel"), map_print(CITY)])
    said = " | ".join(words(page))
    assert "n7 - tag 7 | tag36h11, black edge 76.2 mm, car nigel" in said
    assert "floor of driving_school - tag 0" in said
    assert "front of the car" in said
    assert "This ruler is 100 mm long" in said
    longest = max(page.lines, key=lambda line: line[2] - line[0])
    assert longest[2] - longest[0] == 100.0
    for shape in page.shapes:
        xs = [x for left, _, across, _ in shape for x in (left, left + across)]
        assert max(xs) - min(xs) == pytest.approx(76.2)


def test_tags_go_to_the_next_page_where_they_do_not_fit_and_a_paper_that_fits_is_named():
    cars = [vehicle_print(CITY, f"n{number}", "nigel") for number in range(1, 6)]
    assert [len(page.shapes) for page in tag_pages(cars)] == [2, 2, 1]
    assert [len(page.shapes) for page in tag_pages(cars, "letter")] == [2, 2, 1]
    for page in tag_pages(cars, "letter"):
        low = min(bottom for shape in page.shapes for _, bottom, _, _ in shape)
        assert low > 35.0  # above the words and the ruler
    with pytest.raises(EyeError, match="does not fit paper A4: expected paper A3"):
        tag_pages([TagPrint(1, 0.2, "large", "x")])
    with pytest.raises(EyeError, match="expected one of A4, A3"):
        tag_pages(cars, "B5")


def test_a_name_without_a_tag_of_its_own_is_not_printed():
    with pytest.raises(EyeError, match=r"vehicle 'red': no tag is bound.*\[\[vehicle_tags\]\]"):
        vehicle_print(CITY, "red", "nigel")
    bound = msgspec.structs.replace(CITY, vehicle_tags=(VehicleTag(vehicle="red", tag_id=12),))
    assert vehicle_print(bound, "red", "nigel").tag_id == 12
    assert vehicle_print(bound, "red", "nigel", worn=31).tag_id == 31
    with pytest.raises(EyeError, match="did you mean 'nigel'"):
        vehicle_print(CITY, "n1", "nigal")


@pytest.mark.parametrize(
    ("kind", "marker_m", "points"),
    [("chessboard", None, 40), ("charuco", 0.022, 40), ("tags", 0.022, 216)],
)
def test_a_printed_board_is_found_whole_at_its_size(kind, marker_m, points):
    board = Board(kind, 9, 6, 0.03, marker_m)
    page = board_page(board)
    assert (page.width_mm, page.height_mm) == PAPERS_MM["A4"][::-1]
    picture = cv2.GaussianBlur(drawn(page, 4.0), (3, 3), 0)
    view = find_board(board, picture, "drawn")
    assert len(view.points) == points
    apart = np.hypot(*(view.pixels[0] - view.pixels[-1])) / 4000.0
    assert apart == pytest.approx(math.dist(view.points[0], view.points[-1]), rel=2e-3)


def test_a_pdf_has_the_same_shapes_at_true_size_and_asks_not_to_be_scaled():
    pages = tag_pages([vehicle_print(CITY, f"n{number}", "nigel") for number in (1, 2, 3)])
    text = pdf(pages).decode()
    assert "/PrintScaling /None" in text
    assert text.count("/Type /Page ") == 2
    assert "[0 0 595.2756 841.8898]" in text
    first = text.split("stream\n")[1]
    assert first.startswith("2.83464567 0 0 2.83464567 0 0 cm")
    assert first.count(" re") == sum(len(shape) for shape in pages[0].shapes)
    start = int(text.rsplit("startxref\n", 1)[1].split()[0])
    assert text[start:].startswith("xref")
    for number, place in enumerate(re.findall(r"(\d{10}) 00000 n", text), start=1):
        assert text[int(place) :].startswith(f"{number} 0 obj")


def test_the_command_writes_pdf_and_one_svg_a_page(tmp_path, capsys):
    made = tmp_path / "tags.pdf"
    words = ["eye", "print", "driving_school", "--map-tag", "--vehicles", "n1..n2", "n4"]
    assert main([*words, "--out", str(made)]) == 0
    assert made.read_bytes().startswith(b"%PDF-1.6")
    assert "tag   4  76.2 mm  n4" in capsys.readouterr().out
    assert main([*words, "--out", str(tmp_path / "tags.svg")]) == 0
    assert {one.name for one in tmp_path.glob("*.svg")} == {"tags-1.svg", "tags-2.svg"}
    assert main([*words, "--tags", "4", "--out", str(made)]) == 2
    assert "tag 4: expected it once, got it for n4, tag36h11 4" in capsys.readouterr().err
    assert main(["eye", "print", "--board", "chessboard", "--out", str(tmp_path / "b.svg")]) == 0
