"""`car.toml`: every effect that can be found loads again with its number, and comments stay."""

import tomllib

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.mismatch.evidence import Evidence
from scm.mismatch.findings import Course, Effect, Equation, Estimate, Verdict
from scm.mismatch.report.car_file import write_car
from scm.mismatch.report.sentences import advice_of
from scm.vehicles.car import all_terms, load_car
from scm.vehicles.car_text import set_entry, set_list
from scm.vehicles.describe_effects import all_effects, params_of
from scm.vehicles.fleet import Fleet
from scm.vehicles.sensor_fault import all_sensor_faults
from tests.unit.mismatch import made_up_findings as made_up
from tests.unit.mismatch.made_up_findings import replace

SHOWN = Evidence(vehicle="nigel", recordings=("tuesday.yaml",))
MOVED = ("body.mass_kg", 2.512345678)
NAMES = """
    drive_delay drive_lag drive_deadband drive_gain drive_asymmetry battery_sag motor_fade
    rolling_resistance viscous_drag aero_drag stiction payload grade surface_patch steer_trim
    steer_gain steer_saturation steer_backlash steer_delay steer_lag steer_rate steer_compliance
    tyre_stiffness tyre_grip tyre_relaxation understeer com_shift load_transfer corner_drag wind
    pose_latency pose_scale camera_tilt pose_point pose_heading wheel_radius encoder_loss gyro_bias
    gyro_scale accel_bias imu_misalignment clock_offset clock_drift
"""


def number_of(param):
    """A number inside the bounds that is neither the default nor round."""
    low, high = max(param.bounds[0], -2.0), min(param.bounds[1], max(2.0, 3.0 * param.default))
    value = low + 0.381 * (high - low)
    return value if value != param.default else 1.01 * value


def found_effect(name, params):
    parameters = {
        p.reported: Estimate(
            value=number_of(p), low=number_of(p) - 0.01, high=number_of(p) + 0.01, unit=p.unit
        )
        for p in params
    }
    return Effect(name=name, is_known=True, equation=Equation.BODY, depends_on=(),
                  parameters=parameters, probability=0.9, text="")  # fmt: skip


def patched_with(car, name, params):
    numbers = {param.key: number_of(param) for param in params}
    if name in all_terms():
        return car.with_terms([name], numbers)
    needs_channel = all_sensor_faults()[name].acts_on == ()
    return car.with_measures([f"{name} on imu.gyro_z" if needs_channel else name], numbers)


def choosable(name):
    """Numbers of an effect that contradict no other number of the car."""
    return [p for p in params_of(all_effects()[name]) if p.fit and "asymptote" not in p.key]


@pytest.mark.parametrize("name", all_effects())
def test_every_listed_effect_loads_again_with_its_numbers(tmp_path, name):
    car, params = load_car("nigel"), choosable(name)
    if name == "com_shift":
        params = []
    patched = patched_with(car, name, params)
    found = made_up.diagnosis(effects=(found_effect(name, params),), verdict=Verdict.MISMATCH)
    assert write_car(found, SHOWN, car, patched, tmp_path) == ["car.toml"]
    read = load_car(tmp_path / "car.toml")
    assert {term.name for term in read.terms} == {term.name for term in patched.terms}
    assert read.measures == patched.measures
    for param in params:
        assert read.value(param.key) == pytest.approx(number_of(param), rel=1e-5)
        assert read.quantity(param.key).source.startswith("mismatch: tuesday.yaml, 90 % ")


@pytest.mark.parametrize("name", NAMES.split())
def test_there_is_advice_of_its_own_for_every_name_that_a_report_may_hold(name):
    assert advice_of(found_effect(name, ())) not in {
        advice_of(replace(made_up.lag(), name="new_effect")),
        advice_of(made_up.unlisted()),
    }


@pytest.mark.parametrize("name", ["nigel", "dart", "f1tenth"])
def test_what_was_not_moved_stays_word_for_word(tmp_path, name):
    car = load_car(name)
    patched = car.with_terms([], {MOVED[0]: MOVED[1]})
    write_car(made_up.diagnosis(), SHOWN, car, patched, tmp_path)
    old = car.path.read_text(encoding="utf-8").splitlines()
    new = (tmp_path / "car.toml").read_text(encoding="utf-8").splitlines()
    assert [line for line in old if line not in new] == [
        line for line in old if line.startswith("mass_kg") and line in old[: old.index("[wheel]")]
    ]


