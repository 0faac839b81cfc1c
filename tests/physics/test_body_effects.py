"""Each effect of body, floor and tyre does what its equation says, on a whole car."""

import math

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import all_terms, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import plain
from tests import every_effect
from tests.every_effect import with_combined_slip

FREE = {
    "drive.stall_torque_nm": 0.0,
    "drive.hold_torque_nm": 0.0,
    "drive.coulomb_torque_nm": 0.0,
    "wheel.damping_linear_nms": 0.0,
    "wheel.rolling_resistance": 0.0,
}


def car_with(*names, base="f1tenth", free=True, **numbers):
    """A car with further effects; keys are written with __ for the dot."""
    values = {key.replace("__", "."): number for key, number in numbers.items()}
    return every_effect.car_with(names, {**(FREE if free else {}), **values}, base)


def placed(car, speed=0.0, yaw=0.0, **state):
    fleet = Fleet(car, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.place(0, Pose2(0.0, 0.0, yaw), speed, **state)
    return fleet


def rolling_mass(car, payload=0.0):
    """Mass that a freely rolling car shows: its wheels and rotors must be spun up too."""
    wheels = 4.0 * car.value("wheel.spin_inertia_kgm2")
    driven = 2.0 * (car.value("drive.front_driven") + car.value("drive.rear_driven"))
    rotors = driven * car.value("drive.reflected_inertia_kgm2")
    spun = (wheels + rotors) / car.value("wheel.radius_m") ** 2
    return car.value("body.mass_kg") + payload + spun


@pytest.mark.parametrize("heading", [0.0, 0.7, 2.5])
def test_a_free_car_rolls_down_a_grade_as_an_inclined_plane_says(heading):
    car = car_with("grade", grade__slope=0.05, grade__uphill_rad=heading)
    fleet = placed(car, yaw=heading)
    fleet.advance(1.0)
    pull = car.value("body.mass_kg") * GRAVITY * math.sin(math.atan(0.05))
    assert fleet.speed[0] == pytest.approx(-pull / rolling_mass(car), rel=0.01)
    assert abs(fleet.lateral_speed[0]) < 1e-9


def test_wind_pushes_a_car_the_same_way_over_the_floor_whatever_its_heading():
    for yaw, along in ((0.0, 0.8), (math.pi / 2, -0.3), (math.pi, -0.8)):
        car = car_with("wind", wind__force_x_n=0.8, wind__force_y_n=-0.3)
        fleet = placed(car, yaw=yaw)
        fleet.advance(1.0)
        assert fleet.speed[0] == pytest.approx(along / rolling_mass(car), rel=0.01)


def test_air_drag_slows_a_coasting_car_along_the_closed_form():
    car = car_with(body__drag_quadratic_ns2_m2=0.8)
    fleet = placed(car, speed=4.0)
    fleet.advance(2.0)
    expected = 4.0 / (1.0 + 0.8 * 4.0 * 2.0 / rolling_mass(car))
    assert fleet.speed[0] == pytest.approx(expected, rel=0.01)


def test_air_drag_feels_the_wind_of_the_world():
    car = car_with(body__drag_quadratic_ns2_m2=0.8)
    fleet = placed(car, yaw=math.pi)
    fleet.air_x[0] = 2.0
    fleet.advance(0.05)
    assert fleet.speed[0] == pytest.approx(-0.8 * 2.0**2 * 0.05 / rolling_mass(car), rel=0.05)


def test_viscous_drag_slows_a_coasting_car_exponentially():
    car = car_with(body__drag_linear_ns_m=1.5)
    fleet = placed(car, speed=3.0)
    fleet.advance(2.0)
    assert fleet.speed[0] == pytest.approx(3.0 * math.exp(-3.0 / rolling_mass(car)), rel=0.01)


def test_corner_drag_takes_its_share_of_the_cornering_force():
    car = car_with("corner_drag", corner_drag__coefficient=0.3)
    without = car_with("corner_drag", corner_drag__coefficient=0.0)
    speeds = []
    for which in (car, without):
        fleet = placed(which, speed=2.0, yaw_rate=1.2, steer_angle=0.19)
        fleet.steering[0] = 0.19 / car.value("steering.limit_rad")
        fleet.advance(0.3)
        speeds.append(float(fleet.speed[0]))
        turning = float(fleet.yaw_rate[0])
    lost = 0.3 * car.value("body.mass_kg") * turning * 2.0 / rolling_mass(car) * 0.3
    assert speeds[1] - speeds[0] == pytest.approx(lost, rel=0.15)


@pytest.mark.parametrize("gradient", [0.3, -0.1])
def test_understeer_bends_a_slow_circle_by_its_gradient(gradient):
    car = car_with("understeer", base="nigel", free=False, understeer__gradient=gradient)
    fleet = placed(car)
    fleet.throttle[0], fleet.steering[0] = 0.9, 0.6
    fleet.advance(4.0)
    v, r = float(fleet.speed[0]), float(fleet.yaw_rate[0])
    felt = fleet.steer_angle[0] - gradient * v * r
    assert abs(gradient * v * r) > 0.01  # it is a real change of angle
    assert r == pytest.approx(v * math.tan(felt) / car.value("body.wheelbase_m"), rel=0.03)


def test_a_patch_rolls_heavily_inside_and_as_always_outside():
    spot = {"surface_patch__x_m": 1.5, "surface_patch__radius_m": 0.5}
    car = car_with("surface_patch", surface_patch__rolling=0.08, **spot)
    fleet = placed(car, speed=2.0)
    fleet.advance(0.1)
    assert fleet.speed[0] == pytest.approx(2.0, abs=1e-6)
    while fleet.x[0] < 1.1:
        fleet.advance(0.001)
    before = float(fleet.speed[0])
    fleet.advance(0.1)
    slowing = 0.08 * car.value("body.mass_kg") * GRAVITY / rolling_mass(car)
    assert (before - fleet.speed[0]) / 0.1 == pytest.approx(slowing, rel=0.02)
    while fleet.x[0] < 2.1:
        fleet.advance(0.001)
    leaving = float(fleet.speed[0])
    fleet.advance(0.2)
    assert fleet.speed[0] == pytest.approx(leaving, abs=1e-3)


@pytest.mark.parametrize("how", ["patch", "tyre", "floor"])
def test_a_sliding_car_is_slowed_by_its_grip(how):
    names = {"patch": ["surface_patch"], "tyre": ["tyre_grip"], "floor": []}[how]
    numbers = {
        "patch": {"surface_patch__grip": 0.4, "surface_patch__radius_m": 10.0},
        "tyre": {"tyre_grip__scale": 0.4},
        "floor": {},
    }[how]
    car = car_with(*names, drive__hold_torque_nm=20.0, **numbers)
    fleet = placed(car, speed=3.0)
    if how == "floor":
        fleet.floor_grip[0] = 0.4
    fleet.advance(0.1)  # wheels lock
    before = float(fleet.speed[0])
    fleet.advance(0.2)
    expected = 0.4 * car.value("tyre.force_asymptote") * GRAVITY
    assert np.abs(fleet.wheel_speed[0]).max() < 1e-6
    assert (before - fleet.speed[0]) / 0.2 == pytest.approx(expected, rel=0.02)


def test_a_softer_tyre_slips_more_under_the_same_force():
    creep = {}
    for scale in (1.0, 0.5):
        car = car_with("tyre_stiffness", "wind", tyre_stiffness__scale=scale, wind__force_y_n=1.0)
        fleet = placed(car)
        fleet.advance(2.0)
        creep[scale] = fleet.lateral_speed[0]
    assert creep[0.5] == pytest.approx(2.0 * creep[1.0], rel=0.01)


def test_a_relaxed_tyre_has_63_percent_of_its_slip_after_its_length():
    law = plain(all_terms()["tyre_relaxation"].function)
    length, speed, dt, lag = 0.3, 2.0, 1e-4, 0.0
    for _ in range(round(length / speed / dt)):
        lag = law(speed, 0.1, lag, dt, 0.0, 0.0, 0.0, length, 0.2, 0.05)
    assert lag == pytest.approx(0.1 / speed * (1.0 - math.exp(-1.0)), rel=0.01)


def test_a_relaxed_tyre_delays_a_steering_step():
    rates = {}
    for length in (0.0, 0.4):
        car = car_with("tyre_relaxation", tyre_relaxation__length_m=length, free=False)
        fleet = placed(car, speed=2.5)
        fleet.throttle[0], fleet.steering[0] = 0.38, 0.2
        rates[length] = []
        for _ in range(50):
            fleet.advance(0.03)
            rates[length].append(float(fleet.yaw_rate[0]))
        fleet.advance(4.0)
        rates[length].append(float(fleet.yaw_rate[0]))
    assert rates[0.4][0] < 0.25 * rates[0.0][0]
    assert rates[0.4][-1] == pytest.approx(rates[0.0][-1], rel=0.02)  # the same steady turn


def test_a_push_sideways_is_held_by_the_tyres_and_leaves_no_creep():
    names = ("tyre_relaxation", "tyre_windup", "grade")
    slope = {"grade__slope": 0.1, "grade__uphill_rad": math.pi / 2}
    patch = {"tyre_relaxation__length_m": 0.02, "tyre_windup__length_m": 0.02}
    fleet = placed(car_with(*names, base="nigel", free=False, **slope, **patch))
    fleet.advance(2.0)
    fleet.push(0, 0.1, 0.6, 0.5)
    fleet.advance(3.0)
    where = fleet.pose(0)
    assert 0.01 < where.y < 0.1  # 0.6 m/s against 0.75 to 1 g of friction, less the slope
    fleet.advance(10.0)
    there = fleet.pose(0)
    assert math.hypot(there.x - where.x, there.y - where.y) < 1e-6
    assert abs(there.yaw - where.yaw) < 1e-6


def test_reverse_is_as_fast_as_forward_and_steers_the_same_circle():
    ends = []
    for way in (1.0, -1.0):
        fleet = placed(load_car("nigel"))
        fleet.throttle[0], fleet.steering[0] = way * 0.8, 0.5
        fleet.advance(5.0)
        ends.append((way * fleet.speed[0], fleet.yaw_rate[0] / fleet.speed[0]))
    assert ends[1] == pytest.approx(ends[0], rel=0.01)


def test_combined_slip_is_the_pure_curve_when_driving_straight():
    ends = []
    for combined in (False, True):
        car = car_with(free=False)
        car = with_combined_slip(car) if combined else car
        fleet = placed(car)
        fleet.throttle[0] = 0.6
        fleet.advance(1.0)
        ends.append(float(fleet.x[0]))
    assert ends[1] == pytest.approx(ends[0], rel=1e-12)


def test_a_car_with_combined_slip_cannot_brake_and_turn_with_full_force_both():
    most = {}
    for combined in (False, True):
        car = car_with(drive__hold_torque_nm=0.4)
        car = with_combined_slip(car) if combined else car
        fleet = placed(car, speed=2.5, lateral_speed=0.35)
        felt = []
        for _ in range(60):
            fleet.advance(0.001)
            felt.append(math.hypot(fleet.accel_x[0], fleet.accel_y[0]))
        most[combined] = max(felt)
    grip = load_car("f1tenth").value("tyre.lateral_force_extremum") * GRAVITY
    assert most[False] > 1.05 * grip  # two curves that do not know of each other
    assert most[True] < 0.98 * grip


def test_quasi_static_load_moves_weight_and_keeps_its_sum():
    law = plain(all_terms()["load_quasistatic"].function)
    mass, base, track, height, cog = 4.0, 0.32, 0.24, 0.07, 0.15
    axle = {1.0: 0.5 * mass * GRAVITY * cog / base, 0.0: 0.5 * mass * GRAVITY * (1 - cog / base)}
    loads = {
        (front, side): law(0.0, axle[front], 2.0, 3.0, front, side, mass, base, track, height, 1.0)
        for front in (1.0, 0.0)
        for side in (1.0, -1.0)
    }
    assert sum(loads.values()) == pytest.approx(mass * GRAVITY)
    moved = loads[0.0, 1.0] + loads[0.0, -1.0] - 2.0 * axle[0.0]
    assert moved == pytest.approx(mass * 2.0 * height / base)
    outer = loads[1.0, -1.0] + loads[0.0, -1.0] - 0.5 * mass * GRAVITY
    assert outer == pytest.approx(mass * 3.0 * height / track)


def test_payload_rides_on_the_wheels_and_slows_the_start():
    car = car_with("payload", "wind", payload__mass_kg=2.0, wind__force_x_n=1.0)
    fleet = placed(car)
    fleet.advance(1.0)
    assert fleet.wheel_load[0].sum() == pytest.approx(
        (car.value("body.mass_kg") + 2.0) * GRAVITY, rel=1e-6
    )
    assert fleet.speed[0] == pytest.approx(1.0 / rolling_mass(car, 2.0), rel=0.01)
    assert abs(fleet.z[0]) < 1e-3  # it stands no lower


def test_a_shifted_centre_of_gravity_loads_its_axle_and_leaves_the_pose():
    car = car_with("com_shift", com_shift__shift_m=0.05)
    fleet = placed(car)
    fleet.advance(0.5)
    front = (car.value("body.cog_to_rear_axle_m") + 0.05) / car.value("body.wheelbase_m")
    expected = front * car.value("body.mass_kg") * GRAVITY
    assert fleet.wheel_load[0, :2].sum() == pytest.approx(expected, rel=1e-6)
    assert abs(fleet.x[0]) + abs(fleet.y[0]) + abs(fleet.pitch[0]) < 1e-9


def test_a_higher_centre_of_gravity_moves_more_load_in_a_turn():
    car = car_with("load_transfer", free=False, load_transfer__height_m=0.03)
    fleet = placed(car)
    fleet.throttle[0], fleet.steering[0] = 0.4, 0.2
    fleet.advance(10.0)
    moved = 0.5 * (fleet.wheel_load[0, [1, 3]].sum() - fleet.wheel_load[0, [0, 2]].sum())
    height = car.value("body.cog_height_m") + 0.03
    side = car.value("body.mass_kg") * fleet.speed[0] * fleet.yaw_rate[0]
    assert side > 2.0
    assert moved == pytest.approx(side * height / car.value("body.track_m"), rel=0.03)
