import math

import numpy as np
import pytest

from scm.errors import RunError, TermError
from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.vehicle_status import VehicleStatus


@pytest.fixture
def fleet():
    return Fleet(load_car("nigel"), 3)


def test_a_car_stands_with_its_rear_axle_where_it_was_put(fleet):
    row = fleet.add(Pose2(1.0, -2.0, 2.0))
    assert fleet.pose(row) == pytest.approx((1.0, -2.0, 2.0))
    x, y, yaw, vx, vy, rate = fleet.planar_cog(row)
    cog = fleet.car.value("body.cog_to_rear_axle_m")
    assert (x, y) == pytest.approx((1.0 + cog * math.cos(2.0), -2.0 + cog * math.sin(2.0)))
    assert (yaw, vx, vy, rate) == (2.0, 0.0, 0.0, 0.0)


def test_a_car_put_down_rolling_keeps_rolling(fleet):
    row = fleet.add(Pose2(0.0, 0.0, 1.0), speed=0.2)
    assert fleet.speed[row] == pytest.approx(0.2)
    np.testing.assert_allclose(fleet.wheel_speed[row], 0.2 / 0.0325)
    fleet.throttle[row] = 0.727  # about the throttle of 0.2 m/s
    fleet.advance(0.1)
    assert fleet.speed[row] == pytest.approx(0.2, rel=0.01)


def test_a_row_restarts_from_a_measured_state(fleet):
    row = fleet.add(Pose2(9.0, 9.0, 0.0))
    fleet.place(row, Pose2(0.5, 0.2, -1.0), 0.25, 0.01, 0.4, steer_angle=0.2)
    assert fleet.pose(row) == pytest.approx((0.5, 0.2, -1.0))
    assert fleet.speed[row] == pytest.approx(0.25)
    assert fleet.lateral_speed[row] == pytest.approx(0.01)
    assert fleet.yaw_rate[row] == 0.4
    assert fleet.steer_angle[row] == 0.2


@pytest.mark.parametrize("car", ["nigel", "dart"])
def test_rows_placed_at_once_stand_and_drive_on_as_if_placed_one_by_one(car):
    """Twenty rows, more than a tile, with payloads; those between stay where they were."""
    poses = np.random.default_rng(1).uniform(-3.0, 3.0, (20, 3))
    speeds, rows = np.linspace(0.0, 0.5, 20), np.arange(0, 40, 2)
    once, one_by_one, reverse = (
        Fleet(load_car(car).with_terms(["payload", "drive_delay"], {"drive.delay_s": 0.03}), 41)
        for _ in range(3)
    )
    for fleet in (once, one_by_one, reverse):
        for _ in range(41):
            fleet.add(Pose2(0.0, 0.0, 0.5), 0.3)
        fleet.parameters[:, fleet.parameter_names.index("payload.mass")] = np.linspace(0, 1, 41)
        fleet.throttle[:], fleet.steering[:] = 0.4, 0.2
        fleet.advance(0.2)
    once.place_rows(rows, poses, speeds)
    reverse.place_rows(rows[::-1], poses[::-1], speeds[::-1])
    for row, pose, speed in zip(rows, poses, speeds, strict=True):
        one_by_one.place(row, Pose2(*pose.tolist()), float(speed))
    for fleet in (once, one_by_one, reverse):
        fleet.throttle[:], fleet.steering[:] = 0.5, -0.3
        fleet.advance(0.3)
    for name in ("x", "y", "yaw", "speed", "yaw_rate", "wheel_load", "steer_angle", "time"):
        np.testing.assert_allclose(getattr(once, name), getattr(one_by_one, name), atol=1e-12)
        assert np.array_equal(getattr(once, name), getattr(reverse, name))


