"""A camera's law beyond the library: put right in free runs, and a number of the car's file."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.discovery.sensor_effects import LENS, sensor_effects
from scm.mismatch.fit.data_split import split
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.validate.found_car import patched
from scm.mismatch.validate.free_runs import judge
from scm.replay.drive import POSES, Drive
from scm.vehicles.sensor_fault import Series, apply_faults
from tests.unit.mismatch.made_drive import big_nigel, car_with, driven, nigel

PER_M = 0.12
(ALONG_X,) = (one for one in sensor_effects() if one.formula_text.endswith("|x|)"))


def through_a_lens(name, _t, values):
    """Poses as a camera with a lens would say them, as long as y is small beside x."""
    return values * (1.0 + PER_M * np.abs(values)) if name == "pose.x" else values


@pytest.fixture(scope="module")
def seen():
    return driven(sense=through_a_lens)


def test_a_car_file_with_the_lens_takes_it_out_of_what_free_runs_are_held_against():
    lens, true = car_with({"measure.camera_lens_x_per_m": PER_M}), driven().recording
    poses = {name: Series(true.channel(name).t, true.channel(name).values) for name in POSES}
    seen = {
        name: replace(true.channel(name), values=series.values)
        for name, series in apply_faults(poses, lens.faults).items()
    }
    drive = Drive(replace(true, channels={**true.channels, **seen}), big_nigel())
    fit, _ = judge([drive], big_nigel(), lens, split(Likelihood.of([drive], big_nigel())))
    assert fit.confirm.after["position_m"] < 0.2 * fit.confirm.before["position_m"]


def test_the_car_file_has_the_lens(seen, tmp_path):
    model = Likelihood.of([seen], big_nigel())
    own = len(model.nominal)
    fitted = Hypothesis(model, (ALONG_X,), np.zeros(own), np.array([PER_M]), np.zeros(1), 0.0,
                        np.zeros((1, own + 1)), covariance=np.eye(own + 1))  # fmt: skip
    car = patched(nigel(), fitted, tmp_path)
    assert [fault.kind.name for fault in car.faults] == [LENS]
    assert car.value("measure.camera_lens_x_per_m") == PER_M
