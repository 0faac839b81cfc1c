"""Free runs start where the car was and measure how far the simulator strays."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.__main__ import main
from scm.errors import RecordingError
from scm.geometry import Pose2
from scm.recording.read import Channel, Recording, read_recordings
from scm.replay.free_run import HORIZONS_S, error_table, free_run
from scm.vehicles.car import Car, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.sensor_correction import POSES
from scm.vehicles.sensor_fault import Series, apply_faults


@pytest.fixture(scope="module")
def nigel() -> Car:
    return load_car("nigel")


def drive(car: Car, seconds: float = 20.0, drag: float = 0.0) -> Recording:
    """Record a weaving drive of the simulator itself: poses at 100 Hz, commands at 20 Hz."""
    fleet = Fleet(car, 1)
    row = fleet.add(Pose2(0.0, 0.0, 0.3))
    if drag:
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


def two_cars(folder: Path, nigel: Car) -> Path:
    """Write a drive of one car, and of a second one whose steering was not recorded."""
    recording = drive(nigel, 4.0)
    names = [name for name in recording.channels if name != "command.steering"]
    rows = np.stack(
        [recording.channel("pose.x").t, *(c.values for c in recording.channels.values())]
    )
    np.savetxt(folder / "t.csv", rows.T, "%.9f", ",", header=",".join(("t", *recording.channels)),
               comments="")  # fmt: skip
    tables = "".join(
        f"  - file: t.csv\n    vehicle: {car}\n    time: {{column: t}}\n    channels:\n"
        + "".join(f"      {n}: {{column: {n}, unit: {unit_of(n)}}}\n" for n in channels)
        for car, channels in (("dart", names), ("nigel", recording.channels))
    )
    (folder / "recording.yaml").write_text(f"recording: 1\ntables:\n{tables}")
    return folder


def unit_of(name: str) -> str:
    return {"pose.x": "m", "pose.y": "m", "pose.yaw": "rad"}.get(name, '"1"')


def test_a_car_that_cannot_be_replayed_does_not_stop_the_others(
    nigel: Car, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(two_cars(tmp_path, nigel)), "nowhere.yaml"]) == 0
    printed = capsys.readouterr()
    assert "car nigel: 1 windows of 3 s" in printed.out
    assert "scm replay: dart: " in printed.err
    assert "missing: command.steering" in printed.err
    assert "nowhere.yaml: no recording here" in printed.err


def test_a_replay_of_nothing_exits_with_2_and_saves_nothing(nigel: Car, tmp_path: Path) -> None:
    saved = tmp_path / "windows.csv"
    words = ["replay", str(two_cars(tmp_path, nigel)), "--vehicle", "dart", "--save", str(saved)]
    assert main(words) == 2
    assert not saved.exists()


def test_what_a_replay_lacks_is_said_at_once(nigel: Car) -> None:
    recording = drive(nigel, 4.0)
    recording.channels["command.speed"] = recording.channels.pop("command.throttle")
    del recording.channels["pose.yaw"]
    with pytest.raises(RecordingError) as error:
        free_run(recording, nigel)
    assert "missing: command.throttle, pose.yaw" in str(error.value)
    assert "nigel has no speed_control, so command.speed cannot drive it" in str(error.value)


def test_commands_whose_clock_was_reset_are_refused(nigel: Car) -> None:
    recording = drive(nigel, 8.0)
    throttle = recording.channels["command.throttle"]
    t = np.where(throttle.t < 4.0, throttle.t, throttle.t - 4.0)
    recording.channels["command.throttle"] = replace(throttle, t=t)
    with pytest.raises(RecordingError, match=r"command\.throttle: time jumps back"):
        free_run(recording, nigel)


def test_clocks_that_never_meet_are_told(nigel: Car) -> None:
    recording = drive(nigel, 8.0)
    for name in ("command.throttle", "command.steering"):
        recording.channels[name] = replace(
            recording.channels[name], t=recording.channels[name].t + 1.7e9
        )
    with pytest.raises(RecordingError, match=r"poses from 0\.000 s to 7\.990 s, commands from 17"):
        free_run(recording, nigel)


def test_a_percentage_taken_for_a_ratio_is_refused(nigel: Car) -> None:
    recording = drive(nigel, 4.0)
    recording.channels["command.throttle"].values[:] *= 100.0
    with pytest.raises(RecordingError, match=r"command\.throttle: reaches 99.*expected -1 to 1"):
        free_run(recording, nigel)


def test_an_angle_needs_a_car_that_says_its_limit(nigel: Car) -> None:
    recording = drive(nigel, 4.0)
    steering = recording.channels["command.steering"]
    recording.channels["command.steering"] = replace(steering, dimension="angle")
    values = {key: v for key, v in nigel.values.items() if key != "steering.limit_rad"}
    with pytest.raises(RecordingError, match=r"nigel has no steering\.limit_rad"):
        free_run(recording, replace(nigel, values=values))


@pytest.mark.parametrize("horizon_s", [0.0, -1.0, 0.01, float("nan"), float("inf")])
def test_a_horizon_without_length_is_refused(nigel: Car, horizon_s: float) -> None:
    with pytest.raises(RecordingError, match=r"horizon: got .*expected 0\.05 s or more"):
        free_run(drive(nigel, 1.0), nigel, horizon_s)


def test_a_window_may_last_as_long_as_the_recording(nigel: Car) -> None:
    recording = drive(nigel, 4.01)
    assert_allclose(free_run(recording, nigel, 4.0).start_s, [0.0])
    with pytest.raises(
        RecordingError, match=r"no window of 4\.1 s: poses from 0\.000 s to 4\.000 s"
    ):
        free_run(recording, nigel, 4.1)


def test_a_horizon_that_is_no_multiple_of_the_saved_step_is_reached(nigel: Car) -> None:
    run = free_run(drive(nigel, 4.0), nigel, 0.52)
    assert_allclose(run.t_s[[0, 1, -2, -1]], [0.0, 0.05, 0.5, 0.52])
    assert np.median(run.position_error()[:, -1]) < 0.004


def test_the_horizon_asked_for_is_in_the_table(
    root: Path, shared: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tinytown = str(root / "recordings/autodrive_sim_tinytown.yaml")
    data = str(shared / "recordings/autodrive_sim_tinytown")
    assert main(["replay", tinytown, "--data", data, "--horizon-s", "2"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["0.5", "s", "1", "s", "2", "s"] in lines


def test_a_car_file_may_lie_beside_the_description(tmp_path: Path, root: Path) -> None:
    car = (root / "scm/vehicles/types/nigel.toml").read_text()
    (tmp_path / "mine.toml").write_text(car)
    (tmp_path / "t.csv").write_text("t,x\n0,1\n")
    (tmp_path / "recording.yaml").write_text(
        "recording: 1\nvehicle: mine.toml\ntables:\n  - file: t.csv\n    time: {column: t}\n"
        "    channels: {pose.x: {column: x, unit: m}}\n"
    )
    (recording,) = read_recordings(tmp_path)
    assert load_car(recording.vehicle).path == tmp_path / "mine.toml"


@pytest.mark.parametrize("save", ["", "nowhere/windows.csv"])
def test_a_place_that_cannot_be_written_is_refused_before_the_work(
    tmp_path: Path, save: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", "nowhere.yaml", "--save", str(tmp_path / save)]) == 2
    assert "--save" in capsys.readouterr().err


def test_a_car_with_a_speed_control_is_driven_by_speed(root: Path) -> None:
    car = load_car(str(root / "recordings/cars/f1tenth_clemson.toml"))
    recording = drive(car, 8.0)
    throttle = recording.channels.pop("command.throttle")
    speed = replace(throttle, values=10.0 * throttle.values, dimension="speed")
    recording.channels["command.speed"] = speed
    run = free_run(recording, car, 1.0)
    assert np.median(run.position_error()[:, -1]) < 0.03
    recording.channels["command.speed"] = replace(speed, values=0.8 * speed.values)
    slower = free_run(recording, car, 1.0)
    assert np.median(slower.speed_error()[:, -1]) > 0.2
    recording.channels["speed"] = recording.channels.pop("command.speed")
    assert_allclose(free_run(recording, car, 1.0).x, slower.x)


def test_a_measured_battery_voltage_drives_the_motors(nigel: Car) -> None:
    recording = drive(nigel, 6.0)
    t = recording.channels["pose.x"].t
    recording.channels["battery.voltage"] = Channel(
        t, np.full(len(t), 9.0), None, (0.0, 0.0), "voltage"
    )
    weak = free_run(recording, nigel, 3.0)
    assert np.median((weak.speed_measured - weak.speed)[:, -1]) > 0.02


def test_commands_before_the_first_are_the_first(nigel: Car) -> None:
    recording = drive(nigel, 6.0)
    for name in ("command.throttle", "command.steering"):
        whole = recording.channels[name]
        keep = whole.t > 2.0
        recording.channels[name] = replace(whole, t=whole.t[keep], values=whole.values[keep])
    run = free_run(recording, nigel, 1.0)
    assert run.yaw_error()[0, -1] < 0.02


def test_windows_late_in_a_drive_feel_a_battery_that_has_run_down(nigel: Car) -> None:
    tired = nigel.with_terms(["battery_sag"], {"drive.sag_per_min": 0.5})
    recording = drive(tired, seconds=40.0)
    own = dict(error_table(free_run(recording, tired)))["position [m]"][:, 1].max()
    fresh = dict(error_table(free_run(recording, nigel)))["position [m]"][:, 1].max()
    assert own < 0.006
    assert fresh > 5.0 * own


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("camera_tilt", {"measure.camera_tilt_x_per_m": 0.12}),
        ("pose_latency", {"measure.pose_delay_s": 0.15}),
        ("pose_scale", {"measure.pose_scale": 1.1}),
    ],
)
def test_faults_of_measurement_in_the_car_file_are_undone(
    nigel: Car, name: str, values: dict[str, float]
) -> None:
    faulty, recording = nigel.with_measures([name], values), drive(nigel)
    seen = apply_faults({n: Series(recording.channels[n].t, recording.channels[n].values)
                    for n in POSES}, faulty.faults)  # fmt: skip
    channels = {n: replace(recording.channels[n], t=s.t_s, values=s.values)
                for n, s in seen.items()}  # fmt: skip
    recording = replace(recording, channels={**recording.channels, **channels})
    plain = dict(error_table(free_run(recording, nigel)))["position [m]"][2, 0]
    known = dict(error_table(free_run(recording, faulty)))["position [m]"][2, 0]
    assert plain > 0.02
    assert known < 0.004
