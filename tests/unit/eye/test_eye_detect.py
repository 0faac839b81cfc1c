"""Finding tags: prints, photographs, noise."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from scm.errors import EyeError
from scm.eye.detect import Settings, detect_tags
from scm.scenery.tags import CELLS, tag_picture

PHOTOS = Path(__file__).parents[4] / "shared" / "data" / "april_images"


def page_with(picture, size=200):
    page = np.full((size, size), 255, dtype=np.uint8)
    start = (size - len(picture)) // 2
    page[start : start + len(picture), start : start + len(picture)] = picture
    return page


def test_corners_of_an_upright_print_begin_lower_left_and_go_counter_clockwise():
    (tag,) = detect_tags(page_with(tag_picture(5, cell_px=12)), Settings(quad_decimate=1.0))
    low, high = (200 - CELLS * 12) / 2 - 0.5, (200 + CELLS * 12) / 2 - 0.5
    expected = [[low, high], [high, high], [high, low], [low, low]]
    np.testing.assert_allclose(tag.corners_px, expected, atol=0.3)


def test_the_middle_of_a_print_is_in_pixels_that_begin_at_zero():
    (tag,) = detect_tags(page_with(tag_picture(5, cell_px=12)), Settings(quad_decimate=1.0))
    # Edges that fall exactly between pixels are the hardest: 0.13 px. Another origin would be 0.5.
    np.testing.assert_allclose(tag.centre_px, (99.5, 99.5), atol=0.2)


def test_every_id_of_the_family_reads_as_itself():
    ids = [0, 1, 2, 99, 286, 586]
    found = [detect_tags(page_with(tag_picture(tag_id))) for tag_id in ids]
    assert [[tag.tag_id for tag in tags] for tags in found] == [[tag_id] for tag_id in ids]


@pytest.mark.parametrize("tag_id", [-1, 587])
def test_an_id_outside_the_family_is_refused(tag_id):
    with pytest.raises(EyeError, match=f"0 to 586, got {tag_id}"):
        tag_picture(tag_id)


@pytest.mark.parametrize(
    ("photo", "ids"), [("single_tag", [0]), ("multiple_tags", [0, 1, 2, 3, 4])]
)
@pytest.mark.parametrize("decimate", [1.0, 2.0])
def test_the_tags_in_real_photographs_are_found(photo, ids, decimate):
    path = PHOTOS / f"{photo}.jpg"
    if not path.is_file():
        pytest.skip(f"no photograph {path}")
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert [tag.tag_id for tag in detect_tags(grey, Settings(quad_decimate=decimate))] == ids


def test_noise_holds_no_tags():
    noise = np.random.default_rng(0).integers(0, 256, (480, 640), dtype=np.uint8)
    assert detect_tags(noise) == ()


def test_a_tag_cut_by_the_frame_is_left_out_without_error():
    page = page_with(tag_picture(7, cell_px=12))
    assert detect_tags(np.ascontiguousarray(page[:, 100:])) == ()


def test_of_twins_the_clearer_one_is_taken():
    clear = page_with(tag_picture(3, cell_px=12))
    faint = (clear * 0.3 + 120).astype(np.uint8)
    (tag,) = detect_tags(np.hstack([faint, clear]))
    assert tag.centre_px[0] > 200
