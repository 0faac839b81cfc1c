"""Hidden numbers are found again, with intervals that say how well."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from scm.errors import CarError, RecordingError
from scm.recording.read import read_recordings
from scm.vehicles.car import load_car
from tests.unit.calibrate.rig import Hidden, calibrated
from vehicle_agent.calibrate.car_file import write_car
from vehicle_agent.calibrate.fit import NUMBERS, _Model, _student, _window_edges, fit, unsure
from vehicle_agent.calibrate.pattern import SHORT
from vehicle_agent.calibrate.picture import steady_legs

NEAR = {
    "steering.trim_rad": 0.002,
    "steering.gain": 0.01,
    "drive.deadband": 0.004,
    "drive.gain": 0.01,
    "drive.delay_s": 0.004,
    "steering.delay_s": 0.008,
    "steering.rate_rad_s": 0.01,
}


@pytest.fixture(scope="module")
def recorded():
    part, _ = calibrated(Hidden())
    return part.recorded


@pytest.fixture(scope="module")
def found(recorded):
    return fit(load_car("nigel"), *recorded.arrays())


@pytest.fixture(scope="module")
def exact():
    """What is found through an Eye without noise."""
    part, _ = calibrated(replace(Hidden(), position_std=1e-6, yaw_std=1e-6), plan=SHORT)
    return fit(load_car("nigel"), *part.recorded.arrays()).numbers


def test_each_hidden_number_is_found_near_and_inside_a_few_deviations(found):
    for key, truth in Hidden().numbers.items():
        one = found.numbers[key]
        assert one.low < one.value < one.high
        assert abs(one.value - truth) < NEAR[key], key
        assert abs(one.value - truth) < 4.0 * one.std, key
        assert one.std < NEAR[key], key


def test_what_is_left_over_is_the_noise_of_the_eye(found):
    assert found.position_rms_m == pytest.approx(0.002, rel=0.1)
    assert found.yaw_rms_rad == pytest.approx(0.005, rel=0.1)


def test_an_eye_without_noise_leaves_no_error(exact):
    for key, truth in Hidden().numbers.items():
        assert abs(exact[key].value - truth) < 0.05 * NEAR[key], key


def test_no_drive_is_surer_than_a_firmware_that_rounds_and_the_eyes_metre_allow(exact):
    """An exact drive leaves nothing over, and yet a servo of whole degrees may have steered it."""
    hidden = Hidden()
    assert 3e-4 < exact["steering.trim_rad"].std < 3e-3
    assert exact["steering.gain"].std > 0.002 * hidden.gain
    assert 0.002 * hidden.drive < exact["drive.gain"].std < 0.004 * hidden.drive


def test_a_drive_that_leaves_too_much_unsure_says_what_and_one_that_does_not_nothing(found):
    assert unsure(found) == []
    wide = replace(found.numbers["drive.gain"], low=1.0, high=1.2)
    assert unsure(replace(found, numbers={**found.numbers, "drive.gain": wide})) == [
        "drive.gain is known to 0.1 only, expected 0.02"
    ]
    (silent,) = unsure(replace(found, silent=found.windows))
    legs = 2 * found.windows
    assert silent.startswith(f"in {found.windows} of {legs} legs no command left for the board")


def beginning(recorded):
    """As much of a drive as a fit needs."""
    commands, poses = recorded.arrays()
    return commands[commands[:, 0] < 25.0], poses[poses[:, 0] < 25.0]


def test_the_eyes_own_delay_is_taken_off(recorded):
    at_once, late = (
        fit(load_car("nigel"), *beginning(recorded), eye_delay_s=delay_s).numbers
        for delay_s in (0.0, 0.06)
    )
    for key in NEAR:
        off = 0.06 if key.endswith("delay_s") else 0.0
        assert late[key].value == pytest.approx(at_once[key].value - off)
        assert late[key].high == pytest.approx(at_once[key].high - off)


def test_of_a_car_that_stood_still_next_to_nothing_is_known(recorded):
    commands, poses = beginning(recorded)
    rng = np.random.default_rng(3)
    poses[:, 1:] = poses[0, 1:] + rng.normal(0.0, 0.002, (len(poses), 3))
    commands[:, 1] = 0.0
    still = fit(load_car("nigel"), commands, poses)
    for number in NUMBERS:
        if number.key != "steering.rate_rad_s":
            assert still.numbers[number.key].std > 10.0 * NEAR[number.key]


def test_a_short_drive_and_one_without_poses_are_refused(recorded):
    commands, poses = recorded.arrays()
    with pytest.raises(RecordingError, match=r"got a drive of 10\.0 s, expected at least 20 s"):
        fit(load_car("nigel"), commands[commands[:, 0] <= 10.0], poses)
    with pytest.raises(RecordingError, match=r"got a drive of 0\.0 s"):
        fit(load_car("nigel"), commands[:0], poses)
    with pytest.raises(RecordingError, match=r"poses in \d windows of 1 to 3 s, expected more"):
        fit(load_car("nigel"), commands, poses[poses[:, 0] < 5.0])


def test_windows_begin_with_the_legs_and_a_long_rest_is_cut_by_the_clock():
    t = np.arange(0.0, 12.0, 0.02)
    throttle = np.where((t < 3.995) & (t % 2.0 > 0.505), 0.5, 0.0)
    edges = _window_edges(np.column_stack([t, throttle, throttle]))
    assert edges == pytest.approx([0.0, 2.52, 5.02, 7.52, 10.02, 11.98], abs=0.03)


def test_a_leg_in_which_nothing_was_commanded_for_a_while_does_not_count(recorded):
    commands, poses = recorded.arrays()
    whole = _Model(load_car("nigel"), commands, poses)
    silent = (commands[:, 0] > 20.0) & (commands[:, 0] < 20.3)
    rest = _Model(load_car("nigel"), commands[~silent], poses)
    t = poses[:, 0]
    assert len(whole.windows) - len(rest.windows) in (1, 2)
    assert rest.silent == len(whole.windows) - len(rest.windows)
    assert not any(t[part[0]] < 20.0 < t[part[-1]] for part in rest.windows)


def test_few_windows_widen_an_interval_as_students_t_does():
    free = np.array([0.5, 5.0, 12.0, 40.0, 1e9])
    assert _student(free) == pytest.approx([2.92, 2.015, 1.782, 1.684, 1.645], rel=0.03)


def test_each_leg_driven_again_lies_where_it_was_seen(found):
    by_file, calibrated_m = found.resimulated.missed_m
    assert calibrated_m == pytest.approx(np.sqrt(2.0) * found.position_rms_m, rel=0.05)
    assert by_file > 5.0 * calibrated_m


def test_the_ends_of_legs_show_the_dead_band_and_the_trim(found):
    legs = steady_legs(found.resimulated)
    assert len(legs.throttle) == 24  # of 40: in the others the steering swings
    speed, bend = legs.speed[0], legs.curvature[0]
    assert (np.sign(speed) == np.sign(legs.throttle)).all()
    per, at_zero = np.polyfit(np.abs(legs.throttle), np.abs(speed), 1)
    assert -at_zero / per == pytest.approx(Hidden().dead_band, abs=0.03)
    per, at_zero = np.polyfit(legs.steering, bend, 1)
    wheelbase_m = 0.14154
    assert np.arctan(at_zero * wheelbase_m) == pytest.approx(Hidden().trim, abs=0.01)
    assert legs.curvature[2] == pytest.approx(bend, abs=0.5)


def test_the_car_file_loads_with_what_was_found_and_keeps_the_rest(found, tmp_path):
    path = tmp_path / "car.toml"
    made = write_car(load_car("nigel"), found, path, "n7")
    text = path.read_text(encoding="utf-8")
    for key, one in found.numbers.items():
        assert made.value(key) == pytest.approx(one.value, rel=1e-5)
        assert made.quantity(key).std == pytest.approx(one.std, rel=1e-2)
    assert made.value("body.mass_kg") == load_car("nigel").value("body.mass_kg")
    assert "# sprung and unsprung together" in text
    entry = tomllib.loads(text)["steering"]["trim_rad"]
    one = found.numbers["steering.trim_rad"]
    assert entry["source"] == f"calibrated: n7, 90 % {one.low:.4g}..{one.high:.4g}"


def test_a_number_outside_its_bounds_is_refused(found, tmp_path):
    wrong = replace(found.numbers["drive.gain"], value=9.0)
    with pytest.raises(CarError, match="gain"):
        write_car(
            load_car("nigel"),
            replace(found, numbers={**found.numbers, "drive.gain": wrong}),
            tmp_path / "car.toml",
            "n7",
        )


def test_the_drive_is_a_recording_like_any_other(recorded, tmp_path):
    recorded.write(tmp_path, "nigel")
    (read,) = read_recordings(tmp_path)
    assert {"command.throttle", "command.steering", "pose.x", "pose.y", "pose.yaw"} <= set(
        read.channels
    )