def test_a_moved_number_says_its_interval_and_what_stood_there(tmp_path):
    car = load_car("nigel")
    patched = car.with_terms([], {MOVED[0]: MOVED[1]})
    estimate = Estimate(value=MOVED[1], low=2.4, high=2.6, unit="kg")
    shown = replace(SHOWN, refitted=(replace(made_up.refitted()[0], found=estimate),))
    write_car(made_up.diagnosis(), shown, car, patched, tmp_path)
    quantity = load_car(tmp_path / "car.toml").quantity(MOVED[0])
    assert quantity.source == ("mismatch: tuesday.yaml, 90 % 2.4..2.6; before: 2.4 +- 0.15 (ours)")
    assert quantity.std == pytest.approx(0.2 / 3.29, rel=0.01)
    assert quantity.value == pytest.approx(MOVED[1], rel=1e-5)


def test_a_comment_behind_a_moved_number_stays(tmp_path):
    car = load_car("nigel")
    write_car(made_up.diagnosis(), SHOWN, car, car.with_terms([], dict([MOVED])), tmp_path)
    text = (tmp_path / "car.toml").read_text(encoding="utf-8")
    assert "# sprung and unsprung together" in text


def test_a_law_outside_the_library_lies_beside_the_car_and_drives_it(tmp_path):
    found, shown, car, patched = made_up.unlisted_law(tmp_path)
    out = tmp_path / "out"
    out.mkdir()
    files = write_car(found, shown, car, patched, out)
    assert files == ["car.toml", "drive_force_against_heading.py"]
    read = load_car(out / "car.toml")
    key = "drive_force_against_heading.strength_n"
    assert read.quantity(key).source.startswith("mismatch: recordings/tuesday/recording.yaml, 90 %")
    ways = []
    for each in (car, read):
        fleet = Fleet(each, 1)
        fleet.add(Pose2(0.0, 0.0, 0.7))
        fleet.throttle[0] = 0.5
        fleet.advance(1.0)
        ways.append(float(np.hypot(fleet.x[0], fleet.y[0])))
    assert ways[1] < 0.99 * ways[0]


def test_an_effect_of_the_given_cars_own_comes_along(tmp_path):
    car = load_car("examples/own_car/buggy.toml")
    patched = car.with_terms(["steer_trim"], {"steering.trim_rad": 0.03})
    files = write_car(made_up.diagnosis(), SHOWN, car, patched, tmp_path)
    assert files == ["car.toml", "carpet_nap.py"]
    assert load_car(tmp_path / "car.toml").has("carpet_nap.coefficient_ns_m")


def test_a_car_that_lists_no_effects_gets_a_list(tmp_path):
    text = load_car("nigel").path.read_text(encoding="utf-8")
    start, end = text.index("terms = ["), text.index("]\n") + 2
    (tmp_path / "plain.toml").write_text(text[:start] + text[end:], encoding="utf-8")
    car = load_car(tmp_path / "plain.toml")
    patched = car.with_terms(["steer_trim"], {"steering.trim_rad": 0.03})
    write_car(made_up.diagnosis(), SHOWN, car, patched, tmp_path)
    assert "steer_trim" in {term.name for term in load_car(tmp_path / "car.toml").terms}


def test_a_file_in_another_form_is_written_anew_rather_than_wrong(tmp_path):
    data = load_car("nigel").path.read_text(encoding="utf-8")
    line = next(row for row in data.splitlines() if row.startswith("mass_kg "))
    other = data.replace(line, "mass_kg.value = 2.4\nmass_kg.std = 0.15", 1)
    assert other != data
    (tmp_path / "other.toml").write_text(other, encoding="utf-8")
    car = load_car(tmp_path / "other.toml")
    patched = car.with_terms(["drive_lag"], {"drive.lag_s": 0.1, MOVED[0]: MOVED[1]})
    write_car(made_up.diagnosis(), SHOWN, car, patched, tmp_path)
    read = load_car(tmp_path / "car.toml")
    assert read.value(MOVED[0]) == pytest.approx(MOVED[1], rel=1e-5)
    assert read.value("drive.lag_s") == 0.1


