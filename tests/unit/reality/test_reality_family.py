"""Families: other equations for the same car, and other drivers, routes and sensors."""

import json
import math
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

from scm.recording.read import read_recordings
from tests.reality import cases
from tests.reality.cases import make_case, write_cases
from tests.reality.concealed import EFFECTS
from tests.reality.family import ASPECTS, HALVES, NEEDS, USUAL, Family, draw_family, equations
from tests.reality.motion import (
    ROW_S,
    Moving,
    curve,
    motor,
    over_slip,
    spin_wheel,
    steer,
    transferred,
    travel,
)
from tests.reality.numbers import EQUATIONS, GRAVITY, nominal
from tests.reality.recorded import record, write
from tests.reality.routes import TEMPERS
from tests.reality.sensing import FAULTS, POSE_STD, shaped_noise

CARS = ("nigel", "f1tenth")
OTHERS = [
    (aspect, value)
    for aspect in ASPECTS
    if aspect in EQUATIONS or aspect == "step_hz"
    for value in ASPECTS[aspect][1:]
]
SMALLEST_M = {"nigel": 0.0017, "f1tenth": 0.046}
"""How far the median of all effects moves a car in 1 s at strength 1, see docs/trials.md."""


def numbers_of(car, **values):
    usual = nominal(car)
    return usual | equations(Family(**values), car, usual, np.random.default_rng(0))


def record_of(car, **values):
    """Return a car's numbers as the equations read them."""
    return Moving(numbers_of(car, **values), (0.0, 0.0, 0.0), 1).numbers[0]


@pytest.fixture
def short(monkeypatch):
    """Let cases be drives of five seconds."""
    monkeypatch.setattr(cases, "DRIVES", (("drive", 5.0), ("again", 5.0)))


@pytest.mark.parametrize(
    ("k", "salt", "last"),
    [
        (0, "11e02842dc5b3c73922601910d4fc75b",
         {"pose": (4.9663, -3.21301, -1.14853, 2.57596), "imu": (4.99, -0.6507, -0.359, -0.37386)}),
        (1, "02421b2b00dcb4da8c3cc55631d86525",
         {"pose": (4.9351, 0.50214, -0.54002, -2.56192), "encoders": (4.98, 6863, 5562)}),
    ],
)  # fmt: skip
def test_cases_of_the_usual_family_are_those_of_before_families(k, salt, last, short, tmp_path):
    """The salt is drawn last, and so the same only where all before was drawn alike."""
    write_cases(tmp_path, 31, ["single", "none"][: k + 1], (1.0, 1.0))
    held = json.loads((tmp_path / "labels" / f"case_00{k}.json").read_text())
    assert held["salt"] == salt
    assert "family" not in held["label"]
    for table, expected in last.items():
        lines = (tmp_path / f"case_00{k}" / "drive" / f"{table}.csv").read_text().split()
        np.testing.assert_allclose(
            [float(v) for v in lines[-1].split(",")], expected, rtol=0.0, atol=1.1e-5
        )


def test_the_usual_family_has_the_usual_numbers():
    assert set(ASPECTS) == set(Family.__dataclass_fields__)
    got = numbers_of("f1tenth")
    usual = nominal("f1tenth")
    unused = {"winding_lag", "current_limit", "servo_lag", "servo_load"}
    assert {name for name in usual if got[name] != usual[name]} <= unused


@cache
def driven(car):
    """Return the commands of a drive, and the rows of a car that obeys them."""
    commands = record(car, nominal(car), FAULTS, 24.0, np.random.default_rng(4)).commands
    return commands, obeyed(nominal(car), commands)


def obeyed(numbers, commands):
    body = Moving(numbers, (0.0, 0.0, 0.0), len(commands))
    return np.vstack([body.command(k, *commands[k, 1:]) for k in range(len(commands))])


def moved_in_a_second(rows):
    """Return how far a car came from each tenth of a second on, ahead and aside, in 1 s."""
    first = np.arange(400, len(rows) - 400, 40)
    way = rows[first + round(1.0 / ROW_S), 1:3] - rows[first, 1:3]
    cos, sin = np.cos(rows[first, 3]), np.sin(rows[first, 3])
    return np.column_stack((cos * way[:, 0] + sin * way[:, 1], cos * way[:, 1] - sin * way[:, 0]))


