"""Effects mean what another simulator means by them: its recordings, driven again with its numbers.

The recordings come from a simulator that shares no code with this one. Only cases to develop on
are read here. Its motors each feel their own wheel, hence `drive.axle_lock = 1`.
"""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.car import all_terms
from scm.vehicles.fleet import Fleet
from tests.every_effect import car_with

TRIALS = Path(__file__).parents[3] / "shared" / "trials"
CASES = {
    "case_00": "steer_trim",
    "case_03": "drive_asymmetry",
    "case_06": "steer_backlash",
    "case_12": "drive_deadband",
    "case_18": "motor_fade",
    "case_34": "battery_sag",
}
NOISE = 0.006  # rad/s: the gyro's 0.002 and the car's own scatter


def table(folder, name):
    with (folder / f"{name}.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    return np.array([[float(cell or "nan") for cell in row] for row in rows])


def yaw_rate_error(folder, numbers):
    """Root mean square of gyro less yaw rate over 40 s from the commands alone [rad/s]."""
    car = car_with([], {"drive.axle_lock": 1.0, **numbers})
    commands, pose, imu = (table(folder, name) for name in ("commands", "pose", "imu"))
    fleet = Fleet(car, 1)
    fleet.add(Pose2(*pose[0, 1:4]))
    stamps = np.arange(0.0, 40.0, 0.01)
    rows = np.clip(np.searchsorted(commands[:, 0], stamps + 1e-9, side="right") - 1, 0, None)
    rates = []
    for row in rows:
        fleet.throttle[0], fleet.steering[0] = commands[row, 1:3]
        fleet.advance(0.01)
        rates.append(float(fleet.yaw_rate[0]))
    gyro = np.interp(stamps + 0.01, imu[:, 0], imu[:, 3])
    return float(np.sqrt(np.mean((np.array(rates) - gyro) ** 2)))


@pytest.mark.parametrize("case", CASES)
def test_the_effect_with_the_other_simulators_number_explains_its_recording(case):
    if not (TRIALS / case).is_dir():
        pytest.skip(f"{TRIALS / case} is not here: the recordings are not part of this repository")
    label = json.loads((TRIALS / "labels.json").read_text(encoding="utf-8"))[case]
    assert label["names"] == [CASES[case]]
    params = {p.reported: p.key for p in all_terms()[CASES[case]].params}
    numbers = {params[name]: value for name, value in label["parameters"].items()}
    drive = TRIALS / case / "drive"
    with_effect, without = yaw_rate_error(drive, numbers), yaw_rate_error(drive, {})
    assert with_effect < NOISE
    assert without > 4.0 * with_effect
