"""Each effect between steering command and road wheel does what its equation says."""

import math

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.car import all_terms, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import plain
from tests.every_effect import GENESIS, car_with

LIMIT = 0.5235988


def fleet_with(names, values=None, car="nigel"):
    fleet = Fleet(car_with(names, values, car), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    return fleet


def angles(fleet, steering, step=0.01):
    """Road-wheel angle after each step of a given series of commands."""
    out = []
    for command in steering:
        fleet.steering[0] = command
        fleet.advance(step)
        out.append(float(fleet.steer_angle[0]))
    return np.array(out)


def law(name, **values):
    return plain(all_terms()[name].function)(**values)


def test_a_delayed_steering_turns_the_wheels_as_much_later():
    command = np.r_[np.full(60, 0.6), np.full(60, -0.3)]
    now, late = (
        angles(fleet_with(["steer_delay"], {"steering.delay_s": delay}), command)
        for delay in (0.0, 0.15)
    )
    np.testing.assert_allclose(late[:15], 0.0, atol=1e-9)
    np.testing.assert_allclose(late[15:], now[:-15], atol=1e-9)
    assert np.ptp(late) > 0.2


def test_a_lag_reaches_63_percent_after_its_time_constant():
    fleet = fleet_with(["steer_lag"], {"steering.lag_s": 0.3, "steering.rate_rad_s": 1e6})
    angle = angles(fleet, np.ones(30))
    assert angle[-1] == pytest.approx(LIMIT * (1.0 - math.exp(-1.0)), rel=3e-3)


def test_a_trim_turns_wheels_left_whatever_the_command_even_at_the_stop():
    fleet = fleet_with(["steer_trim"], {"steering.trim_rad": 0.05})
    angle = angles(fleet, np.r_[np.zeros(10), np.ones(400), -np.ones(600)])
    assert angle[9] == pytest.approx(0.05)
    assert angle[409] == pytest.approx(LIMIT + 0.05)
    assert angle[-1] == pytest.approx(-LIMIT + 0.05)


def test_a_gain_multiplies_the_commanded_angle():
    angle = angles(fleet_with(["steer_gain"], {"steering.gain": 1.2}), np.full(200, 0.5))
    assert angle[-1] == pytest.approx(0.6 * LIMIT)


def test_saturation_cuts_left_and_right_each_at_its_own_share():
    values = {"steering.stop_left": 0.5, "steering.stop_right": 0.8}
    fleet = fleet_with(["steer_saturation"], values)
    angle = angles(fleet, np.r_[np.ones(300), np.full(300, 0.4), -np.ones(500)])
    assert angle[299] == pytest.approx(0.5 * LIMIT)
    assert angle[599] == pytest.approx(0.4 * LIMIT)
    assert angle[-1] == pytest.approx(-0.8 * LIMIT)


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_a_rate_scale_multiplies_the_speed_of_the_servo(scale):
    angle = angles(fleet_with(["steer_rate"], {"steering.rate_scale": scale}), np.ones(20))
    assert angle[-1] == pytest.approx(scale * 0.42 * 0.2)


def test_backlash_opens_a_loop_as_wide_as_the_play():
    width = 0.08
    values = {"steering.backlash_rad": width, "steering.rate_rad_s": 1e6}
    fleet = fleet_with(["steer_backlash"], values)
    up, down = np.linspace(-1.0, 1.0, 200), np.linspace(1.0, -1.0, 200)
    angles(fleet, np.r_[np.zeros(1), -np.ones(1)])
    going_up, going_down = angles(fleet, up), angles(fleet, down)
    middle = np.interp(0.0, up, going_up), np.interp(0.0, up, going_down[::-1])
    assert middle[1] - middle[0] == pytest.approx(width, rel=1e-6)
    assert going_up.max() == pytest.approx(LIMIT - width / 2)
    small = angles(fleet, 0.5 + 0.9 * (width / 2 / LIMIT) * np.sin(np.linspace(0.0, 30.0, 100)))
    assert np.ptp(small[40:]) == 0.0  # within the play nothing moves


def test_servo_torque_slows_a_servo_in_proportion_and_stalls_it():
    fleet = fleet_with(["servo_torque"])
    numbers = {"mass": 2.4, "cog_to_rear_axle": 0.07, "yaw_inertia": 0.02, "wheelbase": 0.14}
    # 1.2 N on the front axle at 10 mm is 12 mN*m
    pace = law("servo_torque", accel_y=1.0, yaw_accel=0.0, trail=0.01, stall=0.048, **numbers)
    assert pace == pytest.approx(0.75)
    assert law("servo_torque", accel_y=9.0, yaw_accel=0.0, trail=0.01, stall=0.048, **numbers) == 0
    assert angles(fleet, np.ones(20))[-1] == pytest.approx(0.42 * 0.2, rel=1e-3)  # at rest


def settled_circle(names, values):
    """Steer angle and front side force over weight of the fast car in a steady circle."""
    fleet = fleet_with(names, values, "f1tenth")
    fleet.throttle[0], fleet.steering[0] = 0.35, 0.4
    fleet.advance(4.0)
    car = load_car("f1tenth")
    share = car.value("body.cog_to_rear_axle_m") / car.value("body.wheelbase_m")
    force = share * float(fleet.accel_y[0]) / 9.80665
    wiggle = []
    for _ in range(50):
        fleet.advance(1e-3)
        wiggle.append(float(fleet.steer_angle[0]))
    return float(fleet.steer_angle[0]), force, np.ptp(wiggle)


def test_compliance_gives_way_by_side_force_over_weight_and_stands_still():
    stiff, _, _ = settled_circle([], {})
    soft, force, wiggle = settled_circle(["steer_compliance"], {"steering.compliance_rad": 0.2})
    assert force > 0.05
    assert stiff - soft == pytest.approx(0.2 * force, rel=0.02)
    assert wiggle < 1e-3


def test_the_softest_steering_inside_its_bounds_does_not_chatter():
    _, _, wiggle = settled_circle(["steer_compliance"], {"steering.compliance_rad": 1.0})
    assert wiggle < 2e-3


def test_wheels_that_give_way_follow_the_servo_at_once():
    leaps = np.r_[np.ones(30), -np.ones(60)]
    stiff = angles(fleet_with([]), leaps)
    soft = angles(fleet_with(["steer_compliance"], {"steering.compliance_rad": 0.2}), leaps)
    np.testing.assert_allclose(soft, stiff, rtol=0.0, atol=1e-12)  # at rest no force on them


def test_wheels_have_given_way_by_63_percent_after_a_millisecond():
    yielded, dt = 0.0, 1e-5
    for _ in range(100):
        yielded = law(
            "steer_compliance", steer_trimmed=0.0, steer_before=-yielded, steer_yielded=yielded,
            accel_y=9.80665, yaw_accel=0.0, vx=3.0, mass=2.0, cog_to_rear_axle=0.1,
            yaw_inertia=0.02, wheelbase=0.2, rad_per_weight=0.2, dt=dt,
        )  # fmt: skip
    assert yielded == pytest.approx(0.2 * 0.5 * (1.0 - math.exp(-1.0)), rel=0.03)


@pytest.mark.parametrize("car", ["nigel", "f1tenth", GENESIS])
@pytest.mark.parametrize("substep", [1e-3, 2e-3, 5e-3])
def test_no_steering_chatters_whatever_it_gives_way_and_however_long_a_substep(car, substep):
    full_size = car == GENESIS
    soft = (0.0, 0.02, 0.1, 0.2, 0.5, 1.0)
    fleet = Fleet(car_with(["steer_compliance"], base=car), len(soft))
    for row, give in enumerate(soft):
        fleet.add(Pose2(0.0, 0.0, 0.0), speed=15.0 if full_size else 0.2)
        fleet.set_parameter(row, "steering.compliance_rad", give)
    fleet.throttle[:] = 0.15 if full_size else 0.35
    trembling = []
    for steering in (0.25, -0.25):
        fleet.steering[:] = steering * (0.3 if full_size else 1.0)
        fleet.advance(3.0, substep)
        angle = []
        for _ in range(100):
            fleet.advance(substep, substep)
            angle.append(fleet.steer_angle.copy())
        trembling.append(np.abs(np.diff(angle, 2, axis=0)).max(axis=0))
    assert np.max(trembling) < 1e-5


def test_a_command_beyond_every_linkage_still_turns_the_car_its_way():
    numbers = {"steering.limit_rad": 1.2, "steering.gain": 2.0, "steering.rate_rad_s": 1e6}
    fleet = fleet_with(["steer_gain"], numbers)
    fleet.throttle[0], fleet.steering[0] = 0.5, 1.0
    fleet.advance(2.0)
    assert fleet.steer_angle[0] == pytest.approx(2.4)  # asked for; the wheels end at 1.2 rad
    assert fleet.yaw_rate[0] > 1.0