@pytest.mark.parametrize("car", CARS)
@pytest.mark.parametrize(("aspect", "value"), OTHERS)
def test_an_equation_of_another_family_describes_the_same_car(car, aspect, value):
    commands, usual = driven(car)
    rows = obeyed(numbers_of(car, **{aspect: value}), commands)
    off = moved_in_a_second(rows) - moved_in_a_second(usual)
    distance = np.sqrt(np.mean(np.sum(off**2, axis=1)))
    assert 0.0 < distance < 0.5 * SMALLEST_M[car]


@pytest.mark.parametrize("car", CARS)
@pytest.mark.parametrize("tyre", ASPECTS["tyre"])
@pytest.mark.parametrize("side", ["", "side_"])
def test_all_tyres_have_the_slope_and_the_peak_of_the_file(car, tyre, side):
    n = numbers_of(car, tyre=tyre)
    c = record_of(car, tyre=tyre)
    peak, highest, slide, end = (
        n[f"{side}{name}"] for name in ("slip_peak", "force_peak", "slip_slide", "force_slide")
    )

    def force(slip):
        shape, bend = n[f"{side}tyre_shape"], n[f"{side}tyre_bend"]
        return slip * over_slip(c, slip, peak, highest, slide, end, shape, bend)

    assert force(0.001 * peak) == pytest.approx(0.0015 * highest, rel=2e-3)
    assert max(force(q * peak) for q in np.arange(0.1, 6.0, 0.01)) == pytest.approx(
        highest, rel=1e-3
    )
    assert force(-0.5 * peak) == -force(0.5 * peak)
    left = highest if tyre == "fiala" else end
    assert force(100.0 * peak) == pytest.approx(left, rel=0.02)


def test_a_brush_that_slides_as_well_as_it_sticks_is_fialas_tyre():
    usual = nominal("f1tenth")
    usual["force_slide"] = usual["force_peak"]
    forces = []
    for tyre in ("fiala", "brush"):
        n = equations(Family(tyre=tyre), "f1tenth", usual, np.random.default_rng(0))
        shape, bend = n["tyre_shape"], n["tyre_bend"]
        forces.append([curve(n["tyre"], q, shape, bend) for q in (0.1, 0.7, 1.5, 2.5)])
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-4)


@pytest.mark.parametrize(
    ("combined_slip", "low", "high"),
    [("none", 0.999, 1.001), ("friction_ellipse", 0.3, 0.95), ("slip_vector", 0.3, 0.95)],
)
def test_a_braking_wheel_holds_less_to_the_side_where_slips_are_combined(combined_slip, low, high):
    def forces(along, aside):
        """Return the forces on a wheel too heavy to change its speed, of some slips."""
        c = record_of("f1tenth", combined_slip=combined_slip)
        c["spin_inertia"] = 1e9
        wheels = np.ones((4, 6))
        wheels[:, 0] = 2.0 * (1.0 - along) / c["radius"]
        return spin_wheel(c, wheels, 2, 0.0, False, 10.0, 1.0, 2.0, 2.0 * aside, 0.0)

    assert low < forces(0.1, 0.05)[1] / forces(0.0, 0.05)[1] < high
    less = forces(0.1, 0.1)[0] / forces(0.1, 0.0)[0]
    assert (less < 0.9) == (combined_slip == "slip_vector")
    assert less <= 1.0


def test_a_motor_with_inductance_comes_to_the_torque_of_its_line():
    c = record_of("nigel", motor="inductance")
    usual = record_of("nigel")
    torque, steps = 0.0, round(c["winding_lag"] / c["step"])
    line, loss = motor(usual, 0.0, 0.7, 3.0)
    reached = line - loss * 3.0
    for k in range(8 * steps):
        still, per_speed = motor(c, torque, 0.7, 3.0)
        torque = still - per_speed * 3.0
        if k + 1 == steps:
            assert 0.55 * reached < torque < 0.7 * reached
    assert torque == pytest.approx(reached, rel=1e-3)
    assert 0.001 <= c["winding_lag"] <= 0.003


def test_a_motors_current_is_limited_in_both_directions_and_only_then():
    c = record_of("nigel", motor="current_limit")
    c["current_limit"] = 0.8
    assert motor(c, 0.0, 1.0, 0.0) == (pytest.approx(0.8 * c["stall"]), 0.0)
    assert motor(c, 0.0, -1.0, 1.0) == (pytest.approx(-0.8 * c["stall"]), 0.0)
    assert motor(c, 0.0, 0.7, 0.0) == motor(record_of("nigel"), 0.0, 0.7, 0.0)


