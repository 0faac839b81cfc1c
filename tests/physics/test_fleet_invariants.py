"""What must hold of any car, whatever its numbers."""

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY, PARAMS
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.layout import columns_of
from scm.vehicles.vehicle_status import VehicleStatus

OUTPUTS = (
    "x", "y", "z", "roll", "pitch", "yaw", "speed", "lateral_speed", "yaw_rate", "accel_x",
    "accel_y", "steer_angle", "wheel_speed", "wheel_angle", "wheel_steer", "wheel_load",
)  # fmt: skip
COMMANDS = ((1.0, 0.3), (0.6, -0.8), (0.0, 0.2), (-0.5, 0.5), (0.3, 0.0))


def drive(fleet, rows, seconds=2.0):
    """Drive the rows on their own commands, which change half way."""
    for row in rows:
        fleet.throttle[row], fleet.steering[row] = COMMANDS[row]
    fleet.advance(seconds / 2)
    for row in rows:
        fleet.steering[row] *= -1.0
    fleet.advance(seconds / 2)


def pose_of(row):
    return Pose2(0.3 * row, -row, 0.7 * row)


@pytest.mark.parametrize("name", ["nigel", "f1tenth", "dart"])
def test_a_fleet_of_n_equals_n_fleets_of_one_bit_for_bit(name):
    car = load_car(name)
    together = Fleet(car, 5)
    rows = [together.add(pose_of(row)) for row in range(5)]
    drive(together, rows)
    for row in rows:
        alone = Fleet(car, row + 1)  # same row number, so `drive` gives it the same commands
        for other in range(row + 1):
            alone.add(pose_of(other))
        for other in range(row):
            alone.remove(other)
        drive(alone, [row])
        for name_ in OUTPUTS:
            assert np.array_equal(getattr(together, name_)[row], getattr(alone, name_)[row]), name_


def test_the_same_run_twice_is_equal_bit_for_bit():
    runs = []
    for _ in range(2):
        fleet = Fleet(load_car("f1tenth"), 5)
        drive(fleet, [fleet.add(pose_of(row)) for row in range(5)])
        runs.append(fleet)
    for name in OUTPUTS:
        assert np.array_equal(getattr(runs[0], name), getattr(runs[1], name)), name


@pytest.mark.parametrize("name", ["nigel", "f1tenth"])
def test_mirrored_steering_gives_the_mirrored_motion(name):
    fleet = Fleet(load_car(name), 2)
    for row, side in enumerate((1.0, -1.0)):
        fleet.add(Pose2(0.0, 0.0, side * 0.4))
        fleet.throttle[row], fleet.steering[row] = 0.9, side * 0.6
    fleet.advance(3.0)
    # sums over the wheels change their order, nothing else: rounding only
    for same in ("x", "z", "pitch", "speed", "accel_x"):
        value = getattr(fleet, same)
        assert value[0] == pytest.approx(value[1], abs=1e-9), same
    for opposite in ("y", "yaw", "roll", "lateral_speed", "yaw_rate", "accel_y", "steer_angle"):
        value = getattr(fleet, opposite)
        assert value[0] == pytest.approx(-value[1], abs=1e-9), opposite
    swapped = fleet.wheel_load[1][[1, 0, 3, 2]]
    np.testing.assert_allclose(fleet.wheel_load[0], swapped, atol=1e-8)
    assert abs(fleet.y[0]) > 0.05  # it did turn


def energy(fleet, row):
    """Mechanical energy of one car [J]: all velocities, springs, tyres, height."""

    def number(name):
        return fleet.parameters[row, fleet.parameter_names.index(name)]

    def state(name):
        offset, width = fleet._offsets[name]
        return fleet._block[offset, row] if width == 1 else fleet._block[offset : offset + 4, row]

    wheel = number("wheel_mass")
    sprung, base, cog = number("mass") - 4 * wheel, number("wheelbase"), number("cog_to_rear_axle")
    x = np.array([base - cog, base - cog, -cog, -cog])
    y = 0.5 * number("track") * np.array([1, -1, 1, -1])
    seat_x = x + wheel * x.sum() / sprung  # from the sprung mass's own centre of gravity
    height = state("z_cog") - number("cog_height")
    compression = state("hop") - (height + y * state("roll") - seat_x * state("pitch"))
    driven = np.repeat([number("front_driven"), number("rear_driven")], 2)
    inertia = number("spin_inertia") + driven * number("inertia")
    share = 0.5 * np.array([cog, cog, base - cog, base - cog]) / base
    rest_tyre = share * number("mass") * GRAVITY
    rest_spring = rest_tyre - wheel * GRAVITY
    return (
        0.5 * number("mass") * (state("vx_world") ** 2 + state("vy_world") ** 2)
        + 0.5 * sprung * state("vz") ** 2
        + 0.5 * number("roll_inertia") * state("roll_rate") ** 2
        + 0.5 * number("pitch_inertia") * state("pitch_rate") ** 2
        + 0.5 * number("yaw_inertia") * state("yaw_rate") ** 2
        + np.sum(0.5 * wheel * state("hop_rate") ** 2 + wheel * GRAVITY * state("hop"))
        + np.sum(0.5 * inertia * state("wheel_speed") ** 2)
        + sprung * GRAVITY * height
        + np.sum(rest_spring * compression + 0.5 * number("spring") * compression**2)
        + np.sum(-rest_tyre * state("hop") + 0.5 * number("stiffness") * state("hop") ** 2)
    )


