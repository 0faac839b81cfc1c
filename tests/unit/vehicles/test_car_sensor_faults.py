"""A car file may say what its recordings get wrong."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from scm.errors import CarError
from scm.vehicles.car import TYPES_DIR, car_of, load_car
from scm.vehicles.sensor_fault import Series, apply_faults

NIGEL = tomllib.loads((TYPES_DIR / "nigel.toml").read_text(encoding="utf-8"))


def car(measures, numbers=None):
    section = {key: {"value": value, "source": "test"} for key, value in (numbers or {}).items()}
    return car_of(NIGEL | {"measures": measures, "measure": section}, Path("mine.toml"))


def gyro(value):
    return {"imu.gyro_z": Series(np.array([0.0]), np.array([value]))}


def test_a_car_file_may_list_faults_with_their_numbers():
    mine = car(["gyro_scale", "gyro_bias"], {"gyro_scale": 2.0, "gyro_bias_rad_s": 0.1})
    assert apply_faults(gyro(0.2), mine.faults)["imu.gyro_z"].values[0] == pytest.approx(0.5)


def test_a_fault_without_a_number_does_nothing():
    seen = apply_faults(gyro(0.2), car(["gyro_scale"]).faults)
    assert seen["imu.gyro_z"].values[0] == 0.2


def test_a_car_that_lists_none_measures_the_truth():
    assert load_car("nigel").faults == ()


def test_a_unit_error_names_its_channel():
    mine = car(["unit_error on imu.gyro_z"], {"unit_factor": 57.3})
    assert apply_faults(gyro(0.1), mine.faults)["imu.gyro_z"].values[0] == pytest.approx(5.73)


def test_a_car_is_given_faults_and_numbers_in_memory():
    mine = load_car("nigel").with_measures(["gyro_bias"], {"measure.gyro_bias_rad_s": -0.1})
    mine = mine.with_measures(["gyro_scale"], {"measure.gyro_scale": 1.5})
    assert [fault.kind.name for fault in mine.faults] == ["gyro_bias", "gyro_scale"]
    assert apply_faults(gyro(0.3), mine.faults)["imu.gyro_z"].values[0] == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("measures", "numbers", "said"),
    [
        (["gyro_bas"], {}, r"no sensor fault 'gyro_bas'.*gyro_bias"),
        (["gyro_bias", "gyro_bias"], {}, "'gyro_bias' is listed twice"),
        (["unit_error"], {}, "expected 'unit_error' as 'unit_error on CHANNEL'"),
        ("gyro_bias", {}, "expected a list of names, got 'gyro_bias'"),
        (["gyro_bias"], {"gyro_bias_rad_s": 7.0}, "expected -1 to 1 rad/s, got 7.0"),
        (["gyro_bias"], {"gyro_bias_deg_s": 7.0}, r"no such key.*gyro_bias_rad_s"),
    ],
)
def test_a_bad_list_is_refused_with_the_reason_and_the_nearest_name(measures, numbers, said):
    with pytest.raises(CarError, match=said):
        car(measures, numbers)
