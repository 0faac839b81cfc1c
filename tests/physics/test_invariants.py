"""What physics promises of every car, whatever it carries and wherever it stands."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.layout import columns_of
from tests.every_effect import car_with, with_combined_slip

FEW = settings(max_examples=20, derandomize=True)
DRAGS = {
    "body.drag_linear_ns_m": (0.0, 5.0),
    "body.drag_quadratic_ns2_m2": (0.0, 2.0),
    "body.drag_angular_nms": (0.0, 0.1),
    "wheel.rolling_resistance": (0.0, 0.1),
    "corner_drag.coefficient": (0.0, 1.0),
    "tyre_grip.scale": (0.3, 1.5),
    "tyre_stiffness.scale": (0.3, 2.0),
}


def numbers(spans):
    return st.fixed_dictionaries({key: st.floats(*span) for key, span in spans.items()})


_FLEETS = {}


def one(car, yaw=0.0, speed=0.0, **state):
    """A fleet of this one car; fleets are kept by their effects, for making one takes a while."""
    kind = (car.name, *(term.name for term in car.terms))
    fleet = _FLEETS.setdefault(kind, None) or Fleet(car, 1)
    _FLEETS[kind], fleet.car = fleet, car
    if fleet.alive[0]:
        fleet.remove(0)
    fleet.add(Pose2(0.0, 0.0, yaw))
    for i, column in enumerate(columns_of(car.terms)):
        fleet.parameters[0, i] = car.value(column.param.key)
    fleet.throttle[0] = fleet.steering[0] = 0.0
    fleet.place(0, Pose2(0.0, 0.0, yaw), speed, **state)
    return fleet


def motion_energy(fleet):
    """Of body and wheels, heave, roll and pitch left out [J]; wheels as if all were driven."""
    value = fleet.car.value
    _, _, _, vx, vy, rate = fleet.planar_cog(0)
    spun = value("wheel.spin_inertia_kgm2") + value("drive.reflected_inertia_kgm2")
    return (
        0.5 * value("body.mass_kg") * (vx**2 + vy**2)
        + 0.5 * value("body.yaw_inertia_kgm2") * rate**2
        + 0.5 * spun * float(np.sum(fleet.wheel_speed[0] ** 2))
    )


@FEW
@given(
    name=st.sampled_from(["nigel", "f1tenth"]),
    yaw=st.floats(-3.1, 3.1),
    steering=st.floats(-1.0, 1.0),
    length=st.floats(0.0, 0.1),
)
def test_rest_stays_at_rest_on_the_level(name, yaw, steering, length):
    lengths = {"tyre_relaxation.length_m": length, "tyre_windup.length_m": length}
    fleet = one(car_with([], lengths, name), yaw)
    fleet.steering[0] = steering
    fleet.advance(1.0)
    assert abs(fleet.x[0]) + abs(fleet.y[0]) < 1e-9
    assert abs(fleet.yaw[0] - yaw) < 1e-9


@FEW
@given(
    slope=st.floats(0.0, 0.15),
    uphill=st.floats(-3.1, 3.1),
    steering=st.floats(-1.0, 1.0),
    length=st.floats(0.005, 0.03),
)
def test_a_car_whose_tyres_remember_stands_on_a_slope(slope, uphill, steering, length):
    held = {"tyre_relaxation.length_m": length, "tyre_windup.length_m": length}
    hill = {"grade.slope": slope, "grade.uphill_rad": uphill}
    fleet = one(car_with([], {**held, **hill}))
    fleet.steering[0] = steering
    fleet.advance(4.0)  # the patches take the weight
    settled = np.array([fleet.x[0], fleet.y[0], fleet.yaw[0]])
    speeds = []
    for _ in range(50):
        fleet.advance(0.001)
        speeds.append([fleet.speed[0], fleet.lateral_speed[0]])
    fleet.advance(4.0)
    moved = np.abs(np.array([fleet.x[0], fleet.y[0], fleet.yaw[0]]) - settled).max()
    assert moved < 1e-6  # a micrometre in four seconds
    assert np.abs(speeds).max() < 1e-6  # and no trembling


@FEW
@given(slope_x=st.floats(-0.1, 0.1), slope_y=st.floats(-0.1, 0.1), yaw=st.floats(-3.1, 3.1))
def test_it_stands_on_a_floor_that_slopes_too(slope_x, slope_y, yaw):
    held = {"tyre_relaxation.length_m": 0.02, "tyre_windup.length_m": 0.02}
    fleet = one(car_with([], held), yaw)
    fleet.floor_slope_x[0], fleet.floor_slope_y[0] = slope_x, slope_y
    fleet.floor_height[0] = slope_x * fleet.wheel_x[0] + slope_y * fleet.wheel_y[0]
    fleet.advance(4.0)
    settled = np.array([fleet.x[0], fleet.y[0], fleet.yaw[0]])
    fleet.advance(4.0)
    moved = np.abs(np.array([fleet.x[0], fleet.y[0], fleet.yaw[0]]) - settled).max()
    assert moved < 1e-6


@FEW
@given(
    drags=numbers(DRAGS),
    speed=st.floats(0.5, 3.0),
    sideways=st.floats(-1.0, 1.0),
    rate=st.floats(-3.0, 3.0),
    steer=st.floats(-0.4, 0.4),
    length=st.sampled_from([0.0, 0.02, 0.2]),
)
def test_a_coasting_car_never_speeds_up(drags, speed, sideways, rate, steer, length):
    lost = {"drive.stall_torque_nm": 0.0, "drive.front_driven": 1.0}
    lengths = {"tyre_relaxation.length_m": length, "tyre_windup.length_m": length}
    car = car_with([], {**drags, **lost, **lengths}, "f1tenth")
    fleet = one(car, 0.0, speed, lateral_speed=sideways, yaw_rate=rate, steer_angle=steer)
    fleet.throttle[0], fleet.steering[0] = 0.02, steer / car.value("steering.limit_rad")
    start = motion_energy(fleet)
    least = start
    for _ in range(100):
        fleet.advance(0.02)
        now = motion_energy(fleet)
        # springs of suspension and patches give back what they took, never more
        assert now < least + (0.02 if length < 0.1 else 0.3) * start
        least = min(least, now)
    assert now < start


@FEW
@given(
    throttle=st.floats(-1.0, 1.0),
    steering=st.floats(-1.0, 1.0),
    slope=st.floats(0.0, 0.1),
    uphill=st.floats(-3.0, 3.0),
    push=st.floats(-2.0, 2.0),
)
def test_the_mirrored_world_gives_the_mirrored_motion(throttle, steering, slope, uphill, push):
    ends = []
    for side in (1.0, -1.0):
        car = car_with(
            [],
            {
                "grade.slope": slope, "grade.uphill_rad": side * uphill, "wind.force_x_n": push,
                "wind.force_y_n": side * push, "tyre_relaxation.length_m": 0.05,
                "corner_drag.coefficient": 0.2, "understeer.gradient": 0.1,
            },
        )  # fmt: skip
        fleet = one(car, side * 0.4)
        fleet.throttle[0], fleet.steering[0] = throttle, side * steering
        fleet.advance(2.0)
        ends.append([fleet.x[0], side * fleet.y[0], side * fleet.yaw[0], fleet.speed[0]])
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-8)


@FEW
@given(
    speed=st.floats(-3.0, 3.0),
    sideways=st.floats(-1.0, 1.0),
    rate=st.floats(-3.0, 3.0),
    throttle=st.floats(-1.0, 1.0),
)
def test_without_grip_no_momentum_is_won_or_lost(speed, sideways, rate, throttle):
    fleet = one(load_car("f1tenth"), 0.3, speed, lateral_speed=sideways, yaw_rate=rate)
    fleet.floor_grip[0] = 0.0
    before = np.array(fleet.planar_cog(0)[3:])
    fleet.throttle[0], fleet.steering[0] = throttle, 0.5
    fleet.advance(1.0)
    np.testing.assert_allclose(fleet.planar_cog(0)[3:], before, atol=1e-9)


@FEW
@given(steering=st.floats(0.05, 0.25), throttle=st.floats(0.08, 0.25))
def test_a_steady_turn_is_that_of_the_bicycle(steering, throttle):
    car = load_car("f1tenth").with_terms([], {"steering.rate_rad_s": 10.0})
    fleet = one(car)
    fleet.throttle[0], fleet.steering[0] = throttle, steering
    fleet.advance(12.0)
    v, r, steer = float(fleet.speed[0]), float(fleet.yaw_rate[0]), float(fleet.steer_angle[0])
    base, ahead = car.value("body.wheelbase_m"), car.value("body.cog_to_rear_axle_m")
    peak, grip = car.value("tyre.lateral_slip_extremum"), car.value("tyre.lateral_force_extremum")
    stiffness = 1.5 * grip / peak * GRAVITY  # side force over slip, over the mass on the axle
    # rear axle without side slip at the wheel: tan(slip) of each axle is its share of v * r
    rear = v * r / stiffness
    front = math.atan(math.tan(steer)) - math.atan2(base * r - rear * v, v)
    assert front == pytest.approx(v * r / stiffness, abs=0.01)
    assert v * r < 0.35 * grip * GRAVITY  # it was a turn below the tyres' limit
    assert 0.0 < ahead < base


@pytest.mark.parametrize("name", ["tyre_relaxation", "tyre_combined"])
def test_halving_the_substep_halves_the_error_with_further_tyres(name):
    length = {"tyre_relaxation.length_m": 0.1} if name == "tyre_relaxation" else {}
    car = car_with([], length, "f1tenth")
    car = with_combined_slip(car) if name == "tyre_combined" else car
    ends = {}
    for dt in (2e-3, 1e-3, 5e-4, 1.25e-4):
        fleet = one(car)
        for steering in (0.3, -0.3):
            fleet.throttle[0], fleet.steering[0] = 0.5, steering
            fleet.advance(1.0, dt)
        ends[dt] = np.array([fleet.x[0], fleet.y[0], fleet.yaw[0]])
    errors = [np.abs(ends[dt] - ends[1.25e-4]).max() for dt in (2e-3, 1e-3, 5e-4)]
    # first order, seen from a reference that is itself 1.25e-4 off: 15/7 and 7/3
    assert errors[0] / errors[1] == pytest.approx(15 / 7, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(7 / 3, rel=0.2)
