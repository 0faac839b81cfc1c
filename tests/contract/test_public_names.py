"""The library offers exactly the effects and parameters that reports promise by name."""

import pytest

from scm.vehicles.car import all_terms
from scm.vehicles.sensor_fault import all_sensor_faults
from scm.vehicles.term import flat

PUBLIC = {
    "drive_delay": {"delay_s"},
    "drive_lag": {"time_constant_s"},
    "drive_deadband": {"threshold"},
    "drive_gain": {"gain"},
    "drive_asymmetry": {"difference"},
    "battery_sag": {"fraction_per_min"},
    "motor_fade": {"fraction"},
    "rolling_resistance": {"coefficient"},
    "viscous_drag": {"coefficient"},
    "aero_drag": {"coefficient"},
    "stiction": {"torque_nm"},
    "payload": {"mass_kg"},
    "grade": {"slope", "uphill_rad"},
    "surface_patch": {"x_m", "y_m", "radius_m", "grip", "rolling"},
    "steer_trim": {"offset_rad"},
    "steer_gain": {"gain"},
    "steer_saturation": {"left", "right"},
    "steer_backlash": {"width_rad"},
    "steer_delay": {"delay_s"},
    "steer_lag": {"time_constant_s"},
    "steer_rate": {"scale"},
    "steer_compliance": {"rad_per_weight"},
    "tyre_stiffness": {"scale"},
    "tyre_grip": {"scale"},
    "tyre_relaxation": {"length_m"},
    "understeer": {"gradient"},
    "com_shift": {"shift_m"},
    "load_transfer": {"height_m"},
    "corner_drag": {"coefficient"},
    "wind": {"force_x_n", "force_y_n"},
    "pose_latency": {"delay_s"},
    "pose_scale": {"scale"},
    "camera_tilt": {"tilt_x", "tilt_y"},
    "camera_lens": {"per_x", "per_y", "per_square"},
    "pose_point": {"x_m", "y_m"},
    "pose_heading": {"offset_rad"},
    "wheel_radius": {"scale"},
    "encoder_loss": {"fraction"},
    "gyro_bias": {"bias_rad_s"},
    "gyro_scale": {"scale"},
    "speed_scale": {"scale"},
    "accel_bias": {"x_mps2", "y_mps2"},
    "imu_misalignment": {"angle_rad"},
    "clock_offset": {"offset_s"},
    "clock_drift": {"rate"},
    "unit_error": {"factor"},
}
MEASURED = [name for name in PUBLIC if name in all_sensor_faults()]


def params_of(name):
    if name in all_sensor_faults():
        return all_sensor_faults()[name].params
    return [param for term in flat([all_terms()[name]]) for param in term.params]


@pytest.mark.parametrize("name", PUBLIC)
def test_an_effect_has_exactly_the_parameters_that_reports_name(name):
    borrowed = {
        p.key for term in all_terms().values() if term.name not in PUBLIC for p in term.params
    }
    own = [param for param in params_of(name) if param.fit and param.key not in borrowed]
    assert {param.reported for param in own} == PUBLIC[name]


@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_effect_can_be_switched_off(name):
    effect = all_sensor_faults()[name] if name in all_sensor_faults() else all_terms()[name]
    assert effect.neutral


def test_every_fault_of_measurement_is_public():
    assert set(MEASURED) == set(all_sensor_faults())


def test_no_name_means_both_a_physical_effect_and_a_fault_of_measurement():
    assert not set(all_terms()) & set(all_sensor_faults())
