"""The recordings that the project describes are read and replayed, where their data is at hand."""

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from scm.recording.description import read_description
from scm.recording.read import Recording, read_recordings
from scm.replay.free_run import free_run
from scm.vehicles.car import load_car

FOLDER = Path(__file__).parents[3] / "recordings"
SAMPLE = FOLDER / "sample"
ALL = sorted(FOLDER.rglob("*.yaml"))
NIGEL = sorted((FOLDER / "nigel_real").glob("*.yaml"))
LARGEST_SAMPLE_BYTES = 300_000
REPLAYED = {  # name: most error of 1 s of free run with the car as its authors know it, median [m]
    "cpm_ucar/b": 0.08,
    "cpm_ucar/feb2019": 0.11,
    "dart/free_driving_10_02_28": 0.5,
    "dart/steering_map_slow_09_56_00": 0.3,
    "dart/random_driving_4_sept_bag": 0.6,
    "dart/mpcc_race_2025_test_01": 2.0,
    "dart/slippery_floor_apr25_2025_04_16_16_21_24": 2.0,
    "f1tenth_optitrack/slalom_clean_v_1_5_d_0_208": 0.1,
    "f1tenth_optitrack/slalom_noisy_v_2_0_d_0_312": 0.2,
    "f1tenth_optitrack/skidpad_ccw_clean_v_1_0_d_0_416": 0.12,
    "f1tenth_frictionmaps/ds5": 0.4,
    "genesis/rfs_path1": 0.16,
    "iac_av21/putnam": 0.2,
    "las_rccar/train_2": 0.6,
    "nigel_real/straight": 0.09,
    "sample/recording": 0.01,
}


@lru_cache(maxsize=8)  # the bags of the real Nigel are read by several tests
def recording_of(path: Path, shared: Path) -> Recording:
    """Read a description, or skip where one of its files is not here."""
    own = path.stem if path.parent == FOLDER else path.parent.name
    data = SAMPLE if path.parent == SAMPLE else shared / "recordings" / own
    for table in read_description(path).tables:
        if not (data / table.file).is_file():
            pytest.skip(f"{data / table.file} is not here: it is other people's data")
    (recording,) = read_recordings(path, data)
    return recording


@pytest.mark.parametrize("path", ALL, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_a_description_is_read_and_names_a_car_that_loads(path: Path, shared: Path) -> None:
    recording = recording_of(path, shared)
    assert {"pose.x", "pose.y", "pose.yaw", "command.steering"} <= recording.channels.keys()
    assert len(load_car(recording.vehicle).terms) > 5


@pytest.mark.parametrize("name", REPLAYED)
def test_a_described_recording_replays(name: str, shared: Path) -> None:
    recording = recording_of(FOLDER / f"{name}.yaml", shared)
    run = free_run(recording, load_car(recording.vehicle), horizon_s=1.0)
    error = run.position_error()[:, -1]
    assert np.isfinite(error).mean() > 0.9
    assert np.median(error[np.isfinite(error)]) < REPLAYED[name]


def test_every_real_set_has_descriptions() -> None:
    assert {path.parent.name for path in ALL} >= {
        "cpm_ucar", "dart", "f1tenth_frictionmaps", "f1tenth_optitrack", "genesis", "iac_av21",
        "las_rccar", "nigel_real",
    }  # fmt: skip


def test_every_description_of_other_people_s_data_names_where_it_is_from() -> None:
    for path in ALL:
        assert path.parent == SAMPLE or read_description(path).source, path


def test_the_sample_comes_with_the_repository_and_is_small() -> None:
    (recording,) = read_recordings(SAMPLE)
    assert np.ptp(recording.channel("pose.x").t) == pytest.approx(60.0, abs=0.5)
    assert sum(file.stat().st_size for file in SAMPLE.iterdir()) < LARGEST_SAMPLE_BYTES


@pytest.mark.parametrize("path", NIGEL, ids=lambda path: path.stem)
def test_the_real_nigel_has_scans_and_odometry_of_the_same_stamps(path: Path, shared: Path) -> None:
    recording = recording_of(path, shared)
    scans, odometry = recording.scans, recording.channel("pose.x")
    assert scans is not None
    assert scans.ranges.shape == (len(scans.t), 1147)
    assert np.isin(odometry.t, scans.t).mean() > 0.97, "a scan or two came before the bag began"
    turn_s = scans.time_increment * (scans.ranges.shape[1] - 1)
    assert np.all((turn_s > 0.13) & (turn_s < 0.15))


@pytest.mark.parametrize("path", NIGEL, ids=lambda path: path.stem)
def test_the_real_nigel_stops_when_the_serial_line_has_carried_the_last_command(
    path: Path, shared: Path
) -> None:
    recording = recording_of(path, shared)
    throttle, x = recording.channel("command.throttle"), recording.channel("pose.x")
    stopped_s = x.t[np.flatnonzero(np.abs(x.values - x.values[-1]) > 0.03)[-1]]
    zero_s = throttle.t[np.flatnonzero(throttle.values > 0.0)[-1] + 1]
    assert -0.1 < zero_s - stopped_s < 0.5
    assert throttle.t[-1] == pytest.approx(x.t[-1]), "the last command holds: there is no watchdog"


@pytest.mark.parametrize("path", NIGEL, ids=lambda path: path.stem)
def test_the_real_nigel_drives_forwards(path: Path, shared: Path) -> None:
    recording = recording_of(path, shared)
    assert np.percentile(recording.channel("speed").values, 90) > 0.3
    assert recording.channel("pose.x").values[-1] > 1.5