def servo_after(car, seconds, target, front_side=0.0, **values):
    body = Moving(numbers_of(car, **values), (0.0, 0.0, 0.0), 1)
    s, c = body.state[0], body.numbers[0]
    s["front_side"] = front_side
    for _ in range(round(seconds / c["step"])):
        steer(c, s, 0.0, target, 0.0)
    return float(s["servo"])


@pytest.mark.parametrize("car", CARS)
@pytest.mark.parametrize("servo", ["first_order", "second_order"])
def test_a_servo_of_some_order_is_later_by_its_lag_and_no_more(car, servo):
    lag = 0.2 * EFFECTS["steer_lag"].smallest[car]
    n = nominal(car)
    small = 0.2 * n["rate"] * lag / n["limit"]  # a step that the rate does not limit
    got = servo_after(car, lag, small, servo=servo)
    assert 0.4 < got / (small * n["limit"]) < 0.75
    assert servo_after(car, 8.0 * lag, small, servo=servo) == pytest.approx(
        small * n["limit"], rel=0.01
    )
    seconds = 0.5 * n["limit"] / n["rate"]
    late = servo_after(car, seconds, 1.0) - servo_after(car, seconds, 1.0, servo=servo)
    assert 0.0 <= late <= 1.1 * lag * n["rate"]


@pytest.mark.parametrize("car", CARS)
def test_a_loaded_servo_is_slower_by_a_tenth_under_the_usual_side_force(car):
    n = nominal(car)
    usual = np.mean(TEMPERS[car].side_push) * n["mass"] * n["cog"] / n["base"]
    free = servo_after(car, 0.05, 1.0)
    assert servo_after(car, 0.05, 1.0, servo="loaded") == free
    for side in (usual, -2.0 * usual):
        assert servo_after(car, 0.05, 1.0, side, servo="loaded") == pytest.approx(0.9 * free)


def test_smooth_friction_lets_pressed_wheels_creep_and_no_more():
    spins = []
    for friction in ("smooth", "coulomb"):
        body = Moving(numbers_of("nigel", friction=friction) | {"wind_x": 1.0}, (0.0, 0.0, 0.0), 40)
        for k in range(40):
            body.command(k, 0.0, 0.0)
        spins.append(body.wheels[2, 0] * body.numbers["radius"][0])
    assert 0.0 < spins[0] < 0.002
    assert spins[1] == 0.0


def test_stribeck_friction_is_an_excess_at_low_speed_of_a_quarter_of_the_smallest_stiction():
    n = numbers_of("f1tenth", friction="stribeck")
    assert 0.1 < n["stribeck"] / EFFECTS["stiction"].smallest["f1tenth"] <= 0.25
    fast, faster = (obeyed(x, np.tile((0.0, 0.3, 0.0), (60, 1))) for x in (n, nominal("f1tenth")))
    assert fast[-1, 4] == pytest.approx(faster[-1, 4], rel=2e-3)
    n = numbers_of("nigel", friction="stribeck")  # whose file has no dry friction
    for part, moves in ((0.8, False), (1.2, True)):
        body = Moving(n, (0.0, 0.0, 0.0), 10)
        for k in range(10):
            body.command(k, part * n["stribeck"] / n["stall"], 0.0)
        assert (body.wheels[2, 0] > 0.0) == moves


@pytest.mark.parametrize(
    ("car", "throttle", "slower_than_usual"), [("nigel", 0.55, -1.0), ("f1tenth", 0.35, 1.0)]
)
def test_viscous_friction_is_that_of_the_file_at_the_usual_speed(car, throttle, slower_than_usual):
    """Nigel's file has a friction that grows with the square of speed, F1TENTH's dry friction."""
    faster = []
    for part in (0.4, 1.0, 1.7):
        commands = np.tile((0.0, part * throttle, 0.0), (200, 1))
        speeds = [
            obeyed(numbers_of(car, friction=friction), commands)
            for friction in ("coulomb", "viscous")
        ]
        faster.append(speeds[1][-1, 4] / speeds[0][-1, 4] - 1.0)
    assert abs(faster[1]) < 0.003
    assert faster[0] * slower_than_usual > 0.003
    assert faster[2] * slower_than_usual < -0.003


