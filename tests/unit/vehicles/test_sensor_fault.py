"""Faults of measurement change channels as their equations say."""

import math

import numpy as np
import pytest

from scm.errors import TermError
from scm.vehicles.sensor_fault import AppliedFault, Series, all_sensor_faults, apply_faults

T = np.linspace(2.0, 12.0, 101)


def drive():
    """A left circle of 1 m radius at 0.2 rad/s about (0, 1), seen by everything."""
    yaw = 0.2 * (T - 2.0)
    names = {
        "command.throttle": np.full_like(T, 0.4),
        "pose.x": np.sin(yaw),
        "pose.y": 1.0 - np.cos(yaw),
        "pose.yaw": yaw,
        "encoder.left": 1000.0 * (T - 2.0),
        "encoder.right": 1200.0 * (T - 2.0),
        "wheel_speed.rl": np.full_like(T, 6.0),
        "imu.gyro_z": np.full_like(T, 0.2),
        "imu.accel_x": np.zeros_like(T),
        "imu.accel_y": np.full_like(T, 0.04),
    }
    return {name: Series(T, values) for name, values in names.items()}


def seen(name, channels=(), **values):
    return apply_faults(drive(), [AppliedFault(all_sensor_faults()[name], values, channels)])


def test_a_late_pose_shows_at_its_stamp_where_the_car_was_before():
    pose = seen("pose_latency", delay=0.3)["pose.x"]
    true = drive()["pose.x"]
    now = np.interp(7.0, pose.t_s, pose.values)
    assert now == pytest.approx(np.interp(6.7, true.t_s, true.values), abs=1e-6)


def test_latency_moves_no_stamp_but_the_poses():
    channels = seen("pose_latency", delay=0.3)
    assert np.array_equal(channels["imu.gyro_z"].t_s, T)
    np.testing.assert_allclose(channels["pose.yaw"].t_s, T + 0.3)


def test_a_drifting_clock_agrees_at_the_start_and_gains_by_its_rate():
    pose = seen("clock_drift", rate=0.01)["pose.y"]
    assert pose.t_s[0] == T[0]
    assert pose.t_s[-1] == pytest.approx(T[-1] + 0.1)


def test_a_clock_may_be_that_of_other_channels():
    channels = seen("clock_offset", ("imu.*",), offset=-0.5)
    np.testing.assert_allclose(channels["imu.gyro_z"].t_s, T - 0.5)
    assert np.array_equal(channels["pose.x"].t_s, T)


def test_a_scaled_pose_makes_circles_larger_and_turns_nothing():
    channels = seen("pose_scale", scale=1.1)
    radius = np.hypot(channels["pose.x"].values, channels["pose.y"].values - 1.1)
    np.testing.assert_allclose(radius, 1.1)
    assert channels["pose.yaw"] is not None
    assert np.array_equal(channels["pose.yaw"].values, drive()["pose.yaw"].values)


def test_a_tilted_camera_sees_what_a_pinhole_at_that_angle_sees():
    height, angle = 2.5, 0.04
    x, y = np.array([-1.0, 0.5, 1.2]), np.array([0.3, -0.8, 1.0])
    c, s = math.cos(angle), math.sin(angle)
    depth = height * c + x * s  # along the axis, which leans toward +x
    aside, up = x * c - height * s, y
    taken_x, taken_y = height * aside / depth, height * up / depth
    at_origin = -height * s / c
    at = np.arange(3.0)
    channels = apply_faults(
        {"pose.x": Series(at, x), "pose.y": Series(at, y)},
        [
            AppliedFault(all_sensor_faults()["camera_tilt"], {"tilt_x": math.tan(angle) / height}),
        ],
    )
    np.testing.assert_allclose(channels["pose.x"].values / c**2, taken_x - at_origin, rtol=1e-12)
    np.testing.assert_allclose(channels["pose.y"].values / c, taken_y, rtol=1e-12)


def test_a_marker_ahead_of_the_axle_swings_wide_in_a_circle():
    channels = seen("pose_point", ahead=0.3, aside=0.0)
    radius = np.hypot(channels["pose.x"].values, channels["pose.y"].values - 1.0)
    np.testing.assert_allclose(radius, math.hypot(1.0, 0.3))


def test_a_marker_to_the_left_is_nearer_to_the_middle_of_a_left_circle():
    channels = seen("pose_point", ahead=0.0, aside=0.3)
    radius = np.hypot(channels["pose.x"].values, channels["pose.y"].values - 1.0)
    np.testing.assert_allclose(radius, 0.7)


