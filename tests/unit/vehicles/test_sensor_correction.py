"""Faults of measurement are undone, however strong, and whatever their order."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.recording.read import Channel, Recording
from scm.vehicles.sensor_correction import without_faults
from scm.vehicles.sensor_fault import AppliedFault, Series, all_sensor_faults, apply_faults

T = np.linspace(3.0, 63.0, 1500)
TRUE = {
    "pose.x": 2.0 * np.cos(0.3 * T),
    "pose.y": 1.5 * np.sin(0.4 * T),
    "pose.yaw": 0.4 * T,
    "speed": np.abs(np.sin(T)),
}
STRONG = [
    ("camera_tilt", {"tilt_x": 0.2, "tilt_y": -0.1}),
    ("camera_lens", {"per_x": 0.05, "per_y": -0.04, "per_square": -0.02}),
    ("pose_scale", {"scale": 2.5}),
    ("pose_point", {"ahead": 0.15, "aside": -0.05}),
    ("pose_heading", {"offset": 3.0}),
    ("pose_latency", {"delay": 0.6}),
    ("clock_offset", {"offset": -2.0}),
    ("clock_drift", {"rate": 0.05}),
]


def faults_of(rows):
    return [AppliedFault(all_sensor_faults()[name], values) for name, values in rows]


def measured(faults):
    """What a recording with these faults holds."""
    seen = apply_faults({name: Series(T, values) for name, values in TRUE.items()}, faults)
    channels = {
        name: Channel(s.t_s, s.values, None, (0.0, 0.0), "ratio") for name, s in seen.items()
    }
    return Recording(Path("made up"), "nigel", channels)


MILD = [
    ("camera_tilt", {"tilt_x": 0.05, "tilt_y": -0.04}),
    ("pose_scale", {"scale": 1.1}),
    *STRONG[3:7],
]


@pytest.mark.parametrize("rows", [*([row] for row in STRONG), MILD, MILD[::-1]])
def test_what_a_fault_did_to_the_poses_is_undone(rows):
    faults = faults_of(rows)
    right = without_faults(measured(faults), faults)
    for name in ("pose.x", "pose.y", "pose.yaw"):
        assert_allclose(right.channels[name].values, TRUE[name], atol=1e-6)
        assert_allclose(right.channels[name].t, T, atol=1e-6)


def test_a_recording_without_such_faults_stays_as_it_is():
    recording = measured([])
    assert without_faults(recording, faults_of([("gyro_bias", {"bias": 0.1})])) is recording


def test_a_unit_is_put_right_where_it_is_wrong():
    fault = AppliedFault(
        all_sensor_faults()["unit_error"], {"factor": 180.0 / np.pi}, ("pose.yaw",)
    )
    right = without_faults(measured([fault]), [fault])
    assert_allclose(right.channels["pose.yaw"].values, TRUE["pose.yaw"], atol=1e-9)
    assert_allclose(right.channels["pose.x"].values, TRUE["pose.x"], atol=0.0)
