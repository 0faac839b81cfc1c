"""Tags frame after frame: known ones kept, new ones found in time, twins told, nothing crashes."""

import os
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from scm.eye.detect import Settings, detect_tags, look
from scm.eye.find.finder import TagFinder
from tests.unit.eye.made_tag_shots import corners_at, dim_and_noisy, many, picture, smeared

PHOTOS = Path(__file__).parents[4] / "shared" / "data" / "april_images"
SIZE = (1080, 1920)


@pytest.fixture
def rng():
    return np.random.default_rng(8)


def ids_of(tags):
    return [tag.tag_id for tag in tags]


def expected_of(tags, rng, off=3.0):
    return {tag_id: corners + rng.uniform(-off, off, (1, 2)) for tag_id, corners in tags}


def test_the_first_frame_is_searched_whole(rng):
    tags = many(rng, 20, size=SIZE)
    found = TagFinder().find(picture(tags, SIZE, rng))
    assert ids_of(found) == sorted(tag_id for tag_id, _ in tags)
    true = dict(tags)
    error = np.array([np.array(tag.corners_px) - true[tag.tag_id] for tag in found])
    assert np.sqrt(np.mean(error**2)) < 0.03


@pytest.mark.parametrize("wrong", [0, 1])
def test_a_tag_is_told_with_how_many_of_its_bits_were_wrong(rng, wrong):
    grey = picture([(5, corners_at(320.0, 240.0, 80.0))], rng=rng)
    if wrong:
        grey[241:249, 321:329] = 255 - grey[241:249, 321:329]  # a cell, ink for paper
    finder, settings = TagFinder(), Settings(quad_decimate=1.0)
    (whole,), (kept,) = finder.find(grey), finder.find(grey)
    (library,) = look(grey, settings, 1.0, 0.0)
    assert [tag.hamming for tag in (whole, kept, library)] == [wrong] * 3


def test_a_new_tag_is_found_within_the_scan(rng):
    tags = many(rng, 21, size=SIZE)
    finder = TagFinder(scan_frames=8)
    finder.find(picture(tags[:20], SIZE, rng))
    full = picture(tags, SIZE, rng)
    told = [len(finder.find(full, expected_of(tags[:20], rng))) for _ in range(8)]
    assert told[-1] == 21
    assert min(told) >= 20


def test_a_tag_on_the_border_of_strips_is_found_once(rng):
    tags = [(k, corners_at(240.0 * k, 100.0 * k, 60.0)) for k in range(1, 8)]
    grey = picture(tags, SIZE, rng)
    finder = TagFinder(scan_frames=8)
    finder.find(np.zeros(SIZE, dtype=np.uint8))
    told = [ids_of(finder.find(grey)) for _ in range(16)]
    assert told[-1] == list(range(1, 8))
    assert all(len(ids) == len(set(ids)) for ids in told)


def test_tags_are_followed_without_being_expected(rng):
    finder = TagFinder(scan_frames=1000)
    for k in range(6):
        tags = [(5, corners_at(200.0 + 4.0 * k, 300.0, 44.0, 0.05 * k))]
        assert ids_of(finder.find(picture(tags, rng=rng))) == [5]


def test_two_tags_with_one_id_are_both_told_in_every_frame(rng):
    tags = [(5, corners_at(150.0, 200.0, 44.0)), (5, corners_at(450.0, 300.0, 40.0))]
    grey = picture(tags, rng=rng)
    finder = TagFinder()
    for _ in range(9):
        assert ids_of(finder.find(grey, {5: tags[1][1]})) == [5, 5]
    assert ids_of(detect_tags(grey)) == [5]
    assert ids_of(detect_tags(grey, duplicates=True)) == [5, 5]


def test_another_tag_where_one_was_expected_is_told_by_its_own_id(rng):
    at = corners_at(250.0, 200.0, 44.0)
    finder = TagFinder(scan_frames=1000)
    finder.find(picture([], rng=rng))
    assert ids_of(finder.find(picture([(7, at)], rng=rng), {5: at})) == [7]


def test_a_tag_lost_by_more_than_a_cell_is_found_around_its_place(rng):
    at = corners_at(450.0, 200.0, 44.0)
    finder = TagFinder(scan_frames=1000)
    finder.find(picture([], rng=rng))
    assert ids_of(finder.find(picture([(7, at)], rng=rng), {7: at + np.array([17.0, -12.0])})) == [
        7
    ]


