"""Free runs start where the car was and measure how far the simulator strays."""

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.__main__ import main
from scm.errors import RecordingError
from scm.geometry import Pose2
from scm.recording.read import Channel, Recording, read_recordings
from scm.replay import HORIZONS_S, error_table, free_run
from scm.vehicles.car import Car, load_car
from scm.vehicles.fleet import Fleet


@pytest.fixture(scope="module")
def nigel() -> Car:
    return load_car("nigel")


def drive(car: Car, seconds: float = 20.0, drag: float = 0.0) -> Recording:
    """Record a weaving drive of the simulator itself: poses at 100 Hz, commands at 20 Hz."""
    fleet = Fleet(car, 1)
    row = fleet.add(Pose2(0.0, 0.0, 0.3))
    fleet.set_parameter(row, "body.drag_linear_ns_m", drag)
    times = np.arange(round(seconds * 100)) / 100.0
    rows = np.empty((len(times), 5))
    for k, t in enumerate(times):
        if k % 5 == 0:
            fleet.throttle[row] = 0.7 + 0.3 * np.sin(0.5 * t)
            fleet.steering[row] = 0.6 * np.sin(0.8 * t)
        pose = fleet.pose(row)
        rows[k] = (pose.x, pose.y, pose.yaw, fleet.throttle[row], fleet.steering[row])
        fleet.advance(0.01)
    names = ("pose.x", "pose.y", "pose.yaw", "command.throttle", "command.steering")
    channels = {
        name: Channel(times, rows[:, i].copy(), None, (0.0, 0.0), "ratio")
        for i, name in enumerate(names)
    }
    return Recording(Path("made by the simulator"), car.name, channels)


def test_the_simulator_replays_its_own_drive(nigel: Car) -> None:
    run = free_run(drive(nigel), nigel)
    assert len(run.start_s) == 6
    errors = dict(error_table(run))
    # what is left: the start velocities come from poses smoothed over 0.2 s
    assert errors["position [m]"][:, 1].max() < 0.004
    assert errors["yaw [rad]"][:, 1].max() < 0.01
    assert errors["speed [m/s]"][:, 1].max() < 0.004


def test_physics_that_is_missing_shows_as_error(nigel: Car) -> None:
    errors = dict(error_table(free_run(drive(nigel, drag=5.0), nigel)))
    assert errors["speed [m/s]"][2, 0] > 0.008  # 1 N of 14 N at stall: some 7 % of the speed


def test_errors_grow_with_the_horizon_on_real_data(root: Path, shared: Path) -> None:
    (recording,) = read_recordings(
        root / "recordings/dart/free_driving_10_02_28.yaml", shared / "recordings/dart"
    )
    run = free_run(recording, load_car("dart"))
    position = dict(error_table(run))["position [m]"][:, 0]
    assert len(run.start_s) > 25
    assert 0.0 < position[0] < position[1] < position[2]
    assert (
        position[0] < 0.1
    )  # the published car drifts less than a tenth of a metre in half a second


def test_windows_across_a_gap_are_left_out(nigel: Car) -> None:
    recording = drive(nigel)
    for name in ("pose.x", "pose.y", "pose.yaw"):
        whole = recording.channels[name]
        keep = (whole.t < 7.0) | (whole.t > 8.0)
        recording.channels[name] = Channel(
            whole.t[keep], whole.values[keep], None, (0.0, 0.0), "length"
        )
    starts = free_run(recording, nigel).start_s
    assert_allclose(starts, [0.0, 3.0, 9.0, 12.0, 15.0])


def test_a_recording_that_is_too_short_is_refused(nigel: Car) -> None:
    with pytest.raises(RecordingError, match="no window of 3"):
        free_run(drive(nigel, seconds=2.0), nigel)


def test_the_command_prints_a_table_and_saves_windows(
    root: Path, shared: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(
        [
            "replay",
            str(root / "recordings/autodrive_sim_tinytown.yaml"),
            *("--data", str(shared / "recordings/autodrive_sim_tinytown")),
            *("--save", str(tmp_path / "windows.csv")),
        ]
    )
    printed = capsys.readouterr().out
    assert code == 0
    for label in ("0.5 s", "1 s", "3 s", "position [m]", "yaw [rad]", "speed [m/s]"):
        assert label in printed
    with (tmp_path / "windows.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == ["window", "t", "x", "y", "yaw", "x_meas", "y_meas", "yaw_meas"]
    assert float(rows[0]["x"]) == pytest.approx(float(rows[0]["x_meas"]), abs=1e-5)
    assert len({row["window"] for row in rows}) == 9


def test_a_shorter_horizon_prints_only_what_it_reaches(
    root: Path, shared: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tinytown = str(root / "recordings/autodrive_sim_tinytown.yaml")
    data = str(shared / "recordings/autodrive_sim_tinytown")
    assert main(["replay", tinytown, "--data", data, "--horizon-s", "1"]) == 0
    assert "3 s" not in capsys.readouterr().out.splitlines()[2]
    assert HORIZONS_S == (0.5, 1.0, 3.0)


def test_bad_input_exits_with_2_and_says_where(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", "nowhere.yaml"]) == 2
    assert "nowhere.yaml: no recording here" in capsys.readouterr().err
