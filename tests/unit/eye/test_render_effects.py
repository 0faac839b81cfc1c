"""What lenses and sensors do to pictures, measured in the pictures."""

import numpy as np
import pytest

from scm.errors import EyeError
from scm.eye.render import effects


def spread_px(profile):
    """Standard deviation of where a profile's light lies."""
    at = np.arange(len(profile))
    middle = np.sum(at * profile) / np.sum(profile)
    return np.sqrt(np.sum((at - middle) ** 2 * profile) / np.sum(profile))


@pytest.mark.parametrize("length", [2.0, 6.0, 13.5])
def test_a_blur_is_as_long_as_it_is_said_to_be(length):
    line = np.zeros((9, 61), dtype=np.uint8)
    line[:, 30] = 255
    profile = effects.motion_blur(line, length)[4].astype(float)
    # an even smear of length b has standard deviation b / sqrt(12); a pixel's own width adds 1 / 6
    assert np.sqrt(12.0 * (spread_px(profile) ** 2 - 1.0 / 6.0)) == pytest.approx(length, abs=0.15)


def test_a_blur_goes_along_its_angle():
    dot = np.zeros((41, 41), dtype=np.uint8)
    dot[20, 20] = 255
    blurred = effects.motion_blur(dot, 10.0, np.pi / 2.0).astype(float)
    assert spread_px(blurred.sum(axis=1)) > 5.0 * spread_px(blurred.sum(axis=0) + 1e-9) - 1.0
    assert np.flatnonzero(blurred.sum(axis=0)).tolist() == [20]


def test_defocus_spreads_a_point_over_a_disc():
    dot = np.zeros((41, 41), dtype=np.uint8)
    dot[20, 20] = 255
    seen = effects.defocus(dot, 4.0) > 0
    assert seen.sum() == pytest.approx(np.pi * 16.0, rel=0.25)


def test_a_rolling_shutter_shears_by_speed_times_line_time():
    upright = np.zeros((101, 200), dtype=np.uint8)
    upright[:, 100] = 200
    sheared = effects.rolling_shutter(upright, (4000.0, 0.0), 1e-4).astype(float)
    middles = [np.sum(np.arange(200) * row) / np.sum(row) for row in sheared]
    assert middles[50] == pytest.approx(100.0)
    assert middles[100] - middles[0] == pytest.approx(100 * 1e-4 * 4000.0, abs=0.1)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_vignetting_takes_the_given_share_of_light_from_all_corners(share):
    bright = np.full((120, 200, 3), 200, dtype=np.uint8)
    seen = effects.vignetting(bright, share)
    corners = seen[[0, 0, -1, -1], [0, -1, 0, -1]].astype(float)
    assert corners == pytest.approx(np.full((4, 3), 200.0 * (1.0 - share)), abs=0.51)
    assert seen[60, 100].min() >= 199


def test_vignetting_of_more_than_all_light_is_refused():
    with pytest.raises(EyeError, match=r"0 to 1, got 1\.5"):
        effects.vignetting(np.zeros((9, 9), dtype=np.uint8), 1.5)


def test_light_from_one_side_differs_by_the_gradient_from_edge_to_edge():
    even = np.full((50, 100), 100, dtype=np.uint8)
    seen = effects.uneven_light(even, 0.4).astype(float)
    assert seen[:, -1].mean() - seen[:, 0].mean() == pytest.approx(40.0, abs=1.0)


def test_a_lamp_lights_its_surroundings_more():
    even = np.full((50, 100), 100, dtype=np.uint8)
    lamp = effects.LampSpot(x_px=20.0, y_px=10.0, radius_px=8.0, strength=0.5)
    seen = effects.uneven_light(even, 0.0, spots=[lamp])
    assert (seen[10, 20], seen[40, 90]) == (150, 100)


def test_glare_saturates_in_its_core_and_is_gone_far_away():
    dark = np.full((200, 300), 20, dtype=np.uint8)
    spot = effects.Glare(x_px=100.0, y_px=80.0, length_px=30.0, width_px=10.0)
    seen = effects.glare(dark, [spot])
    assert seen[80, 100] == 255
    assert seen[199, 299] < 24


@pytest.mark.parametrize("grey", [40, 128, 200])
def test_noise_grows_with_light_as_photons_do(grey):
    even = np.full((400, 500), grey, dtype=np.uint8)
    seen = effects.sensor_noise(even, 3.0, 6.0, np.random.default_rng(0)).astype(float)
    expected = np.sqrt(3.0**2 + 6.0**2 * grey / 255.0 + 1.0 / 12.0)
    assert seen.std() == pytest.approx(expected, rel=0.03)
    assert seen.mean() == pytest.approx(grey, abs=0.1)


def test_noise_is_the_same_for_the_same_seed_and_other_for_another():
    even = np.full((40, 50, 3), 90, dtype=np.uint8)
    first, again, other = (
        effects.sensor_noise(even, 3.0, 6.0, np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_jpeg_loses_more_at_a_lower_quality():
    rng = np.random.default_rng(0)
    rough = rng.integers(0, 256, (64, 64), dtype=np.uint8)
    off = [np.abs(effects.jpeg(rough, q).astype(int) - rough).mean() for q in (95, 60, 20)]
    assert off[0] < off[1] < off[2]


@pytest.mark.parametrize("quality", [0, 101])
def test_a_jpeg_quality_out_of_range_is_refused(quality):
    with pytest.raises(EyeError, match=f"1 to 100, got {quality}"):
        effects.jpeg(np.zeros((8, 8), dtype=np.uint8), quality)