def test_a_name_of_a_recording_cannot_break_the_file(tmp_path):
    car = load_car("nigel")
    nasty = replace(SHOWN, recordings=('a"\n[body]\nmass_kg = 1 \\ ', "b"))
    write_car(made_up.diagnosis(), nasty, car, car.with_terms([], dict([MOVED])), tmp_path)
    read = load_car(tmp_path / "car.toml")
    assert read.value(MOVED[0]) == pytest.approx(MOVED[1], rel=1e-5)


TEXT = """# a car
terms = [
    "a", "b",  # two
    "c"  # last
]
[one]   # first
x = { value = 1, source = "with } and # inside" }  # why
# y is not known

[two]
x = { value = 2 }
"""


def test_an_entry_is_set_in_its_own_section_only():
    changed = set_entry(TEXT, "one", "x", "{ value = 5 }")
    data = tomllib.loads(changed)
    assert (data["one"]["x"]["value"], data["two"]["x"]["value"]) == (5, 2)
    assert "{ value = 5 }  # why" in changed


def test_a_new_entry_stands_behind_the_last_of_its_section():
    changed = set_entry(TEXT, "one", "y", "{ value = 5 }")
    assert tomllib.loads(changed)["one"]["y"]["value"] == 5
    assert changed.index("y = {") < changed.index("# y is not known")


def test_a_new_section_stands_at_the_end():
    changed = set_entry(TEXT, "three", "z", "{ value = 5 }")
    assert changed.endswith("[three]\nz = { value = 5 }\n")


def test_a_list_keeps_its_comments_and_loses_what_went():
    changed = set_list(TEXT, "terms", ["a", "c", "d"], "new")
    assert tomllib.loads(changed)["terms"] == ["a", "c", "d"]
    assert "# two" in changed
    assert "# last" in changed


def test_a_wheel_radius_stands_in_metres_where_the_car_itself_was_changed(tmp_path):
    car = load_car("nigel")
    patched = car.with_terms([], {"wheel.radius_m": 1.04 * 0.0325})
    scale = Estimate(value=1.04, low=1.02, high=1.06, unit="1")
    effect = replace(made_up.lag(), name="wheel_radius", parameters={"scale": scale})
    write_car(made_up.diagnosis(effects=(effect,)), SHOWN, car, patched, tmp_path)
    source = load_car(tmp_path / "car.toml").quantity("wheel.radius_m").source
    assert "90 % 0.03315..0.03445" in source


def test_what_is_added_to_a_cars_own_number_is_told_as_the_sum(tmp_path):
    car = load_car("f1tenth")
    key = "wheel.rolling_resistance"
    given = car.value(key)
    assert given > 0.0
    patched = car.with_terms([], {key: given + 0.02})
    added = Estimate(value=0.02, low=0.01, high=0.03, unit="1")
    effect = replace(made_up.lag(), name="rolling_resistance", parameters={"coefficient": added})
    write_car(made_up.diagnosis(effects=(effect,)), SHOWN, car, patched, tmp_path)
    source = load_car(tmp_path / "car.toml").quantity(key).source
    assert f"90 % {given + 0.01:.4g}..{given + 0.03:.4g}" in source


def test_a_number_states_no_interval_of_an_effect_that_went(tmp_path):
    nigel = load_car("nigel")
    scale = Estimate(value=0.9, low=0.88, high=0.92, unit="1")
    effect = replace(
        found_effect("wheel_radius", ()), parameters={"scale": scale}, course=Course.INTERMITTENT
    )
    patched = nigel.with_terms([], {"wheel.radius_m": 0.9 * nigel.value("wheel.radius_m")})
    for course, states in ((Course.CONSTANT, True), (Course.INTERMITTENT, False)):
        found = made_up.diagnosis(effects=(replace(effect, course=course),))
        write_car(found, SHOWN, nigel, patched, tmp_path)
        assert ("90 %" in (tmp_path / "car.toml").read_text(encoding="utf-8")) is states