@pytest.mark.parametrize("name", ["nigel", "f1tenth"])
@pytest.mark.parametrize("sideways", [0.0, 0.4])
@pytest.mark.parametrize("forward", [0.0, 0.03])
def test_a_coasting_car_never_gains_energy(name, sideways, forward):
    fleet = Fleet(load_car(name), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    cog = fleet.car.value("body.cog_to_rear_axle_m") + forward
    fleet.set_parameter(0, "cog_to_rear_axle", cog)
    fleet.set_parameter(0, "stall_torque", 0.0)
    fleet.place(0, Pose2(0.0, 0.0, 0.3), 1.2, sideways, 1.5, steer_angle=0.25)
    fleet.throttle[0] = 0.02  # the motor is dead and does not hold: the car coasts
    fleet.steering[0] = 0.25 / fleet.car.value("steering.limit_rad")
    joules = [energy(fleet, 0)]
    for _ in range(2000):
        fleet.advance(1e-3)
        joules.append(energy(fleet, 0))
    assert np.diff(joules).max() < 1e-9 * joules[0]
    assert 0.0 < joules[-1] < 0.9 * joules[0]


def test_halving_the_substep_halves_the_error():
    finest, errors = 1.25e-4, []
    ends = {}
    for dt in (2e-3, 1e-3, 5e-4, finest):
        fleet = Fleet(load_car("f1tenth"), 1)
        fleet.add(Pose2(0.0, 0.0, 0.0))
        fleet.throttle[0], fleet.steering[0] = 0.5, 0.3
        fleet.advance(1.0, substep=dt)
        fleet.steering[0] = -0.3
        fleet.advance(1.0, substep=dt)
        ends[dt] = np.array([fleet.x[0], fleet.y[0], fleet.yaw[0]])
    errors = [np.abs(ends[dt] - ends[finest]).max() for dt in (2e-3, 1e-3, 5e-4)]
    # first order, seen from a reference that is itself 1.25e-4 off: 15/7 and 7/3
    assert errors[0] / errors[1] == pytest.approx(15 / 7, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(7 / 3, rel=0.15)
    assert errors[1] < 2e-3  # metres and radians after 2 s and 2 m


def test_free_front_wheels_do_not_chatter_at_one_millisecond():
    fleet = Fleet(load_car("nigel"), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.throttle[0] = 1.0
    fleet.advance(2.0)
    spins = []
    for _ in range(100):
        fleet.advance(1e-3)
        spins.append(fleet.wheel_speed[0].copy())
    assert np.ptp(np.array(spins), axis=0).max() < 1e-6  # rad/s, of 8


def test_a_push_changes_momentum_by_exactly_what_it_says():
    fleet = Fleet(load_car("nigel"), 1)
    fleet.add(Pose2(1.0, 2.0, 0.5), speed=0.2)
    before = np.array(fleet.planar_cog(0))
    fleet.push(0, 0.1, -0.05, 0.3, 0.01, 0.02, -0.1)
    change = np.array(fleet.planar_cog(0)) - before
    np.testing.assert_allclose(change, [0.01, 0.02, -0.1, 0.1, -0.05, 0.3], atol=1e-15)


def test_a_diverged_car_freezes_and_the_others_go_on():
    fleet = Fleet(load_car("nigel"), 2)
    for row in range(2):
        fleet.throttle[fleet.add(Pose2(0.0, float(row), 0.0))] = 0.5
    fleet.advance(0.5)
    fleet.parameters[0, fleet.parameter_names.index("mass")] = float("nan")
    fleet.advance(0.5)
    frozen = fleet.pose(0)
    fleet.advance(0.5)
    assert list(fleet.status) == [1, 0]
    assert fleet.pose(0) == frozen
    assert np.isfinite(frozen).all()
    assert fleet.speed[0] == 0.0
    assert fleet.x[1] > 0.1


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("nigel", {"yaw_drag.coefficient": 2.0, "yaw_inertia": 1e-4}),
        ("dart", {"static": 50.0, "sharpness": 100.0, "quadratic": 5.0}),
    ],
)
def test_the_strongest_drag_slows_a_car_and_never_pushes_it_back(name, numbers):
    fleet = Fleet(load_car(name), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    for parameter, value in numbers.items():
        fleet.set_parameter(0, parameter, value)
    fleet.place(0, Pose2(0.0, 0.0, 0.0), speed=1.0, yaw_rate=1.0)
    speeds, rates = [], []
    for _ in range(2000):
        fleet.advance(1e-3)
        speeds.append(fleet.planar_cog(0)[3])
        rates.append(float(fleet.yaw_rate[0]))
    assert fleet.status[0] == 0
    assert min(speeds) > -1e-2
    assert max(rates) <= 1.0
    assert np.ptp(speeds[-100:]) < 1e-5  # no chatter


def test_no_car_inside_the_bounds_of_its_numbers_stirs_at_rest():
    rng, rows = np.random.default_rng(3), 1000
    fleet = Fleet(load_car("nigel"), rows)
    bounds = {c.name: c.param.bounds for c in columns_of(fleet.car.terms)}
    at_bound = {name: rng.choice(pair, rows) for name, pair in bounds.items()}
    at_bound["wheel_mass"] = np.minimum(at_bound["wheel_mass"], 0.24 * at_bound["mass"])
    at_bound["cog_to_rear_axle"] = np.minimum(
        at_bound["cog_to_rear_axle"], 0.98 * at_bound["wheelbase"]
    )
    for row in range(rows):
        fleet.add(Pose2(0.0, 0.0, 0.01 * row))
    for name, values in at_bound.items():
        fleet.parameters[:, fleet.parameter_names.index(name)] = values
    for row in range(rows):
        fleet.place(row, Pose2(0.0, 0.0, 0.01 * row))
    fleet.steering[:] = rng.choice((-1.0, 1.0), rows)
    fleet.advance(1.0)
    assert not fleet.status.any()
    assert np.abs(np.column_stack((fleet.x, fleet.y, fleet.z, fleet.pitch))).max() < 1e-6


@pytest.mark.parametrize("name", ["nigel", "f1tenth"])
def test_no_car_inside_the_bounds_of_its_effects_numbers_diverges_when_driven_hard(name):
    rng, rows = np.random.default_rng(5), 512
    fleet = Fleet(load_car(name), rows)
    for row in range(rows):
        fleet.add(Pose2(0.0, 0.0, 0.01 * row))
    body = {param.name for param in PARAMS}
    for column, (low, high) in ((c.name, c.param.bounds) for c in columns_of(fleet.car.terms)):
        if column not in body:
            values = np.where(rng.random(rows) < 0.5, low, high)
            nominal = fleet.parameters[:, fleet.parameter_names.index(column)]
            nominal[:] = np.where(rng.random(rows) < 0.3, nominal, values)
    for throttle in (1.0, -1.0, 0.0):
        fleet.throttle[:] = throttle
        fleet.steering[:] = rng.choice((-1.0, 0.0, 0.3, 1.0), rows)
        fleet.advance(0.5)
    assert not (fleet.status == VehicleStatus.DIVERGED).any()
    assert np.isfinite(fleet.wheel_speed).all()
    assert np.abs(fleet.yaw_rate).max() < 100.0


def test_a_very_stiff_suspension_is_still_calm_at_one_millisecond():
    fleet = Fleet(load_car("nigel"), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    for name, value in (("spring", 1e5), ("damper", 2000.0), ("stiffness", 4e5)):
        fleet.set_parameter(0, name, value)
    fleet.throttle[0], fleet.steering[0] = 1.0, 0.5
    fleet.advance(2.0)
    assert fleet.status[0] == 0
    assert np.abs(np.diff([fleet.roll[0], 0.0])) < 1e-3
    assert fleet.wheel_load[0].min() > 4.0
    assert fleet.speed[0] == pytest.approx(0.26, rel=0.03)