def test_lags_restart_settled():
    fleet = Fleet(load_car("dart"), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.place(0, Pose2(0.0, 0.0, 0.0), 1.0, steer_angle=0.2, throttle=0.5)
    fleet.throttle[0] = 0.5
    fleet.advance(1e-3)
    assert fleet.steer_angle[0] == pytest.approx(0.2, abs=0.003)
    assert fleet.accel_x[0] > 0.0


def test_rows_are_used_again_and_a_full_fleet_says_so(fleet):
    rows = [fleet.add(Pose2(float(i), 0.0, 0.0)) for i in range(3)]
    with pytest.raises(RunError, match="all 3 rows are in use"):
        fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.remove(rows[1])
    assert list(fleet.alive) == [True, False, True]
    assert fleet.add(Pose2(7.0, 0.0, 0.0)) == rows[1]
    assert fleet.x[rows[1]] == pytest.approx(7.0)


def test_a_new_car_does_not_inherit_the_numbers_of_the_last_one(fleet):
    row = fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.set_parameter(row, "mass", 5.0)
    fleet.remove(row)
    assert fleet.add(Pose2(0.0, 0.0, 0.0)) == row
    assert fleet.parameters[row, fleet.parameter_names.index("mass")] == 2.4


def test_each_row_may_have_its_own_parameters(fleet):
    for row in range(2):
        fleet.throttle[fleet.add(Pose2(0.0, float(row), 0.0))] = 1.0
    fleet.set_parameter(0, "stall_torque", 0.2)
    fleet.set_parameter(1, "drive.stall_torque_nm", 0.4)
    fleet.advance(1.0)
    assert fleet.speed[0] < fleet.speed[1]


def test_an_unknown_parameter_is_refused_with_the_nearest_name(fleet):
    with pytest.raises(TermError, match=r"no parameter 'stal_torque' .* mean 'stall_torque'"):
        fleet.set_parameter(0, "stal_torque", 1.0)


def test_results_cannot_be_written_and_commands_can(fleet):
    fleet.throttle[0] = 0.5
    with pytest.raises(ValueError, match="read-only"):
        fleet.x[0] = 1.0


def test_yaw_stays_wrapped_while_the_car_circles(fleet):
    row = fleet.add(Pose2(0.0, 0.0, 3.0))
    fleet.throttle[row], fleet.steering[row] = 1.0, 1.0
    for _ in range(40):
        fleet.advance(0.5)
        assert -math.pi < fleet.yaw[row] <= math.pi


def test_a_weak_battery_slows_the_car(fleet):
    for row in range(2):
        fleet.throttle[fleet.add(Pose2(0.0, float(row), 0.0))] = 1.0
    fleet.battery[1] = 0.8 * fleet.battery[0]
    fleet.advance(2.0)
    assert fleet.speed[1] < 0.9 * fleet.speed[0]


@pytest.mark.parametrize("wild", [(5.0, 3.0), (-5.0, -3.0), (math.inf, -math.inf)])
def test_commands_beyond_full_count_as_full(fleet, wild):
    full = np.clip(wild, -1.0, 1.0)
    for command in (wild, full):
        row = fleet.add(Pose2(0.0, 0.0, 0.0))
        fleet.throttle[row], fleet.steering[row] = command
    fleet.advance(2.0)
    assert fleet.pose(0) == fleet.pose(1)
    assert list(fleet.status[:2]) == [0, 0]


@pytest.mark.parametrize("command", [(math.nan, 0.0), (0.5, math.nan)])
def test_a_command_that_is_no_number_freezes_the_car_with_every_output_as_it_was(fleet, command):
    row = fleet.add(Pose2(0.0, 0.0, 0.0), speed=0.1)
    fleet.throttle[row], fleet.steering[row] = 0.5, 0.3
    fleet.advance(0.2)
    kept = ("x", "y", "yaw", "roll", "steer_angle", "wheel_angle", "wheel_steer", "wheel_load")
    before = {name: getattr(fleet, name)[row].copy() for name in kept}
    fleet.throttle[row], fleet.steering[row] = command
    fleet.advance(0.2)
    assert fleet.status[row] == VehicleStatus.DIVERGED
    for name, value in before.items():
        assert np.array_equal(getattr(fleet, name)[row], value), name
    for name in ("speed", "yaw_rate", "wheel_speed", "accel_x", "accel_y", "accel_z", "yaw_accel"):
        assert not np.any(getattr(fleet, name)[row]), name


@pytest.mark.parametrize("bad", [(0.0, 0.0, 0.0, math.nan), (math.inf,), (0.0, math.nan)])
def test_a_push_that_is_no_number_freezes_the_car_where_it_is(fleet, bad):
    row = fleet.add(Pose2(1.0, 2.0, 0.5), speed=0.1)
    before = fleet.planar_cog(row)
    fleet.push(row, *bad, *[0.0] * (3 - len(bad)))
    assert fleet.planar_cog(row) == before
    assert fleet.status[row] == VehicleStatus.DIVERGED
    fleet.advance(0.1)
    assert fleet.pose(row) == pytest.approx((1.0, 2.0, 0.5))


def test_a_car_put_where_no_number_is_counts_as_diverged(fleet):
    row = fleet.add(Pose2(math.nan, 0.0, 0.0))
    assert fleet.status[row] == VehicleStatus.DIVERGED


def test_every_status_has_a_sentence():
    assert all(status.sentence.endswith(".") for status in VehicleStatus)


def test_many_centres_of_gravity_are_read_at_once(fleet):
    for row in range(3):
        fleet.add(Pose2(float(row), 2.0, 0.3 * row), speed=0.1)
    together = fleet.planar_cogs(np.array([2, 0]))
    np.testing.assert_array_equal(together, [fleet.planar_cog(2), fleet.planar_cog(0)])


def test_yaw_acceleration_is_the_change_of_yaw_rate(fleet):
    row = fleet.add(Pose2(0.0, 0.0, 0.0), speed=0.2)
    fleet.throttle[row], fleet.steering[row] = 0.7, 1.0
    fleet.advance(0.3)
    before = float(fleet.yaw_rate[row])
    fleet.advance(1e-3)
    assert fleet.yaw_accel[row] == pytest.approx((fleet.yaw_rate[row] - before) / 1e-3, rel=1e-9)
    assert fleet.yaw_accel[row] > 0.0


def test_a_row_restarts_elsewhere_with_its_actuators_as_they_were():
    fleet = Fleet(load_car("dart"), 2)
    rows = [fleet.add(Pose2(0.0, 0.0, 0.0), 1.0) for _ in range(2)]
    fleet.throttle[:], fleet.steering[:] = 0.4, 0.8
    fleet.advance(0.05)
    turned = fleet.steer_angle[0]
    assert turned > 0.05
    fleet.place(rows[0], Pose2(3.0, 1.0, 0.5), 1.0, keep_actuators=True)
    fleet.place(rows[1], Pose2(3.0, 1.0, 0.5), 1.0)
    assert fleet.steer_angle[0] == turned
    assert fleet.steer_angle[1] == 0.0
    fleet.throttle[:] = 0.4
    fleet.advance(0.002)
    assert fleet.speed[0] > fleet.speed[1]  # its throttle lag was already filled


def test_a_row_restarts_with_a_measured_steering_angle_and_its_lags_as_they_were():
    fleet = Fleet(load_car("dart"), 4)
    rows = [fleet.add(Pose2(0.0, 0.0, 0.0), 1.0) for _ in range(2)]
    fleet.throttle[:], fleet.steering[:] = 0.4, 0.8
    fleet.advance(0.05)
    fleet.place(rows[0], Pose2(0.0, 0.0, 0.0), 1.0, steer_angle=-0.1, keep_actuators=True)
    fleet.place(rows[1], Pose2(0.0, 0.0, 0.0), 1.0, steer_angle=-0.1)
    assert fleet.steer_angle[0] == fleet.steer_angle[1] == -0.1
    fleet.throttle[:] = 0.4
    fleet.advance(0.002)
    assert fleet.speed[0] > fleet.speed[1]
    fleet.copy_row(rows[0], slice(2, 4))
    assert fleet.speed[2] == fleet.speed[3] == fleet.speed[0]
    assert fleet.alive[2:].all()


def test_a_rollout_in_steps_of_no_whole_substeps_is_refused_with_the_nearest_that_fit(fleet):
    words = r"steps of 0\.005 s .* substeps of 0\.002 s: .* steps of 0\.004 s or 0\.006 s, or"
    with pytest.raises(RunError, match=words + r" substeps of 0\.0025 s"):
        fleet.rollout(np.zeros(3), np.zeros(3), 0.005, substep=0.002)


@pytest.mark.parametrize(("step_s", "substep"), [(0.3, 0.001), (0.005, 0.0025), (0.7, 0.001)])
def test_steps_that_are_whole_but_for_the_last_bit_are_driven(fleet, step_s, substep):
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.rollout(np.zeros(1), np.zeros(1), step_s, substep=substep)
    np.testing.assert_allclose(fleet.time[0], step_s, rtol=1e-9)
