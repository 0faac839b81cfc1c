"""Tiles of cars against the same lines car by car, and against themselves in other company."""

import numpy as np
import pytest

from scm.errors import RunError, TermError
from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.compiler.kernel_file import compile_kernel
from scm.vehicles.fleet import Fleet
from scm.vehicles.vehicle_status import VehicleStatus
from tests.every_effect import car_with


def driving(cars, capacity=None, threads=1):
    """Nigels of different numbers, speeds and commands, some of them on a slope."""
    fleet = Fleet(load_car("nigel"), capacity or cars)
    fleet.threads = threads
    for row in range(cars):
        fleet.add(Pose2(0.4 * row, -row, 0.7 * row), speed=0.05 * (row % 5))
        fleet.set_parameter(row, "mass", 2.0 + 0.05 * (row % 9))
        fleet.throttle[row], fleet.steering[row] = 1.0 - 0.3 * (row % 6), 0.9 - 0.4 * (row % 5)
        fleet.floor_slope_x[row] = 0.01 * (row % 4)
    return fleet


def states(fleet):
    return fleet._block[:, : fleet.capacity]


def test_tiles_and_the_loop_over_cars_agree_but_for_fused_rounding():
    tiles, cars = driving(21), driving(21)
    cars._kernel = compile_kernel(cars.car.terms, plain=True)
    for fleet in (tiles, cars):
        for _ in range(20):
            fleet.advance(0.05)
    # the skeleton's products are rounded together with their sums: 1e-16 each, over 1000 substeps
    np.testing.assert_allclose(states(tiles), states(cars), atol=1e-10)
    assert np.ptp(tiles.x - cars.x) < 1e-12
    assert tiles.speed.max() > 0.2


@pytest.mark.parametrize("cars", [1, 15, 16, 17, 40])
def test_a_car_does_not_feel_who_else_is_in_its_tile(cars):
    together, alone = driving(cars), driving(cars)
    together.advance(0.5)
    for row in range(cars):
        alone.advance_rows(row, row + 1, 0.5)
    assert np.array_equal(states(together), states(alone))


def test_two_threads_do_what_one_does_bit_for_bit():
    one, two = driving(300), driving(300, threads=2)
    for fleet in (one, two):
        for _ in range(5):
            fleet.advance(0.02)
    assert np.array_equal(states(one), states(two))


def test_a_lane_without_sense_poisons_no_other():
    ill, well = driving(16), driving(16)
    ill.parameters[3] = np.nan
    ill.throttle[7] = np.nan
    ill.remove(11)
    for fleet in (ill, well):
        fleet.advance(0.3)
    others = [row for row in range(16) if row not in {3, 7, 11}]
    assert np.array_equal(states(ill)[:, others], states(well)[:, others])
    assert list(np.flatnonzero(ill.status)) == [3, 7]


def test_a_car_on_its_side_is_marked_as_rolled():
    fleet = driving(2)
    fleet._set(1, "roll", 1.6)
    fleet.advance(0.0)
    assert list(fleet.status) == [VehicleStatus.OK, VehicleStatus.ROLLED]


def test_floor_and_air_of_a_level_hall_change_no_bit():
    told, untold = driving(5), driving(5)
    for fleet in (told, untold):
        fleet.floor_slope_x[:] = 0.0
    told.floor_height[:] = 0.0
    told.floor_slope_y[:] = 0.0
    told.floor_grip[:] = 1.0
    told.floor_rolling[:] = 0.0
    told.air_x[:] = told.air_y[:] = 0.0
    for fleet in (told, untold):
        fleet.advance(0.5)
    assert np.array_equal(states(told), states(untold))


def test_a_rollout_is_the_recording_driven_step_by_step():
    batch, single = driving(20), driving(20)
    rng = np.random.default_rng(3)
    throttle, steering = rng.uniform(-1, 1, 30), rng.uniform(-1, 1, (30, 20))
    out = batch.rollout(throttle, steering, 0.02, ("x", "yaw", "speed"))
    for t in range(30):
        single.throttle[:], single.steering[:] = throttle[t], steering[t]
        single.advance(0.02)
        for name, values in out.items():
            assert np.array_equal(values[t], getattr(single, name)), (name, t)


def test_a_rollout_refuses_what_does_not_fit():
    fleet = driving(3)
    with pytest.raises(RunError, match=r"commands of shape \(5, 2\): expected \(T,\) or \(T, 3\)"):
        fleet.rollout(np.zeros((5, 2)), np.zeros(5), 0.02)
    with pytest.raises(RunError, match=r"'sped' is no variable of each car.* 'speed'"):
        fleet.rollout(np.zeros(5), np.zeros(5), 0.02, ("sped",))
    with pytest.raises(RunError, match="5 throttles and 4 steerings"):
        fleet.rollout(np.zeros(5), np.zeros(4), 0.02)


