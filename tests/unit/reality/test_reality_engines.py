"""Cars of other people's engines stand, roll, turn and change as their numbers say."""

import math
import sys

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from tests.reality import __main__ as program
from tests.reality import motion
from tests.reality.cases import check_possible, make_case, names_for, possible, write_cases
from tests.reality.concealed import LISTED
from tests.reality.driver import Driver
from tests.reality.engine import ENGINES, cache_folder, find_engine
from tests.reality.numbers import GRAVITY, file_of, nominal
from tests.reality.recorded import record
from tests.reality.sensing import FAULTS

COMMAND = round(motion.COMMAND_S / motion.ROW_S)


@pytest.fixture(scope="module", params=["commonroad", "pybullet", "mujoco"])
def moving(request):
    needs = {"commonroad": "vehiclemodels"}.get(request.param, request.param)
    package = ENGINES[request.param][1]
    pytest.importorskip(needs, reason=f"{request.param} is not here: pip install {package}")
    return find_engine(request.param)


def driven(body, throttle, steering, commands):
    return np.vstack([body.command(k, throttle, steering) for k in commands])


@pytest.mark.parametrize("car", ["nigel", "f1tenth"])
def test_a_car_without_commands_stands_still(moving, car):
    body = moving(nominal(car), (0.5, 0.2, 1.0), 20)
    rows = driven(body, 0.0, 0.0, range(20))
    np.testing.assert_allclose(rows[:, 1:4] - (0.5, 0.2, 1.0), 0.0, atol=1e-4)
    np.testing.assert_allclose(rows[100:, 4:7], 0.0, atol=1e-4)


@pytest.mark.parametrize("car", ["nigel", "f1tenth"])
def test_commonroads_car_rests_on_its_springs_from_the_begin(car):
    pytest.importorskip("vehiclemodels", reason="pip install commonroad-vehicle-models")
    body = find_engine("commonroad")(nominal(car), (0.0, 0.0, 0.0), 20)
    before = body.x.copy()
    driven(body, 0.0, 0.0, range(20))
    np.testing.assert_allclose(body.x[6:23], before[6:23], atol=1e-6)


@pytest.mark.parametrize(("car", "throttle"), [("nigel", 0.6), ("f1tenth", 0.15)])
def test_a_car_goes_straight_at_the_speed_of_our_own(moving, car, throttle):
    rows, own = (
        driven(make(nominal(car), (0.0, 0.0, 0.0), 40), throttle, 0.0, range(40))
        for make in (moving, motion.Moving)
    )
    assert abs(rows[-1, 2]) < 0.002 * rows[-1, 1]
    np.testing.assert_allclose(rows[-1, 4], own[-1, 4], rtol=0.005)
    np.testing.assert_allclose(rows[-1, 1], own[-1, 1], rtol=0.01)
    np.testing.assert_allclose(rows[-1, 9:], own[-1, 9:], rtol=0.01)


def test_kernels_are_compiled_anew_where_a_law_has_changed(tmp_path):
    laws = [tmp_path / "motion.py", tmp_path / "other.py"]
    for law in laws:
        law.write_text("a = 1\n", "utf-8")
    before = cache_folder(laws, tmp_path)
    assert cache_folder(laws, tmp_path) == before
    laws[1].write_text("a = 2\n", "utf-8")
    assert cache_folder(laws, tmp_path) != before


@pytest.mark.parametrize("steering", [0.3, -0.3])
def test_a_slow_car_turns_to_the_radius_of_its_geometry(moving, steering):
    n = nominal("f1tenth")
    rows = driven(moving(n, (0.0, 0.0, 0.0), 50), 0.1, steering, range(50))
    middle = math.tan(n["limit"] * steering) / n["base"]
    np.testing.assert_allclose(rows[-1, 6] / rows[-1, 4], middle, rtol=0.02)
    outer, inner = (9, 10) if steering < 0.0 else (10, 9)
    turned = rows[-1] - rows[-2]
    np.testing.assert_allclose(
        turned[outer] / turned[inner],
        (1.0 + 0.5 * abs(middle) * n["track"]) / (1.0 - 0.5 * abs(middle) * n["track"]),
        rtol=0.02,
    )


def test_the_written_file_is_the_car_that_the_engine_moves(moving, tmp_path):
    n, file = nominal("f1tenth"), tmp_path / "car.toml"
    file.write_text(file_of("f1tenth", moving.stated(n), moving.terms), encoding="utf-8")
    fleet = Fleet(load_car(file).with_values({"drive.axle_lock": 1.0}), 1)
    row, body, off, speed = fleet.add(Pose2(0.0, 0.0, 0.0)), moving(n, (0.0, 0.0, 0.0), 60), [], []
    for k in range(60):
        steering = 0.7 * math.sin(0.3 * k)
        fleet.throttle[row], fleet.steering[row] = 0.25, steering
        rows = body.command(k, 0.25, steering)
        for _ in range(50):
            fleet.advance(1e-3)
        off.append(rows[-1, 6] - fleet.yaw_rate[row])
        speed.append(rows[-1, 4] / fleet.speed[row])
    assert np.std(off) < 0.01
    np.testing.assert_allclose(speed[20:], 1.0, atol=0.01)


