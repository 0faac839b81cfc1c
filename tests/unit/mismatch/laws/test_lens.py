"""A camera's law beyond the library: put right in free runs, and a number of the car's file."""

import numpy as np
import pytest

from scm.mismatch.fit import Fitted
from scm.mismatch.judge import judge
from scm.mismatch.laws.sensed import LENS, put_right, sensor_laws
from scm.mismatch.likelihood import Likelihood
from scm.mismatch.parts import split
from scm.mismatch.patch import patched
from tests.unit.mismatch.made_drive import big_nigel, driven, nigel

PER_M = 0.12
(LAW,) = (law for law in sensor_laws() if law.law.endswith("|x|)"))


def through_a_lens(name, _t, values):
    """Poses as a camera with a lens would say them, as long as y is small beside x."""
    return values * (1.0 + PER_M * np.abs(values)) if name == "pose.x" else values


@pytest.fixture(scope="module")
def seen():
    return driven(sense=through_a_lens)


def test_what_a_lens_adds_to_a_pose_is_taken_off(seen):
    true = driven()
    law = {LAW.knobs[0].key: PER_M}
    right, t = put_right(seen, law), true.stream("pose.x").t
    x, was, now = (s["pose.x"].at(t) for s in (true.smoothed, seen.smoothed, right))
    assert np.abs(was - x).max() > 0.02
    assert np.abs(now - x).max() < 0.4 * np.abs(was - x).max()
    assert right["pose.yaw"] is seen.smoothed["pose.yaw"]


def test_without_a_law_of_the_camera_poses_stay(seen):
    assert put_right(seen, {}) is None
    assert put_right(seen, {"sensed.5": 0.1, "measure.pose_scale": 1.1}) is None


def test_free_runs_of_the_car_found_are_held_against_poses_put_right():
    drive = driven(seconds=30.0)
    model = Likelihood([drive], big_nigel())
    parts = split(model)
    wrong, _ = judge([drive], big_nigel(), {}, {LAW.knobs[0].key: -0.3}, parts)
    same, _ = judge([drive], big_nigel(), {}, {}, parts)
    assert same.confirm.after == pytest.approx(same.confirm.before)
    assert wrong.confirm.before == pytest.approx(same.confirm.before)
    assert wrong.confirm.after["position_m"] > 1.5 * same.confirm.before["position_m"]


def test_the_car_file_has_the_lens(seen, tmp_path):
    model = Likelihood([seen], big_nigel())
    own = len(model.ordinary)
    fitted = Fitted((LAW,), np.zeros(own), np.array([PER_M]), np.zeros(1), 0.0,
                    np.zeros((1, own + 1)), covariance=np.eye(own + 1))  # fmt: skip
    car = patched(nigel(), model, fitted, tmp_path)
    assert [fault.measure.name for fault in car.faults] == [LENS]
    assert car.value("measure.camera_lens_x_per_m") == PER_M