def test_many_pushes_at_once_are_many_pushes():
    once, each = driving(40), driving(40)
    rows = np.array([3, 17, 39])
    changes = np.random.default_rng(1).normal(0.0, 0.01, (3, 6))
    changes[1, 0] = np.nan
    once.push_rows(rows, changes)
    for row, change in zip(rows, changes, strict=True):
        each.push(int(row), *change)
    assert np.array_equal(states(once), states(each))
    assert np.array_equal(once.status, each.status)
    assert once.status[17] == VehicleStatus.DIVERGED


@pytest.mark.parametrize("row", [-1, 3])
def test_a_row_that_does_not_exist_is_refused(row):
    fleet = driving(3)
    for call in (fleet.remove, lambda r: fleet.place(r, Pose2(0.0, 0.0, 0.0))):
        with pytest.raises(RunError, match=f"no row {row}, expected 0 to 2"):
            call(row)


@pytest.mark.parametrize("bad", [(-0.1, 1e-3), (0.1, 0.0), (float("nan"), 1e-3)])
def test_time_only_goes_forward(bad):
    with pytest.raises(RunError, match="expected a duration, and a substep above 0"):
        driving(1).advance(*bad)


@pytest.mark.parametrize("value", [0.0, 5001.0, float("nan"), float("inf")])
def test_a_number_outside_its_bounds_is_refused(value):
    with pytest.raises(TermError, match=r"body.mass_kg = .*: expected 0.2 to 5000 kg"):
        driving(1).set_parameter(0, "mass", value)


def late(delay_s, call_s=0.01):
    fleet = Fleet(car_with(["drive_delay", "steer_delay"]), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.set_parameter(0, "drive.delay_s", delay_s)
    fleet.throttle[0] = 1.0
    seen = []
    for _ in range(round(0.3 / call_s)):
        fleet.advance(call_s)
        seen.append(fleet._view("throttle_past")[0])
    return fleet, np.array(seen)


def test_a_delayed_command_arrives_later_and_no_different():
    assert list(late(0.0)[1][:3]) == [1.0, 1.0, 1.0]
    seen = late(0.1)[1]
    np.testing.assert_allclose(seen, np.arange(30) >= 10, atol=1e-12)
    # between two calls the mean over the call: smooth in the delay
    np.testing.assert_allclose(late(0.104)[1][9:13], [0.0, 0.6, 1.0, 1.0], atol=1e-12)


def test_no_delay_leaves_the_trajectory_bit_for_bit():
    fleet, _ = late(0.0)
    plain = driving(1)
    plain.set_parameter(0, "mass", 2.4)
    plain.place(0, Pose2(0.0, 0.0, 0.0))
    plain.throttle[0] = 1.0
    for _ in range(30):
        plain.advance(0.01)
    for name in ("x", "y", "yaw", "speed", "wheel_speed"):
        assert np.array_equal(getattr(fleet, name), getattr(plain, name)), name


def test_a_car_stays_small():
    assert Fleet(load_car("nigel"), 1600).bytes_per_car < 2048


def test_a_car_that_freezes_between_kept_steps_is_left_as_it_was_step_by_step():
    seldom, often = driving(20), driving(20)
    rng = np.random.default_rng(5)
    throttle, steering = rng.uniform(-1, 1, (60, 32)), rng.uniform(-1, 1, (60, 32))
    steering[13:, 4] = steering[27, 18] = np.nan
    slots = np.array([seldom._offset_of(name) for name in ("x", "yaw", "speed", "steering")])
    kept = {every: np.zeros((60 // every, len(slots), 32)) for every in (1, 10)}
    for fleet, every in ((seldom, 10), (often, 1)):
        fleet._kernel.rollout(
            fleet._block, fleet._numbers, fleet._alive, fleet._status, 0, 20, 3, 1e-3,
            throttle, steering, slots, kept[every],
        )  # fmt: skip
    assert seldom.status[[4, 18]].tolist() == [VehicleStatus.DIVERGED] * 2
    assert np.array_equal(seldom.status, often.status)
    assert np.array_equal(states(seldom), states(often), equal_nan=True)
    assert np.array_equal(kept[10][:, :, :20], kept[1][9::10, :, :20], equal_nan=True)
