"""Every fault of measurement keeps its contract: documents, finite, neutral, in its place."""

import inspect
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scm.vehicles.car import all_terms
from scm.vehicles.param import LogNormal, Normal
from scm.vehicles.sensor_fault import AppliedFault, Series, all_sensor_faults, apply_faults

SENSOR_FAULTS = all_sensor_faults()
CHANNELS = (
    "command.throttle", "command.steering", "pose.x", "pose.y", "pose.z", "pose.roll",
    "pose.pitch", "pose.yaw", "velocity.x", "speed", "yaw_rate", "wheel_speed.fl",
    "wheel_speed.rr", "encoder.left", "encoder.right", "imu.accel_x", "imu.accel_y",
    "imu.accel_z", "imu.gyro_x", "imu.gyro_z", "battery.voltage", "motor.current",
)  # fmt: skip
DRAWS = settings(max_examples=50, derandomize=True)


def recording(seed=0):
    """Every channel, each group with stamps of its own."""
    rng = np.random.default_rng(seed)
    clocks = {}
    for name in CHANNELS:
        group = name.partition(".")[0]
        clocks.setdefault(group, 0.1 + np.cumsum(rng.uniform(0.01, 0.05, 40)))
    return {
        name: Series(clocks[name.partition(".")[0]], rng.normal(0.0, 1.0, 40)) for name in CHANNELS
    }


def fault(name, values=None):
    m = SENSOR_FAULTS[name]
    return AppliedFault(m, values or {}, ("imu.gyro_z",) if m.acts_on == () else ())


def touched(name):
    return {channel for channel in CHANNELS if fault(name).function_for(channel) is not None}


@pytest.mark.parametrize("name", SENSOR_FAULTS)
def test_the_fault_is_named_like_its_file(name):
    assert SENSOR_FAULTS[name].name == name
    assert SENSOR_FAULTS[name].function.__name__ == name


@pytest.mark.parametrize("name", SENSOR_FAULTS)
def test_the_file_states_equation_range_manoeuvre_and_source(name):
    m = SENSOR_FAULTS[name]
    assert m.about.endswith(".")
    assert "=" in m.equation
    for heading in ("Holds", "Shows in", "Source"):
        assert len(m.doc_line(heading)) > 3, heading
    assert m.shows_in
    assert len(Path(inspect.getfile(m.function)).read_text(encoding="utf-8").splitlines()) <= 60


@pytest.mark.parametrize("name", SENSOR_FAULTS)
def test_parameters_have_unit_key_prior_and_a_neutral_default_inside_their_bounds(name):
    m = SENSOR_FAULTS[name]
    assert m.neutral == {param.name: param.default for param in m.params}
    for param in m.params:
        low, high = param.bounds
        assert low <= param.default <= high
        assert param.key.startswith("measure.")
        assert isinstance(param.prior, Normal | LogNormal)
        assert len(param.about) >= 5


def test_no_two_parameters_share_a_key():
    keys = [p.key for m in SENSOR_FAULTS.values() for p in m.params]
    keys += {p.key for term in all_terms().values() for p in term.params}
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("name", SENSOR_FAULTS)
def test_a_neutral_fault_is_the_identity_bit_for_bit(name):
    true = recording()
    seen = apply_faults(true, [fault(name, dict(SENSOR_FAULTS[name].neutral))])
    assert touched(name)
    for channel in CHANNELS:
        assert np.array_equal(seen[channel].values, true[channel].values), channel
        assert np.array_equal(seen[channel].t_s, true[channel].t_s), channel


@pytest.mark.parametrize("name", SENSOR_FAULTS)
@DRAWS
@given(data=st.data())
def test_a_fault_gives_finite_numbers_and_touches_only_its_channels(name, data):
    true = recording(data.draw(st.integers(0, 100)))
    values = {p.name: data.draw(st.floats(*p.bounds)) for p in SENSOR_FAULTS[name].params}
    seen = apply_faults(true, [fault(name, values)])
    for channel in CHANNELS:
        assert np.isfinite(seen[channel].values).all()
        assert seen[channel].values.shape == true[channel].values.shape
        assert np.all(np.diff(seen[channel].t_s) > 0.0)
        if channel not in touched(name):
            assert seen[channel] is true[channel]
        elif SENSOR_FAULTS[name].stamps:
            assert seen[channel].values is true[channel].values
        else:
            assert seen[channel].t_s is true[channel].t_s
