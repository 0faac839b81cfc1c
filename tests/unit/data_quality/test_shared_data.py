"""Recordings by others, whose faults are known or were found twice."""

from dataclasses import replace
from pathlib import Path

import pytest

from scm.data_quality.check import check
from scm.data_quality.quality import Quality
from scm.recording.read import Recording, read_recordings
from scm.vehicles.car import load_car

ROOT = Path(__file__).parents[4]
TRIALS = ROOT.parent / "shared" / "trials"
RECORDINGS = ROOT.parent / "shared" / "recordings"

HEALTHY_SENSORS = ("00", "02", "03", "04", "05", "06", "12", "15", "18", "34")
FAULTY = [
    ("01", "clock_drift", {"rate": 0.0078285}),
    ("07", "gyro_bias", {"bias": -0.0726857}),
    ("21", "encoder_loss", {"fraction": 0.0779937}),
    ("24", "wheel_radius", {"scale": 1.0309183}),
    ("31", "camera_tilt", {"tilt_x": -0.0466026, "tilt_y": 0.0255329}),
]


def trial(case: str, part: str) -> Quality:
    folder = TRIALS / f"case_{case}" / part
    if not folder.is_dir():
        pytest.skip(f"no trial recordings at {TRIALS}")
    (recording,) = read_recordings(folder)
    return check(recording, load_car(recording.vehicle))


def real(name: str) -> Recording:
    data = RECORDINGS / name.partition("/")[0]
    description = ROOT / "recordings" / f"{name}.yaml"
    if not data.is_dir() or not description.is_file():
        pytest.skip(f"no recordings at {data}, or no description {description}")
    return read_recordings(description, data)[0]


def doubts_of(name: str) -> Quality:
    recording = real(name)
    return check(recording, load_car(recording.vehicle))


@pytest.mark.parametrize("part", ["drive", "again"])
@pytest.mark.parametrize("case", HEALTHY_SENSORS)
def test_effects_in_the_car_are_not_blamed_on_its_sensors(case: str, part: str) -> None:
    found = trial(case, part)
    assert (found.problems, found.suspicions) == ((), ())


@pytest.mark.parametrize("part", ["drive", "again"])
@pytest.mark.parametrize(("case", "name", "truth"), FAULTY)
def test_a_concealed_fault_of_a_sensor_is_found(
    case: str, part: str, name: str, truth: dict[str, float]
) -> None:
    found = trial(case, part)
    (suspicion,) = [s for s in found.suspicions if s.name == name]
    assert {s.name for s in found.suspicions} <= {name, *suspicion.indistinguishable}
    for parameter, value in truth.items():
        off = suspicion.values[parameter] - value
        assert abs(off) < 3.0 * suspicion.std[parameter]


def test_a_shifted_centre_of_gravity_is_a_twin_of_a_shifted_marker() -> None:
    (suspicion,) = trial("20", "drive").suspicions
    assert (suspicion.name, suspicion.indistinguishable) == ("pose_point", ("com_shift",))
    assert suspicion.values["ahead"] == pytest.approx(0.0531, abs=0.007)


@pytest.mark.parametrize("session", ["ds2", "ds3", "ds5"])
def test_the_penn_cars_accelerometer_as_it_was_logged_is_turned_a_quarter_left(
    session: str,
) -> None:
    described = real(f"f1tenth_frictionmaps/{session}")
    ahead, left = (described.channels[f"imu.accel_{axis}"] for axis in "xy")
    logged = {"imu.accel_x": left, "imu.accel_y": replace(ahead, values=-ahead.values)}
    recording = replace(described, channels={**described.channels, **logged})
    by_name = {s.name: s for s in check(recording, load_car(recording.vehicle)).suspicions}
    assert by_name["imu_misalignment"].values["angle"] == pytest.approx(1.57, abs=0.12)


@pytest.mark.parametrize("run", ["a_first56s", "b", "d_warmed_up"])
def test_the_ucars_gyro_shows_three_percent_too_much(run: str) -> None:
    by_name = {s.name: s for s in doubts_of(f"cpm_ucar/{run}").suspicions}
    assert by_name["gyro_scale"].values["scale"] == pytest.approx(1.033, abs=0.005)


def test_darts_sensors_are_slower_than_the_rows_they_are_written_in() -> None:
    found = doubts_of("dart/free_driving_10_02_28")
    assert ("imu.*", "held") in {(p.channel, p.name) for p in found.problems}
    assert found.usable.can_diagnose


def test_the_indy_cars_yaw_rate_is_late() -> None:
    found = doubts_of("iac_av21/putnam")
    assert ("yaw_rate", "clock") in {(p.channel, p.name) for p in found.problems}
