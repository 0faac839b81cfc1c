"""Each effect between throttle command and wheel does what its equation says."""

import math

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.car import all_terms, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import plain
from scm.vehicles.lipo import cell_voltage, loaded_voltage, pack_current
from tests.every_effect import GENESIS, car_with

BATTERY = ["battery_charge", "battery_curve", "battery_resistance"]


def fleet_with(names, values=None, throttle=1.0):
    fleet = Fleet(car_with(names, values), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.throttle[0] = throttle
    return fleet


def speeds(fleet, seconds, step=0.01):
    out = []
    for _ in range(round(seconds / step)):
        fleet.advance(step)
        out.append(float(fleet.speed[0]))
    return np.array(out)


def steady_speed(names=(), values=None, throttle=1.0):
    return speeds(fleet_with(list(names), values, throttle), 4.0)[-1]


def law(name, **values):
    return plain(all_terms()[name].function)(**values)


def test_a_delayed_throttle_moves_the_car_as_much_later():
    now, late = (
        speeds(fleet_with(["drive_delay"], {"drive.delay_s": delay}), 1.0) for delay in (0.0, 0.2)
    )
    assert late[19] == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(late[20:], now[:-20], atol=1e-6)
    assert late[-1] > 0.1


def test_a_lag_reaches_63_percent_after_its_time_constant():
    fleet = fleet_with(["drive_lag"], {"drive.lag_s": 0.2})
    fleet.advance(0.2)
    assert fleet._view("throttle")[0] == pytest.approx(1.0 - math.exp(-1.0), abs=2e-3)


def test_a_soft_start_rises_with_its_time_constant_and_falls_at_once():
    fleet = fleet_with(["drive_soft_start"], {"drive.soft_start_s": 0.2})
    fleet.advance(0.2)
    assert fleet._view("throttle")[0] == pytest.approx(1.0 - math.exp(-1.0), abs=2e-3)
    fleet.throttle[0] = 0.3
    fleet.advance(0.001)
    assert fleet._view("throttle")[0] == pytest.approx(0.3, abs=1e-9)


def test_a_dead_band_eats_small_throttle_and_as_much_of_large():
    band = {"drive.deadband": 0.1}
    assert steady_speed(["drive_deadband"], band, 0.09) == pytest.approx(0.0, abs=1e-6)
    assert steady_speed(["drive_deadband"], band, 0.6) == pytest.approx(
        steady_speed(throttle=0.5), rel=1e-6
    )
    assert steady_speed(["drive_deadband"], band, -0.6) == pytest.approx(
        -steady_speed(throttle=0.5), rel=1e-3
    )


def test_a_drive_gain_acts_like_as_much_more_throttle():
    assert steady_speed(["drive_gain"], {"drive.gain": 0.7}) == pytest.approx(
        steady_speed(throttle=0.7), rel=1e-9
    )


def test_a_motor_gain_slows_the_launch_far_more_than_the_top_speed():
    weak, nominal = (
        speeds(fleet_with(["motor_gain"], {"motor.gain": gain}), 4.0) for gain in (0.5, 1.0)
    )
    assert weak[3] < 0.7 * nominal[3]
    assert weak[-1] > 0.85 * nominal[-1]


@pytest.mark.parametrize("throttle", [0.8, -0.8])
def test_a_stronger_left_motor_turns_the_car_right_forward_and_left_in_reverse(throttle):
    fleet = fleet_with(["drive_asymmetry"], {"drive.asymmetry": 0.2}, throttle)
    fleet.advance(2.0)
    assert math.copysign(1.0, fleet.yaw[0]) == -math.copysign(1.0, throttle)
    assert abs(fleet.yaw[0]) > 0.003


def test_a_sagging_battery_takes_its_share_every_minute():
    fleet = fleet_with(["battery_sag"], {"drive.sag_per_min": 0.2})
    fleet.advance(3.0)
    fleet.time[0] = 60.0
    fleet.advance(3.0)
    # 63 s: a fifth and a hundredth of the voltage is gone, as with so much less throttle
    assert fleet.speed[0] == pytest.approx(steady_speed(throttle=1.0 - 0.2 * 63 / 60), rel=2e-3)


def test_an_empty_battery_pushes_no_car_back():
    fleet = fleet_with(["battery_sag"], {"drive.sag_per_min": 0.6})
    fleet.time[0] = 600.0
    fleet.advance(2.0)
    assert fleet.speed[0] == pytest.approx(0.0, abs=1e-9)


def test_a_cell_falls_from_full_to_empty_without_ever_rising():
    charge = np.linspace(-0.1, 1.1, 500)
    volts = np.array([plain(cell_voltage)(c) for c in charge])
    assert np.all(np.diff(volts) >= 0.0)
    assert volts[0] == pytest.approx(3.27)
    assert volts[-1] == pytest.approx(4.20)
    assert plain(cell_voltage)(0.5) == pytest.approx(3.84)
    assert plain(cell_voltage)(0.1) == pytest.approx(3.69)


def test_the_loaded_voltage_is_the_open_one_less_resistance_times_the_current():
    volts = plain(loaded_voltage)(11.8, 0.2, 0.8, 0.3, 6.0, 1.0, 11.1)
    amperes = plain(pack_current)(volts, 0.8, 0.3, 6.0, 1.0, 11.1)
    assert amperes > 3.0
    assert volts == pytest.approx(11.8 - 0.2 * amperes, rel=1e-12)


def test_braking_motors_give_nothing_back():
    volts = plain(loaded_voltage)(11.8, 0.2, 0.2, 0.9, 6.0, 1.0, 11.1)
    assert volts == pytest.approx(11.8 - 0.2)
    assert plain(pack_current)(volts, 0.2, 0.9, 6.0, 1.0, 11.1) == 1.0


def test_a_battery_sags_under_the_launch_and_recovers_at_speed():
    values = {"battery.resistance_ohm": 0.5, "battery.stall_current_a": 3.0}
    soft, stiff = (
        fleet_with(BATTERY, values | {"battery.resistance_ohm": ohm}) for ohm in (0.5, 0.0)
    )
    soft.advance(0.02)
    stiff.advance(0.02)
    early = soft.speed[0] / stiff.speed[0]
    soft.advance(3.0)
    stiff.advance(3.0)
    late = soft.speed[0] / stiff.speed[0]
    assert early < 0.85
    assert 0.93 < late < 0.99


def test_the_charge_drawn_is_the_current_over_time():
    values = {"battery.stall_current_a": 0.0, "battery.idle_current_a": 2.0}
    fleet = fleet_with(BATTERY, values)
    fleet.advance(5.0)
    assert fleet._view("charge_drawn")[0] == pytest.approx(10.0, rel=1e-9)


def test_a_car_at_stall_draws_its_motors_stall_current():
    values = {
        "battery.stall_current_a": 2.0, "battery.idle_current_a": 0.5, "battery.start_charge": 0.1,
        "battery.resistance_ohm": 0.0, "drive.coulomb_torque_nm": 5.0,
    }  # fmt: skip
    fleet = fleet_with(BATTERY, values)
    fleet.advance(1.0)
    assert abs(fleet.speed[0]) < 1e-3
    amperes = 0.5 + 2 * 2.0 * 3 * 3.69 / 11.1
    assert fleet._view("charge_drawn")[0] == pytest.approx(amperes, rel=1e-3)


def test_a_nearly_empty_battery_is_slower_than_a_full_one():
    full, empty = (steady_speed(BATTERY, {"battery.start_charge": c}) for c in (1.0, 0.05))
    assert empty / full == pytest.approx(3.61 / 4.2, rel=0.03)


def test_a_motor_fades_under_load_and_comes_back_at_rest():
    fleet = fleet_with(["motor_fade"], {"drive.fade": 0.3, "drive.fade_time_s": 2.0}, 0.7)
    strength = fleet._view("fade_strength")
    fleet.advance(20.0)
    # steady: s = 1 - 3 f (s u)^2
    a = 3 * 0.3 * 0.49
    assert strength[0, 2] == pytest.approx((math.sqrt(1 + 4 * a) - 1) / (2 * a), rel=1e-4)
    fleet.throttle[0] = 0.0
    fleet.advance(2.0)
    assert 1.0 - strength[0, 2] == pytest.approx(
        math.exp(-1) * (1 - (math.sqrt(1 + 4 * a) - 1) / (2 * a)), rel=1e-2
    )


def test_a_stalled_motor_warms_to_where_cooling_equals_loss_and_weakens():
    values = {
        "motor.stall_heat_w": 10.0, "motor.cooling_w_k": 0.2, "motor.thermal_mass_j_k": 0.4,
        "motor.weakening_per_k": 0.004, "drive.coulomb_torque_nm": 5.0,
    }  # fmt: skip
    fleet = fleet_with(["motor_heating", "motor_warmth"], values, 0.5)
    heat = fleet._view("motor_heat")
    fleet.advance(2.0)
    assert heat[0, 2] == pytest.approx((1 - math.exp(-1)) * 10.0 * 0.25 / 0.2, rel=1e-2)
    assert heat[0, 0] == 0.0  # front wheels have no motor
    fleet.advance(30.0)
    assert heat[0, 2] == pytest.approx(12.5, rel=1e-4)
    fleet.throttle[0] = 0.0
    fleet.advance(2.0)
    assert heat[0, 2] == pytest.approx(12.5 * math.exp(-1), rel=1e-2)
    assert law("motor_warmth", motor_heat=50.0, weakening=0.004) == pytest.approx(1 / 1.2)


def test_heat_never_falls_below_the_air_whatever_the_step():
    cold = law(
        "motor_heating", motor_heat=100.0, motor_throttle=0.0, fade_strength=1.0,
        supply_voltage=11.1, axle_omega=0.0, driven=1.0, no_load_speed=9.0, battery_nominal=11.1,
        stall_heat=10.0, cooling=50.0, thermal_mass=0.1, dt=2e-3,
    )  # fmt: skip
    assert 0.0 < cold < 100.0


def test_stiction_holds_a_car_that_it_lets_roll_once_it_turns():
    values = {"drive.stiction_torque_nm": 0.1}
    held = fleet_with(["stiction"], values, throttle=0.3)
    held.advance(1.0)
    assert abs(held.speed[0]) < 1e-4
    rolling = fleet_with(["stiction"], values, throttle=0.3)
    rolling.place(0, Pose2(0.0, 0.0, 0.0), speed=0.08)
    rolling.throttle[0] = 0.3
    rolling.advance(2.0)
    assert rolling.speed[0] == pytest.approx(steady_speed(throttle=0.3), rel=1e-3)


@pytest.mark.parametrize("name", ["nigel", "f1tenth"])
def test_no_motor_gives_more_than_it_takes_from_the_battery(name):
    car = load_car(name).with_terms(["battery_charge", "motor_heating"])
    power = car.value("drive.stall_torque_nm") * car.value("drive.no_load_speed_rad_s")
    nominal = car.value("drive.battery_nominal_v")
    assert car.value("battery.stall_current_a") * nominal >= power
    # what is lost at stall is at most what goes in there, and no less than a lossless gear leaves
    assert car.value("motor.stall_heat_w") <= 1.01 * car.value("battery.stall_current_a") * nominal
    assert car.value("motor.stall_heat_w") >= power


def test_a_throttle_curve_gives_small_throttles_less_and_full_ones_all():
    curve = {"drive.curvature": 0.5}
    assert steady_speed(["drive_curve"], curve, 0.6) == pytest.approx(
        steady_speed(throttle=0.6 * (0.5 + 0.5 * 0.6)), rel=1e-6
    )
    assert steady_speed(["drive_curve"], curve) == pytest.approx(steady_speed(), rel=1e-9)


def speed_driven(**numbers):
    """A car whose throttle commands a speed: 1 is 5 m/s."""
    own = {"drive.full_speed_m_s": 5.0, "drive.acceleration_m_s2": 3.0} | numbers
    fleet = Fleet(car_with([], own, GENESIS), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    return fleet


def test_a_speed_control_reaches_the_speed_and_no_faster_than_its_motor_can():
    fleet = speed_driven()
    fleet.throttle[0] = 0.4
    rising = speeds(fleet, 3.0)
    assert 1.2 < rising[49] < 1.5  # 3 m/s^2 for half a second, less friction and spinning up
    assert rising[-1] == pytest.approx(2.0, rel=0.02)


def test_a_speed_control_brakes_too():
    fleet = speed_driven(**{"drive.response_time_s": 0.01})
    fleet.throttle[0] = 0.4
    fleet.advance(2.0)
    fleet.throttle[0] = 0.1
    assert speeds(fleet, 2.0)[-1] == pytest.approx(0.5, rel=0.02)


def test_a_throttle_limit_cuts_each_side_by_itself():
    limits = {"drive.limit_forward": 0.5, "drive.limit_reverse": 0.3}
    for given, left in ((0.9, 0.5), (0.4, 0.4), (-0.9, -0.3)):
        assert steady_speed(["drive_saturation"], limits, given) == pytest.approx(
            steady_speed(throttle=left), rel=1e-6
        )