def test_a_rigid_bodys_loads_follow_its_accelerations():
    body = Moving(numbers_of("f1tenth", suspension="quasi_static"), (0.0, 0.0, 0.0), 1)
    s, c = body.state[0], body.numbers[0]
    s["load_push"], s["load_side"] = 1.0, 2.0
    more = np.array([[transferred(c, s, front, left) for left in (1.0, -1.0)] for front in (1, 0)])
    assert abs(more.sum()) < 1e-12
    moment = c["mass"] * c["height"]
    np.testing.assert_allclose(more[1].sum() * c["base"], moment * 1.0)
    np.testing.assert_allclose((more[:, 1] - more[:, 0]).sum() * 0.5 * c["track"], moment * 2.0)


@pytest.mark.parametrize("suspension", ["quasi_static", "static"])
def test_a_car_without_suspension_does_not_lean(suspension):
    n = numbers_of("f1tenth", suspension=suspension)
    body = Moving(n, (0.0, 0.0, 0.0), 60)
    for k in range(60):
        body.command(k, 0.4, 0.4)
    s = body.state[0]
    assert s["roll"] == s["pitch"] == s["heave"] == 0.0
    assert s["load_side"] == pytest.approx(s["side"], rel=0.02)
    assert s["side"] > 0.1 * GRAVITY


def test_a_body_that_spins_freely_flies_straight_by_the_midpoint():
    errors = []
    for body in ("semi_implicit", "midpoint"):
        moving = Moving(numbers_of("nigel", body=body), (0.0, 0.0, 0.0), 1)
        s, c = moving.state[0], moving.numbers[0]
        c["cog"], s["vx"], s["yaw_rate"] = 0.0, 1.0, 10.0
        for _ in range(round(1.0 / c["step"])):
            travel(c, s, 5.0 * c["inertia"])
        errors.append(math.hypot(s["x"] - 1.0, s["y"]))
    assert errors[0] > 1e-3
    assert errors[1] < 1e-5


@pytest.mark.parametrize("which", [*HALVES, "drawn"])
def test_families_are_drawn_of_their_half(which):
    part = HALVES.get(which, slice(None))
    rng = np.random.default_rng(0)
    drawn = [draw_family(which, (), rng) for _ in range(200)]
    for aspect, values in ASPECTS.items():
        assert {getattr(family, aspect) for family in drawn} == set(values[part])


def test_halves_share_no_value_and_today_is_for_development():
    for aspect, values in ASPECTS.items():
        develop, judge = (set(values[HALVES[half]]) for half in ("develop", "judge"))
        assert not develop & judge
        assert develop | judge == set(values)
        assert getattr(USUAL, aspect) in develop


@pytest.mark.parametrize("which", [*HALVES, "drawn"])
def test_what_only_one_sensor_shows_is_concealed_where_there_is_one(which):
    rng = np.random.default_rng(0)
    for sensor, names in NEEDS.items():
        for name in names:
            assert all(getattr(draw_family(which, (name,), rng), sensor) for _ in range(30))
            assert name in EFFECTS


def seen(seconds=20.0, car="nigel", seed=1, **values):
    family = Family(**values)
    rng = np.random.default_rng(seed)
    return record(car, numbers_of(car, **values), FAULTS, seconds, rng, family=family)


@pytest.mark.parametrize(
    "values",
    [{"pose_hz": 10, "encoder_hz": 20, "imu_hz": 50, "lost": 0.0, "jitter_s": 0.0},
     {"pose_hz": 120, "encoder_hz": 100, "imu_hz": 200, "lost": 0.05}],
)  # fmt: skip
def test_sensors_have_the_rates_of_their_family(values, tmp_path):
    write(seen(**values), "nigel", nominal("nigel"), tmp_path)
    recording = read_recordings(tmp_path)[0]
    arrives = 1.0 - values["lost"]
    rates = {"pose.x": values["pose_hz"] * arrives, "encoder.left": values["encoder_hz"],
             "imu.gyro_z": values["imu_hz"]}  # fmt: skip
    for name, rate in rates.items():
        t = recording.channel(name).t
        assert (len(t) - 1) / (t[-1] - t[0]) == pytest.approx(rate, rel=0.03)


def test_a_car_without_encoders_and_imu_has_a_recording_without_them(tmp_path):
    write(seen(5.0, encoder_hz=0, imu_hz=0), "nigel", nominal("nigel"), tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "commands.csv", "pose.csv", "recording.yaml"
    ]  # fmt: skip
    assert not {"encoder.left", "imu.gyro_z"} & set(read_recordings(tmp_path)[0].channels)


