"""A change in what a car file misses is detected, with its onset, and nothing else is."""

import numpy as np
import pytest

from scm.twin.detector import EVERY_S, LEARN, MEMORY, Detector
from scm.twin.windows import Windows

THRESHOLD, CHUNK = 7.0, 20
STREAMS, NUMBERS = 4, 3
SIZE = np.array([0.004, 0.003, 0.01, 2.0])


def drive(count, *, seed=0, wrong=0.0, changed=0.0, since=0, until=None, lasting=0.5, grows=1):
    """Return windows of a car whose number 1 is `wrong` from the beginning, and changes later.

    It changes at once, or within `grows` windows.
    """
    rng = np.random.default_rng(seed)
    slopes = 0.5 * SIZE[:, None] * rng.standard_normal((count, STREAMS, NUMBERS))
    noise = np.empty((count, STREAMS))
    last = np.zeros(STREAMS)
    for k, drawn in enumerate(rng.standard_normal((count, STREAMS))):
        last = noise[k] = lasting * last + (1.0 - lasting**2) ** 0.5 * drawn
    number = np.full(count, wrong)
    change = changed * np.clip((np.arange(count) - since + 1.0) / grows, 0.0, 1.0)
    number[since:until] += change[since:until]
    misses = SIZE * noise + number[:, None] * slopes[:, :, 1]
    nowhere = np.zeros((count, 2))
    return Windows(EVERY_S * np.arange(count), nowhere, ("x", "y", "yaw", "wheel"), misses, slopes)


def changes_in(windows, detector=None):
    """Return the changes that a detector reports, chunk by chunk, as a twin would feed it."""
    detector, found = detector or Detector(THRESHOLD), []
    for first in range(0, len(windows.begin_s), CHUNK):
        part = windows.between(EVERY_S * first, EVERY_S * (first + CHUNK))
        found += [change] if (change := detector.update(part)) else []
    return found


@pytest.mark.parametrize("size", [1.0, -1.0])
def test_change_is_noticed_with_its_number_size_and_onset(size):
    found = changes_in(drive(1900, wrong=0.5, changed=size, since=1500))
    first, onset_s = found[0], EVERY_S * 1500
    assert first.number == 1
    assert first.score * size > 0.0
    assert first.noticed_s < onset_s + 60.0
    assert abs(first.onset_s[0] - onset_s) < 5.0
    last = found[-1]
    assert last.size == pytest.approx(size, abs=0.15)
    assert last.onset_s[1] <= onset_s <= last.onset_s[2] < last.onset_s[1] + 5.0


def test_change_that_grows_is_dated_to_when_it_began():
    onset_s, grows, off = EVERY_S * 1500, 400, []
    for seed in range(6):
        first = changes_in(drive(2200, seed=seed, changed=2.0, since=1500, grows=grows))[0]
        assert onset_s < first.noticed_s < onset_s + EVERY_S * grows
        off.append(abs(first.onset_s[0] - onset_s))
    assert np.median(off) < 0.12 * EVERY_S * grows  # 0.16 if it were taken for one at once


@pytest.mark.parametrize("lasting", [0.0, 0.8])
def test_car_that_does_not_change_is_silent_however_wrong_its_file(lasting):
    assert changes_in(drive(3000, wrong=3.0, lasting=lasting)) == []


def test_weaker_change_is_noticed_later():
    noticed = [
        changes_in(drive(2400, changed=size, since=1500))[0].noticed_s for size in (1.5, 0.6)
    ]
    assert noticed[0] < noticed[1]


def test_change_before_it_has_learned_well_has_to_be_plainer():
    assert changes_in(drive(1100, changed=1.5, since=700))
    assert changes_in(drive(1100, changed=0.6, since=700)) == []


def test_nothing_is_reported_while_it_learns():
    detector = Detector(THRESHOLD)
    assert changes_in(drive(LEARN - CHUNK, changed=5.0, since=200), detector) == []
    assert detector.is_learning
    assert detector.driven_s == EVERY_S * (LEARN - CHUNK)


def test_a_few_seconds_that_stray_far_in_one_number_are_no_change():
    assert changes_in(drive(1900, changed=4.0, since=1500, until=1508)) == []


def test_single_bad_windows_are_no_change():
    windows = drive(2500)
    windows.misses[1500] = 500.0 * SIZE  # a pose of another car
    windows.misses[2100] = -500.0 * SIZE
    assert changes_in(windows) == []


def test_car_that_stands_shows_nothing():
    windows = drive(2500, changed=2.0, since=1500)
    windows.slopes[1400:] = 0.0
    windows.misses[1400:] = 0.0
    assert changes_in(windows) == []


def test_its_memory_does_not_grow():
    detector = Detector(1e9)
    changes_in(drive(LEARN), detector)
    for seed in range(3):
        changes_in(drive(MEMORY, seed=seed), detector)
    assert len(detector._history._t) == MEMORY
    assert detector.update(drive(0)) is None