def test_a_marker_glued_on_at_an_angle_adds_it_to_the_heading():
    np.testing.assert_allclose(
        seen("pose_heading", offset=-0.1)["pose.yaw"].values, drive()["pose.yaw"].values - 0.1
    )


def test_larger_wheels_count_less_for_the_same_way():
    channels = seen("wheel_radius", scale=1.25)
    assert channels["encoder.left"].values[-1] == pytest.approx(8000.0)
    assert channels["wheel_speed.rl"].values[0] == pytest.approx(4.8)


def test_an_encoder_loses_its_share_of_the_counts_on_both_wheels():
    channels = seen("encoder_loss", fraction=0.1)
    assert channels["encoder.left"].values[-1] == pytest.approx(9000.0)
    assert channels["encoder.right"].values[-1] == pytest.approx(10800.0)
    assert np.array_equal(channels["wheel_speed.rl"].values, drive()["wheel_speed.rl"].values)


def test_gyro_faults_add_and_multiply():
    assert seen("gyro_bias", bias=-0.05)["imu.gyro_z"].values[3] == pytest.approx(0.15)
    assert seen("gyro_scale", scale=1.5)["imu.gyro_z"].values[3] == pytest.approx(0.3)


def test_accelerometer_biases_add_along_and_across():
    channels = seen("accel_bias", along=0.1, across=-0.02)
    assert channels["imu.accel_x"].values[0] == pytest.approx(0.1)
    assert channels["imu.accel_y"].values[0] == pytest.approx(0.02)


def test_a_sensor_turned_left_sees_a_leftward_push_partly_as_forward():
    channels = seen("imu_misalignment", angle=math.pi / 6)
    assert channels["imu.accel_x"].values[0] == pytest.approx(0.02)
    assert channels["imu.accel_y"].values[0] == pytest.approx(0.04 * math.cos(math.pi / 6))


def test_a_unit_error_multiplies_the_channel_that_is_named_and_no_other():
    channels = seen("unit_error", ("imu.gyro_z",), factor=180.0 / math.pi)
    assert channels["imu.gyro_z"].values[0] == pytest.approx(math.degrees(0.2))
    assert np.array_equal(channels["pose.yaw"].values, drive()["pose.yaw"].values)


def test_a_unit_error_without_a_channel_is_refused():
    with pytest.raises(TermError, match="unit_error: expected the channels"):
        AppliedFault(all_sensor_faults()["unit_error"], {"factor": 2.0})


def test_an_unknown_parameter_is_refused_with_the_nearest():
    with pytest.raises(TermError, match=r"gyro_bias: no parameter 'bas'.*bias"):
        AppliedFault(all_sensor_faults()["gyro_bias"], {"bas": 0.1})


def test_a_fault_without_its_channel_names_it():
    with pytest.raises(TermError, match=r"pose_point: needs the channel pose\.yaw"):
        apply_faults(
            {"pose.x": drive()["pose.x"]}, [AppliedFault(all_sensor_faults()["pose_point"], {})]
        )


def test_channels_of_other_stamps_are_read_in_between_and_angles_the_short_way():
    yaw = Series(np.array([0.0, 1.0]), np.array([3.0, -3.0]))  # turns left over the seam
    x = Series(np.array([0.5]), np.array([0.0]))
    fault = AppliedFault(all_sensor_faults()["pose_point"], {"ahead": 1.0})
    assert apply_faults({"pose.x": x, "pose.yaw": yaw}, [fault])["pose.x"].values[0] < -0.99


def test_later_faults_see_what_earlier_ones_left():
    scaled = AppliedFault(all_sensor_faults()["gyro_scale"], {"scale": 2.0})
    biased = AppliedFault(all_sensor_faults()["gyro_bias"], {"bias": 0.1})
    assert apply_faults(drive(), [scaled, biased])["imu.gyro_z"].values[0] == pytest.approx(0.5)
    assert apply_faults(drive(), [biased, scaled])["imu.gyro_z"].values[0] == pytest.approx(0.6)


def test_two_faults_of_one_file_act_on_the_same_true_position():
    channels = seen("camera_tilt", tilt_x=0.1, tilt_y=0.2)
    x, y = drive()["pose.x"].values, drive()["pose.y"].values
    depth = 1.0 + 0.1 * x + 0.2 * y
    np.testing.assert_allclose(channels["pose.x"].values, x / depth)
    np.testing.assert_allclose(channels["pose.y"].values, y / depth)