def test_most_tags_lost_are_searched_in_the_whole_frame(rng):
    tags = many(rng, 20, size=SIZE)
    grey = picture(tags, SIZE, rng)
    finder = TagFinder(scan_frames=4)
    finder.find(grey)
    away = {tag_id: corners + 300.0 for tag_id, corners in tags}
    moved = grey[:, ::-1][:, ::-1]
    shifted = np.roll(moved, 60, axis=0)
    finder.find(grey)
    told = [len(finder.find(shifted, away)) for _ in range(4)]
    assert told[-1] == 20


@pytest.mark.parametrize(("effect", "least"), [("clean", 0.999), ("smeared", 0.97), ("dim", 0.98)])
def test_tracked_tags_are_found_whatever_the_light(rng, effect, least):
    found = total = 0
    for _ in range(4):
        tags = many(rng, 50, size=SIZE)
        grey = picture(tags, SIZE, rng)
        if effect == "smeared":
            grey = smeared(grey, 6.0, rng.uniform(0.0, np.pi))
        if effect == "dim":
            grey = dim_and_noisy(grey, rng)
        told = ids_of(TagFinder().find(grey, expected_of(tags, rng)))
        assert set(told) <= {tag_id for tag_id, _ in tags}
        found, total = found + len(told), total + len(tags)
    assert found >= least * total


@pytest.mark.parametrize(
    "page",
    [
        np.zeros((1, 1), dtype=np.uint8),
        np.zeros((0, 0), dtype=np.uint8),
        np.zeros((480, 640), dtype=np.uint8),
        np.full((480, 640), 255, dtype=np.uint8),
        np.random.default_rng(0).integers(0, 6, (480, 640), dtype=np.uint8),
        np.random.default_rng(0).integers(0, 256, (480, 640), dtype=np.uint8),
    ],
    ids=["one pixel", "empty", "black", "saturated", "lens cap", "noise"],
)
def test_bad_frames_hold_no_tags_and_do_no_harm(page, rng):
    tags = [(5, corners_at(200.0, 200.0, 44.0)), (9, corners_at(400.0, 300.0, 44.0))]
    good = picture(tags, rng=rng)
    finder = TagFinder()
    assert ids_of(finder.find(good)) == [5, 9]
    for _ in range(10):
        assert finder.find(page, dict(tags)) == ()
    assert ids_of(finder.find(good, dict(tags))) == [5, 9]


def test_impossible_expectations_are_passed_over(rng):
    tags = [(5, corners_at(200.0, 200.0, 44.0))]
    wrong = {-1: tags[0][1], 587: tags[0][1], 6: np.full((4, 2), np.nan), 7: tags[0][1] + 1e7}
    assert ids_of(TagFinder().find(picture(tags, rng=rng), wrong)) == [5]


def test_a_readonly_or_cut_out_frame_will_do(rng):
    grey = picture([(5, corners_at(200.0, 200.0, 44.0))], rng=rng)
    finder = TagFinder()
    finder.find(grey)
    wide = np.repeat(grey, 2, axis=1)[:, ::2]
    wide.setflags(write=False)
    assert ids_of(finder.find(wide)) == [5]


@pytest.mark.parametrize(
    ("photo", "ids"), [("single_tag", [0]), ("multiple_tags", [0, 1, 2, 3, 4])]
)
def test_tags_in_real_photographs_are_found_where_the_library_has_them(photo, ids):
    path = PHOTOS / f"{photo}.jpg"
    if not path.is_file():
        pytest.skip(f"no photograph {path}")
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    reference = {tag.tag_id: tag for tag in look(grey, Settings(), 1.0, 0.0)}
    finder = TagFinder()
    for _ in range(3):
        found = finder.find(grey)
        assert ids_of(found) == ids
        for tag in found:
            wanted = reference[tag.tag_id].corners_px
            np.testing.assert_allclose(tag.corners_px, wanted, atol=1.0)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_thousands_of_looks_need_no_more_memory(rng):
    cuts = [picture([(k, corners_at(60.0, 60.0, 44.0))], (120, 110 + k), rng) for k in range(8)]

    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    for k in range(400):
        assert ids_of(look(cuts[k % 8], Settings(), 1.0, 0.8)) == [k % 8]
    before = resident()
    for k in range(2000):
        look(cuts[k % 8], Settings(), 1.0, 0.8)
    assert resident() - before < 2_000_000
