"""Where a car strays that nothing explains."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.findings import Equation
from scm.mismatch.validate.locate import strayed
from tests.unit.mismatch import made_up_findings as made_up


def runs_that_stray(along=0.0, across=0.0, where=lambda x, y: 1.0 + 0.0 * x):
    runs = made_up.free_runs()
    real = runs.measured
    yaw, much = real["yaw"], where(real["x"][:, 30:31], real["y"][:, 30:31]) * runs.t_s / 3.0
    after = {
        "x": real["x"] + much * (along * np.cos(yaw) - across * np.sin(yaw)),
        "y": real["y"] + much * (along * np.sin(yaw) + across * np.cos(yaw)),
        "yaw": yaw,
    }
    return replace(runs, after=after)


def test_a_car_that_strays_along_its_way_is_located_in_the_drive():
    (found,) = strayed(runs_that_stray(along=0.2), made_up.fit())
    assert (found.equation, found.when_s, found.where) == (Equation.DRIVE, None, None)
    assert found.share_of_error == pytest.approx(1.0)


def test_a_car_that_strays_both_ways_has_the_larger_part_first():
    first, second = strayed(runs_that_stray(along=0.1, across=0.2), made_up.fit())
    assert (first.equation, second.equation) == (Equation.STEERING, Equation.DRIVE)
    assert first.share_of_error == pytest.approx(0.8, abs=0.01)


def test_a_car_that_strays_on_one_spot_is_located_there():
    spot = runs_that_stray(along=0.3, where=lambda x, y: 1.0 * ((x > 0.8) & (y > 0.2)))
    (found,) = strayed(spot, made_up.fit())
    assert found.where is not None
    assert found.where.x_m[0] > 0.7
    assert found.where.y_m[0] > 0.1


def test_runs_of_nothing_but_gaps_are_located_nowhere():
    runs = made_up.free_runs()
    gaps = {name: np.full_like(values, np.nan) for name, values in runs.measured.items()}
    assert strayed(replace(runs, measured=gaps), made_up.fit()) == ()
