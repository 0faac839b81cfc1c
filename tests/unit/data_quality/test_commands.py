"""Whether a motion belongs to a command, or is merely alike in what is slow."""

import numpy as np
import pytest

from scm.data_quality.commands import CLEARLY, MAX_DELAY_S, STEP_S, _belongs, best_correlation
from scm.data_quality.pose_track import grid

SECONDS = 60.0


@pytest.fixture(scope="module")
def on():
    return grid(0.0, SECONDS, STEP_S, 0.3)


def laps(on):
    """What is slow and alike in two drives of like routes."""
    return np.sin(2.0 * np.pi * on.t / 15.0)


def quick(on, seed):
    """Presses of a throttle, as one driver gives them on one day."""
    rng = np.random.default_rng(seed)
    return 1.5 * rng.standard_normal(200)[(on.t / 0.8).astype(int)]


def raw(motion, asked, on):
    return best_correlation(motion, asked, on, MAX_DELAY_S)


def test_a_motion_that_is_alike_only_in_what_is_slow_is_of_another_drive(on):
    motion, asked = laps(on) + quick(on, 1), laps(on) + quick(on, 2)
    assert 0.2 < raw(motion, asked, on) < CLEARLY
    assert not _belongs(motion, asked, on)


def test_a_motion_that_follows_quick_changes_belongs_however_much_hides_them(on):
    asked = laps(on) + quick(on, 1)
    motion = quick(on, 1) - 1.5 * laps(on) + 2.0 * np.sin(2.0 * np.pi * on.t / 40.0)
    assert raw(motion, asked, on) < CLEARLY
    assert _belongs(motion, asked, on)


def test_a_command_that_only_changes_slowly_belongs_to_what_follows_it(on):
    ramp = on.t / SECONDS
    noise = 0.1 * np.random.default_rng(3).standard_normal(len(ramp))
    assert _belongs(ramp + noise, ramp, on)
    assert not _belongs(noise, ramp, on)
