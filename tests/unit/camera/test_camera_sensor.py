"""Noise: as strong as promised, the same for the same picture, another for any other."""

import math

import numpy as np
import pytest

from scm.camera.sensor import Noise


def grey(level):
    return np.full((720, 1280, 3), level, np.uint8)


def noisy(noise, level=120, vehicle="n1", camera="front", t_ns=5):
    frame = grey(level)
    noise.add(frame, vehicle, camera, t_ns)
    return frame


@pytest.mark.parametrize("level", [40, 120, 200])
@pytest.mark.parametrize(
    ("read", "shot", "gain"), [(2.0, 0.0, 1.0), (0.0, 6.0, 1.0), (2.0, 4.0, 2.0)]
)
def test_noise_is_as_strong_as_its_equation_says(optics, level, read, shot, gain):
    noise = Noise(optics(read_noise=read, shot_noise=shot, gain=gain), seed=1)
    got = noisy(noise, level).astype(float) - level
    want = math.sqrt(gain * (gain * read**2 + shot**2 * level / 255.0))
    # Rounding to whole grey levels adds 1/12 to the variance.
    assert got.std() == pytest.approx(math.sqrt(want**2 + 1 / 12), rel=0.03)
    assert abs(got.mean()) < 0.02 * want + 0.01


def test_without_noise_a_frame_stays_as_it_is(optics):
    assert (noisy(Noise(optics(), seed=1)) == grey(120)).all()


def test_the_same_picture_has_the_same_noise_and_any_other_another(optics):
    given = optics(read_noise=3.0)
    first = noisy(Noise(given, seed=1))
    noise = Noise(given, seed=1)
    noisy(noise, vehicle="n9")  # whatever was pictured before
    assert (noisy(noise) == first).all()
    assert (noisy(noise, vehicle="n2") != first).any()
    assert (noisy(noise, camera="rear") != first).any()
    assert (noisy(noise, t_ns=6) != first).any()
    assert (noisy(Noise(given, seed=2)) != first).any()
