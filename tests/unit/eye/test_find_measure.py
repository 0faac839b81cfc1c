"""Measuring tags where they should be: exact, from several pixels off, and only what is there."""

import math

import cv2
import numpy as np
import pytest

from scm.eye.find.codes import tag_cells
from scm.eye.find.measure import BITS, BORDER, MARGIN, measure
from scm.scenery.tags import tag_picture
from tests.unit.eye.made_tag_shots import corners_at, dim_and_noisy, many, picture, smeared

SIZE = (1080, 1920)


@pytest.fixture(scope="module")
def rng():
    return np.random.default_rng(4)


def measured(grey, tags, off=0.0, rng=None):
    true = np.array([corners for _, corners in tags])
    start = true if rng is None else true + rng.uniform(-off, off, (len(true), 1, 2))
    found, verdicts = measure(grey, start, tag_cells()[[tag_id for tag_id, _ in tags]])
    good = (verdicts[:, BITS] <= 1) & (verdicts[:, BORDER] <= 2) & (verdicts[:, MARGIN] >= 15.0)
    return found - true, good


def test_cells_are_the_print_from_below():
    assert tag_cells().shape == (587, 8, 8)
    cell = tag_picture(17, 16)[16 * 8 - 8, 16 * 3 + 8] > 127  # second row from below, third column
    assert tag_cells()[17, 1, 2] == cell


@pytest.mark.parametrize("side", [(28.0, 34.0), (38.0, 48.0), (70.0, 90.0)])
def test_corners_are_exact_to_hundredths_of_a_pixel(rng, side):
    tags = many(rng, 40, side, SIZE)
    error, good = measured(picture(tags, SIZE, rng), tags, 5.0, rng)
    assert good.all()
    assert np.sqrt(np.mean(error**2)) < 0.03


def test_a_guess_that_is_turned_by_eight_degrees_will_do(rng):
    tags = many(rng, 40, size=SIZE)
    grey = picture(tags, SIZE, rng)
    turn = math.radians(8.0)
    turned = [
        (i, c.mean(axis=0) + (c - c.mean(axis=0)) @ np.array(
            [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
        ))
        for i, c in tags
    ]  # fmt: skip
    cells = tag_cells()[[i for i, _ in tags]]
    found, verdicts = measure(grey, np.array([c for _, c in turned]), cells)
    assert (verdicts[:, BITS] == 0).all()
    np.testing.assert_allclose(found, [c for _, c in tags], atol=0.15)


@pytest.mark.parametrize("turn", [0.0, 0.4, 0.8, 1.6])
def test_tags_smeared_by_six_pixels_are_read(rng, turn):
    tags = many(rng, 100, size=SIZE)
    grey = smeared(picture(tags, SIZE, rng), 6.0, turn)
    error, good = measured(grey, tags, 4.0, rng)
    assert good.mean() >= 0.97
    assert np.sqrt(np.mean(error[good] ** 2)) < 0.2


def test_tags_in_dim_noise_are_read(rng):
    tags = many(rng, 100, size=SIZE)
    error, good = measured(dim_and_noisy(picture(tags, SIZE), rng), tags, 5.0, rng)
    assert good.mean() >= 0.98
    assert np.sqrt(np.mean(error[good] ** 2)) < 0.08


def test_a_lens_that_bends_the_sides_moves_corners_by_less_than_a_tenth_of_a_pixel(rng):
    tags = many(rng, 50, (70.0, 80.0), SIZE)
    flat = picture(tags, SIZE)
    matrix = np.array([[1370.0, 0.0, 960.0], [0.0, 1370.0, 540.0], [0.0, 0.0, 1.0]])
    lens = np.array([-0.3, 0.08, 0.0, 0.0, 0.0])
    x, y = np.meshgrid(np.arange(1920.0), np.arange(1080.0))
    pixels = np.stack((x.ravel(), y.ravel()), axis=-1)[:, None]
    from_px = cv2.undistortPoints(pixels, matrix, lens, P=matrix).reshape(1080, 1920, 2)
    seen = cv2.remap(flat, from_px.astype(np.float32), None, cv2.INTER_CUBIC)
    rays = [np.column_stack(((c - matrix[:2, 2]) / 1370.0, np.ones(4))) for _, c in tags]
    none = np.zeros(3)
    bent = [cv2.projectPoints(ray, none, none, matrix, lens)[0][:, 0] for ray in rays]
    error, good = measured(seen, [(i, c) for (i, _), c in zip(tags, bent, strict=True)])
    assert good.all()
    assert np.sqrt(np.mean(error**2)) < 0.1


def test_another_tag_than_expected_is_not_taken_for_it(rng):
    tags = many(rng, 40, size=SIZE)
    grey = picture(tags, SIZE, rng)
    _, good = measured(grey, [((i + 1) % 587, c) for i, c in tags])
    assert not good.any()


def test_noise_and_plain_floor_are_no_tags(rng):
    tags = many(rng, 100, size=SIZE)
    for page in (rng.integers(0, 256, SIZE, dtype=np.uint8), np.full(SIZE, 90, dtype=np.uint8)):
        assert not measured(page, tags)[1].any()


@pytest.mark.parametrize(
    "corners",
    [
        np.full((4, 2), 50.0),
        np.full((4, 2), np.nan),
        corners_at(50.0, 50.0, 40.0)[::-1],
        corners_at(-10.0, 50.0, 40.0),
        corners_at(50.0, 50.0, 1e9),
    ],
    ids=["a point", "no number", "inside out", "outside", "huge"],
)
def test_impossible_expectations_find_nothing(corners):
    page = picture([(3, corners_at(50.0, 50.0, 40.0))], (100, 100))
    _, verdicts = measure(page, corners[None], tag_cells()[[3]])
    assert verdicts[0, BITS] > 36