@pytest.mark.parametrize("shape", ASPECTS["noise_shape"])
@pytest.mark.parametrize("scale", [0.5, 3.0])
def test_poses_have_the_noise_that_their_recording_states(shape, scale, tmp_path):
    drive = seen(60.0, noise_shape=shape, pose_noise=scale, pose_hz=60)
    write(drive, "nigel", nominal("nigel"), tmp_path)
    stated = read_recordings(tmp_path)[0].channel("pose.x").std
    assert stated == pytest.approx(
        scale * POSE_STD["nigel"] * (0.5 if shape == "correlated" else 1.0)
    )
    true = np.interp(drive.poses[:, 0], drive.rows[:, 0], drive.rows[:, 1])
    off = drive.poses[:, 1] - true
    assert np.std(off) == pytest.approx(stated, rel=0.25 if shape == "correlated" else 0.1)
    lasts = np.mean(off[1:] * off[:-1]) / np.var(off)
    assert (lasts > 0.5) == (shape == "correlated")
    assert (np.mean(np.abs(off) > 3.5 * stated) > 0.002) == (shape == "student_t")
    assert (len(np.unique(drive.poses[:, 1])) < 1000 / scale) == (shape == "quantised")


def test_noise_that_lasts_has_the_deviation_that_is_stated():
    noise, _ = shaped_noise("correlated", 20_000, 60, np.random.default_rng(2))
    assert np.std(noise) == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("car", CARS)
@pytest.mark.parametrize("driver", ASPECTS["driver"])
@pytest.mark.parametrize("routes", ASPECTS["routes"])
def test_every_driver_drives_and_stays_near_the_floor(car, driver, routes):
    drive = seen(30.0, car, driver=driver, routes=routes, pose_hz=10)
    room = np.abs(drive.rows[:, 1:3]).max(axis=0) / TEMPERS[car].floor
    assert 0.3 < room.max() < 1.7
    assert np.percentile(drive.rows[:, 4], 90) > 0.4 * TEMPERS[car].fastest[0]
    assert np.ptp(drive.commands[:, 2]) > 0.1


def test_a_larger_floor_has_larger_routes():
    extents = [np.max(seen(2.0, seed=seed, floor=2.0).span) for seed in range(3)]
    assert min(extents) > 2.0 * TEMPERS["nigel"].floor[0]


def test_a_hand_moves_in_steps_and_not_at_once():
    commands = seen(driver="hand").commands
    rests = np.mean(np.all(np.diff(commands[:, 1:], axis=0) == 0.0, axis=1))
    assert rests > 0.4
    assert np.all(commands[:7, 1:] == 0.0)
    assert np.mean(np.diff(seen().commands[:, 2]) == 0.0) < 0.1


def test_open_loop_pieces_do_not_answer_to_the_car():
    drives = [
        record(
            "nigel", numbers_of("nigel") | {"trim": trim}, FAULTS, 6.0, np.random.default_rng(4),
            family=Family(driver="open_loop", floor=2.0),
        ) for trim in (0.0, 0.05)
    ]  # fmt: skip
    first, second = (drive.commands[:80] for drive in drives)
    np.testing.assert_array_equal(first, second)
    assert drives[0].shape == "none"
    assert np.ptp(first[10:, 1:], axis=0).min() > 0.0


def test_a_label_states_its_family_and_both_drives_have_it(short):
    rng = np.random.default_rng(5)
    label, drives, numbers = make_case("single", rng, families="judge", car="nigel")
    family = Family(**label["family"])
    assert all(
        getattr(family, aspect) in values[HALVES["judge"]] for aspect, values in ASPECTS.items()
    )
    assert numbers["tyre"] == ASPECTS["tyre"].index(family.tyre)
    assert numbers["step"] == 1.0 / family.step_hz
    for drive in drives.values():
        assert (drive.imu is None) is (family.imu_hz == 0)
        assert len(drive.poses) == pytest.approx(4.8 * family.pose_hz, rel=0.1)


def test_where_a_place_matters_it_lies_on_the_floor_of_the_case():
    for name, key in (("surface_patch", "radius_m"), ("tiles", "length_m"), ("cliff", "beyond_m")):
        usual, larger = (
            EFFECTS[name].draw(1.0, np.random.default_rng(0), "nigel", floor).parameters[key]
            for floor in (1.0, 2.0)
        )
        assert larger == pytest.approx(2.0 * usual)


def test_a_half_of_families_that_are_not_drawn_is_refused(root):
    done = subprocess.run(
        [sys.executable, "-m", "tests.reality", "--out", "nowhere", "--half", "judge"],
        cwd=root, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "--half needs --family drawn" in done.stderr
    assert not (root / "nowhere").exists()