@pytest.mark.parametrize(
    ("name", "more", "least", "most"), [("mass", 2.0, 0.6, 0.85), ("slope", 0.03, 0.2, 0.75)]
)
def test_what_changes_while_driving_slows_the_car_from_then_on(moving, name, more, least, most):
    n = nominal("f1tenth")
    light, heavy = (moving(n, (0.0, 0.0, 0.5), 50) for _ in range(2))
    rows = [driven(body, 0.3, 0.0, range(20)) for body in (light, heavy)]
    np.testing.assert_array_equal(*rows)
    heavy.become(n | {name: n[name] + more})
    one, two = (driven(body, 0.3, 0.0, range(20, 40)) for body in (light, heavy))
    np.testing.assert_allclose(two[0, 1:7], one[0, 1:7], atol=0.01)
    ratio = (two[-1, 4] - two[0, 4]) / (one[-1, 4] - one[0, 4])
    assert least < ratio < most


@pytest.mark.parametrize("change", [
    {"slope": 0.03}, {"radius": 0.003}, {"rolling": 0.03}, {"trim": 0.03}, {"give": 0.2},
    {"asymmetry": 0.2}, {"drive_gain": -0.1}, {"steer_gain": -0.1},
    {"drag_linear": 1.0}, {"wind_y": 2.0},
], ids=lambda change: next(iter(change)))  # fmt: skip
def test_an_effect_shows_in_every_engine(moving, change):
    n = nominal("f1tenth")
    name, more = next(iter(change.items()))
    plain, changed, own, own_changed = (
        driven(make(numbers, (0.0, 0.0, 0.0), 40), 0.5, 0.4, range(40))[-1, 1:4]
        for make in (moving, motion.Moving)
        for numbers in (n, n | {name: n[name] + more})
    )
    shift, own_shift = changed - plain, own_changed - own
    size, own_size = np.linalg.norm(shift), np.linalg.norm(own_shift)
    assert 0.4 < size / own_size < 2.5
    assert shift @ own_shift > 0.7 * size * own_size


def test_tyres_hold_no_more_than_their_grip(moving):
    n = nominal("f1tenth") | {"grip": 0.2}
    body = moving(n, (0.0, 0.0, 0.0), 60)
    driven(body, 0.5, 0.0, range(40))
    side = driven(body, 0.5, 0.6, range(40, 60))[200:, 8].mean()
    assert 0.6 < side / (0.2 * n["side_force_peak"] * GRAVITY) < 1.02


def test_an_engine_conceals_only_what_it_can(moving):
    listed = possible(LISTED, "f1tenth", moving)
    assert {"payload", "com_shift", "wheel_radius", "tyre_grip", "grade", "steer_trim"} < {*listed}
    drawn = {names_for("single", "f1tenth", np.random.default_rng(k), moving) for k in range(200)}
    assert {name for (name,) in drawn} <= {*listed}


@pytest.mark.parametrize(
    ("kind", "name"),
    [("step", "payload"), ("ramp", "tyre_grip"), ("dependent", "drive_soft_start"),
     ("placed", "spring"), ("placed", "half_slope"), ("placed", "swirl")],
)  # fmt: skip
def test_every_engine_simulates_every_kind(moving, monkeypatch, kind, name):
    monkeypatch.setattr("tests.reality.cases.DRIVES", (("drive", 2.0), ("again", 1.0)))
    rng = np.random.default_rng(1)
    label, drives, _ = make_case(kind, rng, moving=moving, names=(name,), car="f1tenth")
    assert label.get("course") == (kind if kind in {"step", "ramp"} else None)
    assert np.abs(drives["again"].rows[:, 4]).max() > 0.1


def test_an_effect_that_an_engine_lacks_is_refused_by_name():
    pytest.importorskip("vehiclemodels", reason="pip install commonroad-vehicle-models")
    moving = find_engine("commonroad")
    check_possible(("tyre_grip", "gyro_bias"), "f1tenth", moving)
    with pytest.raises(ValueError, match=r"commonroad cannot simulate tyre_relaxation.*payload"):
        make_case("single", np.random.default_rng(0), moving=moving, names=("tyre_relaxation",))


def test_an_engine_that_is_missing_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "pybullet", None)
    monkeypatch.delitem(sys.modules, "tests.reality.in_pybullet", raising=False)
    monkeypatch.setattr(
        sys, "argv", ["reality", "--out", str(tmp_path / "none"), "--engine", "pybullet"]
    )
    with pytest.raises(SystemExit, match="pip install pybullet"):
        program.main()


def test_the_recording_names_the_file_that_says_which_car_it_is(monkeypatch, tmp_path):
    pytest.importorskip("vehiclemodels", reason="pip install commonroad-vehicle-models")
    monkeypatch.setattr("tests.reality.cases.DRIVES", (("drive", 2.0), ("again", 2.0)))
    write_cases(tmp_path, 1, ["step"], moving=find_engine("commonroad"))
    folder = tmp_path / "case_000" / "drive"
    assert "vehicle: car.toml\n" in (folder / "recording.yaml").read_text(encoding="utf-8")
    assert load_car(folder / "car.toml").text("steering.geometry") == "parallel"


def test_commonroads_car_is_given_no_throttle_below_zero(monkeypatch):
    pytest.importorskip("vehiclemodels", reason="pip install commonroad-vehicle-models")
    monkeypatch.setattr(Driver, "act", lambda _self, _k: (-0.5, 0.0))
    rng, n = np.random.default_rng(0), nominal("nigel")
    lowest = [
        record("nigel", n, FAULTS, 0.5, rng, make).commands[:, 1].min()
        for make in (motion.Moving, find_engine("commonroad"))
    ]
    assert lowest == [-0.5, 0.0]


def test_a_file_without_the_value_to_state_is_refused():
    with pytest.raises(ValueError, match=r"nigel.toml: no drive.pedal"):
        file_of("nigel", {"drive.pedal": 1.0}, {})
