import numpy as np
import pytest

from scm.errors import CarError
from studies import parking
from studies.found_car import EVERY_S, LASTS_S, commands


def test_drive_rests_and_goes_both_ways_at_all_speeds():
    t, throttle, steering = np.array(commands(np.random.default_rng(1))).T
    assert np.diff(t) == pytest.approx(EVERY_S)
    assert (t[-1], throttle[-1]) == (LASTS_S, 0.0)
    assert throttle.min() < -0.8
    assert throttle.max() > 0.8
    assert 0.15 < (throttle == 0.0).mean() < 0.4
    assert (steering.min() < -0.7) & (steering.max() > 0.7)


def test_missing_found_file_names_the_command_that_writes_it(tmp_path, monkeypatch):
    monkeypatch.setattr(parking, "FOUND", tmp_path)
    with pytest.raises(CarError, match=r"steer_gain/car\.toml.*python -m studies\.found_car"):
        parking.known_car("found", "steer_gain")
