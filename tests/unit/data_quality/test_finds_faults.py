"""Small faults are named and measured, and a healthy drive is left in peace."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from scm.data_quality.check import check
from scm.data_quality.quality import Suspicion
from scm.recording.read import Recording
from scm.vehicles.car import Car
from scm.vehicles.sensor_fault import AppliedFault, Series, all_sensor_faults, apply_faults

Drive = Callable[[int], Recording]
Suspicions = Callable[[str, dict[str, float], int], tuple[Suspicion, ...]]

INJECTED = [
    ("gyro_bias", {"bias": 0.02}),
    ("gyro_bias", {"bias": -0.05}),
    ("gyro_scale", {"scale": 1.03}),
    ("gyro_scale", {"scale": 0.9}),
    ("pose_latency", {"delay": 0.06}),
    ("clock_offset", {"offset": -0.06}),
    ("clock_drift", {"rate": 0.008}),
    ("clock_drift", {"rate": -0.002}),
    ("pose_heading", {"offset": 0.05}),
    ("pose_point", {"ahead": 0.03, "aside": -0.02}),
    ("pose_scale", {"scale": 1.08}),
    ("wheel_radius", {"scale": 0.94}),
    ("encoder_loss", {"fraction": 0.06}),
    ("camera_tilt", {"tilt_x": 0.012, "tilt_y": -0.009}),
    ("accel_bias", {"along": 0.2, "across": -0.1}),
    ("imu_misalignment", {"angle": 0.35}),
    ("imu_misalignment", {"angle": 1.5708}),
]


def with_fault(recording: Recording, name: str, values: dict[str, float], *where: str) -> Recording:
    """Return what the recording would hold with a fault of the library."""
    true = {key: Series(c.t, c.values) for key, c in recording.channels.items()}
    seen = apply_faults(true, [AppliedFault(all_sensor_faults()[name], values, where)])
    channels = {
        key: replace(c, t=seen[key].t_s, values=seen[key].values)
        for key, c in recording.channels.items()
    }
    return replace(recording, channels=channels)


@pytest.fixture(scope="module")
def suspicions(drive: Drive, nigel: Car) -> Suspicions:
    """Doubt a drive with a fault once, whoever asks."""
    made: dict[tuple[str, str, int], tuple[Suspicion, ...]] = {}

    def of(name: str, values: dict[str, float], seed: int) -> tuple[Suspicion, ...]:
        key = (name, str(values), seed)
        if key not in made:
            made[key] = check(with_fault(drive(seed), name, values), nigel).suspicions
        return made[key]

    return of


def suspected(found: tuple[Suspicion, ...]) -> set[str]:
    return {suspicion.name for suspicion in found}


@pytest.mark.parametrize("seed", range(6))
def test_a_healthy_drive_raises_no_doubt(drive: Drive, nigel: Car, seed: int) -> None:
    found = check(drive(seed), nigel)
    assert (found.problems, found.suspicions, found.repairs) == ((), (), ())


def test_a_healthy_drive_can_be_diagnosed_from_end_to_end(drive: Drive, nigel: Car) -> None:
    found = check(drive(0), nigel)
    assert found.usable.can_diagnose
    (span,) = found.usable.spans["pose.x"]
    assert span == pytest.approx((0.1, 74.9), abs=0.1)


@pytest.mark.parametrize(("name", "values"), INJECTED)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_fault_is_named_and_its_value_found_within_three_standard_errors(
    suspicions: Suspicions, name: str, values: dict[str, float], seed: int
) -> None:
    found = suspicions(name, values, seed)
    by_name = {suspicion.name: suspicion for suspicion in found}
    assert name in by_name
    for parameter, value in values.items():
        off = by_name[name].values[parameter] - value
        assert abs(off) < 3.0 * by_name[name].std[parameter]


@pytest.mark.parametrize(("name", "values"), INJECTED)
@pytest.mark.parametrize("seed", [0, 1])
def test_no_fault_is_suspected_beside_the_true_one_and_its_twins(
    suspicions: Suspicions, name: str, values: dict[str, float], seed: int
) -> None:
    found = suspicions(name, values, seed)
    true = next(suspicion for suspicion in found if suspicion.name == name)
    assert suspected(found) <= {name, *true.indistinguishable}


def test_a_single_late_sensor_is_told_from_late_poses(drive: Drive, nigel: Car) -> None:
    late = with_fault(drive(0), "clock_offset", {"offset": 0.1}, "imu.*")
    found = check(late, nigel).suspicions
    assert [(s.name, s.channels) for s in found] == [("clock_offset", ("imu.gyro_z",))]
    assert found[0].values["offset"] == pytest.approx(0.1, abs=0.01)


def test_the_accelerometer_tells_a_wrong_metre_from_wrong_wheels(drive: Drive, nigel: Car) -> None:
    wrong_metre = with_fault(drive(0), "pose_scale", {"scale": 1.35})
    assert suspected(check(wrong_metre, nigel).suspicions) == {"pose_scale"}


def test_without_wheels_or_gyro_a_turned_marker_still_shows(drive: Drive, nigel: Car) -> None:
    turned = with_fault(drive(0), "pose_heading", {"offset": 0.08})
    kept = {k: c for k, c in turned.channels.items() if not k.startswith(("imu", "encoder"))}
    found = check(replace(turned, channels=kept), nigel).suspicions
    assert suspected(found) == {"pose_heading"}
    assert found[0].values["offset"] == pytest.approx(0.08, abs=3.0 * found[0].std["offset"])


def test_without_a_car_file_the_gyro_is_still_doubted(drive: Drive) -> None:
    found = check(with_fault(drive(0), "gyro_bias", {"bias": 0.03})).suspicions
    assert suspected(found) == {"gyro_bias"}
