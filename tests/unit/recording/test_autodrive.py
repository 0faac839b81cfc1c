"""Logs of AutoDRIVE's data recorder become recordings, recordings become such logs."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from scm.__main__ import main
from scm.errors import RecordingError
from scm.recorder.autodrive_described import car_track
from scm.recording.autodrive import CAR, MOTION, stamp_ms, stamp_of
from scm.recording.autodrive_import import Imported, import_logs
from scm.recording.autodrive_write import CarTrack, LightTrack, Series, write_logs
from scm.recording.read import Recording, read_recordings
from scm.vehicles.car import TYPES_DIR

NIGEL = TYPES_DIR / "nigel.toml"
START_MS = stamp_ms("2023_11_08_10_05_59_360")
SCAN = " ".join(["1.5"] * 359 + ["inf"])
TINY_TOWN = Path(__file__).parents[4] / "shared/recordings/autodrive_sim_tinytown"


def row(k: int, **changed: str) -> str:
    """Return a row of a car that goes 0.2 m/s along x and turns left, one in 50 ms."""
    cells = dict.fromkeys(CAR, "0") | {
        "timestamp": stamp_of(START_MS + 50 * k),
        "throttle": "0.75",
        "steering": "0.25",
        "posX": f"{0.01 * k:g}",
        "posZ": "0.0325",
        "roll": "6.283",
        "yaw": "6.2",
        "speed": "0.2",
        "angZ": "0.4",
    }
    return ",".join({**cells, **changed}.values())


def logs(folder: Path, *rows: str, **more: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "V1 Log.csv").write_text("\n".join(rows) + "\n")
    for name, text in more.items():
        (folder / f"{name} Log.csv").write_text(text)
    return folder


def imported(folder: Path, steering_sign: int = 1, unity_axes: bool = False) -> Imported:
    return import_logs(
        folder,
        folder / "out",
        car="nigel",
        car_file=NIGEL,
        steering_sign=steering_sign,
        unity_axes=unity_axes,
        m_per_count=1e-4,
        axle_m=0.0325,
    )


def read_one(folder: Path) -> Recording:
    (recording,) = read_recordings(folder / "out")
    return recording


def test_rows_without_a_header_become_channels_in_si(tmp_path: Path) -> None:
    folder = logs(tmp_path / "log", *(row(k) for k in range(4)), TL3=f"{stamp_of(START_MS)},2\n")
    assert imported(folder).left_out == []
    recording = read_one(folder)
    assert_allclose(recording.channel("pose.x").t, [0.0, 0.05, 0.1, 0.15])
    assert_allclose(recording.channel("pose.x").values, [0.0, 0.01, 0.02, 0.03])
    assert_allclose(recording.channel("pose.z").values, 0.0, atol=1e-12)
    assert_allclose(recording.channel("pose.roll").values, 6.283 - math.tau)
    assert_allclose(recording.channel("imu.accel_z").values, 9.80665)
    assert recording.channel("command.steering").dimension == "angle"
    assert_allclose(recording.channel("command.steering").values, 0.25)
    assert recording.channel("light.TL3").values.tolist() == [2.0]


def test_columns_under_a_header_may_stand_in_any_order(tmp_path: Path) -> None:
    head = "posY,mood,PosX,timestamp"
    folder = logs(tmp_path / "log", head, f"2,calm,1,{stamp_of(5)}", f"3,gay,1,{stamp_of(55)}")
    imported(folder)
    assert read_one(folder).channel("pose.y").values.tolist() == [2.0, 3.0]
    assert "mood" in (folder / "out/V1.csv").read_text()


@pytest.mark.parametrize("cameras", [1, 2])
def test_pictures_and_scans_come_along_though_a_path_has_commas(
    tmp_path: Path, cameras: int
) -> None:
    folder = tmp_path / "log"
    paths = [f"C:\\a, b\\V1 Camera Frames\\Camera{c}_Frame_1.jpg" for c in range(cameras)]
    logs(folder, *(",".join([row(k), *paths, SCAN]) for k in range(3)))
    (folder / "V1 Camera Frames").mkdir()
    (folder / "V1 Camera Frames/Camera0_Frame_1.jpg").write_bytes(b"jpg")
    told = imported(folder).remarks
    with (folder / "out/V1.csv").open() as stream:
        first = next(csv.DictReader(stream))
    assert first["front_camera"] == str(folder / "V1 Camera Frames/Camera0_Frame_1.jpg")
    assert first.get("rear_camera") == (paths[1] if cameras == 2 else None)
    with np.load(folder / "out/V1_lidar.npz") as scans:
        assert scans["ranges"].shape == (3, 360)
        assert np.isinf(scans["ranges"][:, 359]).all()
    assert any("may be stale" in line for line in told)


def test_a_scan_of_many_beams_is_read(tmp_path: Path) -> None:
    scan = " ".join(["1.234567"] * 20_000)
    folder = logs(tmp_path / "log", f"{row(0)},,,{scan}")
    imported(folder)
    with np.load(folder / "out/V1_lidar.npz") as scans:
        assert scans["ranges"].shape == (1, 20_000)


BAD = [
    (row(9, posX="north"), "posX: got 'north', expected a number"),
    (row(9, timestamp="2023_13_08_10_05_59_360"), "expected a time yyyy_MM_dd_HH_mm_ss_fff"),
    (row(9)[:40], "cells, expected 18"),
    ("\0", "got 1 cells, expected 18"),
    (row(9, posX="1\r2"), "posX: got '1\\r2', expected a number"),
    (row(9) + ",7,8", "got 20 cells, expected 18"),
]


@pytest.mark.parametrize(("line", "why"), BAD)
def test_a_bad_line_is_told_and_kept_aside(tmp_path: Path, line: str, why: str) -> None:
    folder = logs(tmp_path / "log", row(0), row(1), line, row(2), row(3))
    (left_out,) = imported(folder).left_out
    assert left_out.file == "V1 Log.csv"
    assert left_out.line == 3
    assert why in left_out.why
    assert len(read_one(folder).channel("pose.x").t) == 4
    with (folder / "out/left_out.csv").open(newline="") as stream:
        assert [cells[3] for cells in csv.reader(stream)] == ["text", line]


def test_a_light_that_shows_what_is_no_state_is_told(tmp_path: Path) -> None:
    light = f"{stamp_of(START_MS)},1\n{stamp_of(START_MS + 9)},4\n"
    (left_out,) = imported(logs(tmp_path / "log", row(0), TL1=light)).left_out
    assert (left_out.file, left_out.why) == ("TL1 Log.csv", "state: got '4', expected 0 to 3")


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        (["a,b,c"], "1 of 1 rows have 3 cells, expected 18, 20, 21, 35"),
        ([row(0, posX="north")], "line 1: posX: got 'north'"),
        ([""], "empty"),
        (["timestamp,posX,posx"], "columns named twice: posX"),
        (["timestamp,posX"], "no row of AutoDRIVE's recorder"),
        ([stamp_of(0) + "," * 17], "1 rows without a number"),
    ],
)
def test_a_file_of_something_else_is_refused(tmp_path: Path, lines: list[str], why: str) -> None:
    with pytest.raises(RecordingError, match=why):
        imported(logs(tmp_path / "log", *lines))


@pytest.mark.parametrize("header", [[], [",".join(CAR)]])
def test_a_log_of_which_most_rows_have_decimal_commas_is_refused(
    tmp_path: Path, header: list[str]
) -> None:
    whole = dict.fromkeys(CAR, "0")
    rows = [row(k, **{**whole, "timestamp": stamp_of(START_MS + 50 * k)}) for k in range(6)]
    rows += [row(k).replace(".", ",") for k in range(6, 200)]
    with pytest.raises(RecordingError, match=r"of 200 rows .*decimals written with a comma"):
        imported(logs(tmp_path / "log", *header, *rows))


def test_clocks_that_repeat_gap_and_go_back_are_told(tmp_path: Path) -> None:
    at = [0, 0, 40, 20, 60, 900, 900 - 3_600_000, 950 - 3_600_000]
    rows = [row(k, timestamp=stamp_of(START_MS + ms)) for k, ms in enumerate(at)]
    folder = logs(tmp_path / "log", *rows)
    told = "\n".join(imported(folder).remarks)
    assert "1 stamps repeat" in told
    assert "1 stamps go back by less than a second" in told
    assert "line 7: the clock was set back by 3600.000 s" in told
    assert "1 gaps of more than 0.25 s, the longest of 0.840 s before line 6" in told
    t = read_one(folder).channel("pose.x").t
    assert_allclose(t, [0.0, 0.0, 0.04, 0.02, 0.06, 0.9, 1.9, 1.95])


def test_steering_that_turns_against_the_car_is_told_and_can_be_turned(tmp_path: Path) -> None:
    folder = logs(tmp_path / "log", *(row(k, steering="-0.25") for k in range(30)))
    assert "against its steering" in "\n".join(imported(folder).remarks)
    (folder / "out").rename(tmp_path / "wrong")
    assert "against" not in "\n".join(imported(folder, steering_sign=-1).remarks)
    assert_allclose(read_one(folder).channel("command.steering").values, 0.25)


def test_unity_axes_are_told_and_converted(tmp_path: Path) -> None:
    rows = [
        row(k, posX="1", posY="0.03", posZ=f"{k}", roll="0", pitch="0.5", yaw="0", angY="-0.1")
        for k in range(3)
    ]
    folder = logs(tmp_path / "log", *rows)
    assert "--axes unity" in "\n".join(imported(folder).remarks)
    (folder / "out").rename(tmp_path / "wrong")
    imported(folder, unity_axes=True)
    recording = read_one(folder)
    assert_allclose(recording.channel("pose.x").values, [0.0, 1.0, 2.0])
    assert_allclose(recording.channel("pose.y").values, -1.0)
    assert_allclose(recording.channel("pose.yaw").values, math.tau - 0.5)
    assert_allclose(recording.channel("imu.gyro_z").values, 0.1)


def counted(m_per_count: float, n: int = 20, **changed: str) -> list[str]:
    """Return rows of a car whose wheels count so; `import_logs` is told 0.1 mm a count."""
    counts = [f"{round(0.01 * k / m_per_count)}" for k in range(n)]
    return [row(k, leftTicks=c, rightTicks=c, **changed) for k, c in enumerate(counts)]


def test_wheels_that_slip_are_told_and_kept(tmp_path: Path) -> None:
    folder = logs(tmp_path / "log", *counted(1e-4 / 1.11))
    told = "\n".join(imported(folder).remarks)
    assert "encoders read +11.0%" in told
    assert "slip" in told
    assert read_one(folder).channel("encoder.left").values[-1] == round(0.19 * 1.11e4)


@pytest.mark.parametrize("factor", [0.7, 0.9, 1.3, 1.5])
def test_what_slip_cannot_do_is_not_put_down_to_slip(tmp_path: Path, factor: float) -> None:
    told = "\n".join(imported(logs(tmp_path / "log", *counted(1e-4 / factor))).remarks)
    assert f"encoders read {factor - 1:+.1%}" in told
    assert "slip" not in told
    assert "encoder.counts_per_revolution" in told
    assert "--car" not in told


@pytest.mark.parametrize("factor", [0.17, 0.2, 0.5, 6.0])
def test_wheels_of_another_car_ask_for_its_file(tmp_path: Path, factor: float) -> None:
    told = "\n".join(imported(logs(tmp_path / "log", *counted(1e-4 / factor))).remarks)
    assert "V1 Log.csv is not of the car nigel" in told
    assert "give its car file with --car" in told
    assert "slip" not in told


def test_of_several_cars_the_one_that_is_another_is_named(tmp_path: Path) -> None:
    rows = {f"V{k}": "\n".join(counted(m)) for k, m in ((1, 1e-4), (2, 5e-4), (3, 1e-4))}
    folder = logs(tmp_path / "log", rows.pop("V1"), **rows)
    (told,) = [line for line in imported(folder).remarks if "is not of the car" in line]
    assert "V2 Log.csv is not of the car nigel" in told
    assert "put its car file in place of V2.toml" in told


def test_backward_counts_are_counts(tmp_path: Path) -> None:
    rows = [row(k, posX=f"{-0.01 * k:g}", leftTicks=f"{-100 * k}", rightTicks=f"{-100 * k}")
            for k in range(20)]  # fmt: skip
    made = imported(logs(tmp_path / "log", *rows))
    assert made.left_out == []
    assert "encoders" not in "\n".join(made.remarks)
    assert read_one(tmp_path / "log").channel("encoder.left").values[-1] == -1900


@pytest.mark.parametrize("column", ["leftTicks", "rightTicks"])
def test_rows_with_a_fraction_of_a_count_are_left_out(tmp_path: Path, column: str) -> None:
    rows = counted(1e-4, 40)
    rows[:2] = [row(k, **{column: "0.2"}) for k in range(2)]
    made = imported(logs(tmp_path / "log", *rows))
    assert [one.line for one in made.left_out] == [1, 2]
    assert made.left_out[0].why == f"{column}: got 0.2, expected whole counts of an encoder"
    assert "encoders read" not in "\n".join(made.remarks)
    recording = read_one(tmp_path / "log")
    assert recording.channel("encoder.left").values[0] == 200
    with (tmp_path / "log/out/left_out.csv").open(newline="") as stream:
        assert [cells[3] for cells in csv.reader(stream)][1:] == rows[:2]


def test_a_column_of_fractions_is_no_encoder(tmp_path: Path) -> None:
    rows = [row(k, leftTicks=f"{0.31 * k:g}", rightTicks=f"{0.3 * k:g}") for k in range(40)]
    made = imported(logs(tmp_path / "log", *rows))
    assert made.left_out == []
    assert "leftTicks: 39 of 40 cells are not whole (0.31, 0.62, 0.93, ...)" in "\n".join(
        made.remarks
    )
    channels = read_one(tmp_path / "log").channels
    assert "pose.x" in channels
    assert not {"encoder.left", "encoder.right"} & channels.keys()
    assert "0.31" in (tmp_path / "log/out/V1.csv").read_text()


NOTHING = dict.fromkeys((*MOTION, "throttle", "steering"), "0")


@pytest.mark.parametrize("first", [NOTHING, {"posX": "7", "posY": "-3"}, {"posX": "0.9"}])
def test_first_rows_that_hold_defaults_are_left_out(tmp_path: Path, first: dict[str, str]) -> None:
    rows = counted(1e-4, 40, posY="1.5")
    rows[:3] = [row(k, **first) for k in range(3)]
    made = imported(logs(tmp_path / "log", *rows))
    assert [one.line for one in made.left_out] == [1, 2, 3]
    assert "placeholder" in made.left_out[0].why
    assert "encoders read" not in "\n".join(made.remarks)
    recording = read_one(tmp_path / "log")
    assert recording.channel("pose.x").values[0] == pytest.approx(0.03)
    assert recording.channel("pose.x").t[0] == 0.0


def test_a_car_that_stands_before_it_drives_off_loses_no_row(tmp_path: Path) -> None:
    rows = [row(k, posX=f"{max(0.0, 0.01 * (k - 10)):g}") for k in range(40)]
    assert imported(logs(tmp_path / "log", *rows)).left_out == []


def test_a_full_size_car_that_is_driven_fast_from_the_first_row_on_loses_none(
    tmp_path: Path,
) -> None:
    rows = [row(k, posX=f"{1.5 * k:g}", speed="30") for k in range(40)]
    assert imported(logs(tmp_path / "log", *rows)).left_out == []


def test_an_encoder_that_stays_while_the_car_drives_is_told(tmp_path: Path) -> None:
    rows = [row(k, leftTicks="5", rightTicks=f"{100 * k}") for k in range(40)]
    told = "\n".join(imported(logs(tmp_path / "log", *rows)).remarks)
    assert "leftTicks stays at 5 while poses go 0.39 m" in told
    assert "encoders read" not in told


def test_a_car_put_elsewhere_and_a_counter_that_begins_anew_are_no_other_car(
    tmp_path: Path,
) -> None:
    rows = [row(k, posX=f"{0.01 * k + 9 * (k > 20):g}", leftTicks=f"{100 * (k % 30)}",
                rightTicks=f"{100 * (k % 30)}") for k in range(60)]  # fmt: skip
    assert "encoders read" not in "\n".join(imported(logs(tmp_path / "log", *rows)).remarks)


def test_a_light_that_was_saved_as_decimals_is_read(tmp_path: Path) -> None:
    light = f"{stamp_of(START_MS)},2.0\n{stamp_of(START_MS + 9)},1.5\n"
    (left_out,) = imported(logs(tmp_path / "log", row(0), TL1=light)).left_out
    assert left_out.why == "state: got '1.5', expected 0 to 3"
    assert read_one(tmp_path / "log").channel("light.TL1").values.tolist() == [2.0]


def test_several_cars_are_several_recordings(tmp_path: Path) -> None:
    light = f"{stamp_of(START_MS)},3\n"
    other = "\n".join(row(k, posY="1") for k in range(3))
    folder = logs(tmp_path / "log", row(0), row(1), V2=other, TL1=light)
    imported(folder)
    first, second = read_recordings(folder / "out")
    assert (first.name, second.name) == ("V1.toml", "V2.toml")
    assert second.channel("pose.y").values.tolist() == [1.0, 1.0, 1.0]
    assert second.channel("light.TL1").values.tolist() == [3.0]


def test_a_recording_is_never_written_over(tmp_path: Path) -> None:
    folder = logs(tmp_path / "log", row(0))
    imported(folder)
    with pytest.raises(RecordingError, match="never written over"):
        imported(folder)


def test_lights_alone_are_no_recording_and_folders_of_logs_are_named(tmp_path: Path) -> None:
    logs(tmp_path / "run_1", row(0))
    (tmp_path / "TL1 Log.csv").write_text(f"{stamp_of(0)},1\n")
    with pytest.raises(RecordingError, match=r"expected 'V1 Log\.csv' in it; there are in run_1"):
        imported(tmp_path)


def drive(n: int, speed: float, turn: float) -> CarTrack:
    """Return a car on a circle that begins in the middle of nowhere, told something else often."""
    t = 0.02 * np.arange(n) + 0.0123
    yaw = 3.0 + turn * t
    told = 0.02 * np.arange(n)
    steering = np.round(np.sin(9.0 * told), 6)
    return CarTrack(
        "n1",
        {
            "posX": Series(t, 1.4 + speed * np.cos(yaw)),
            "posY": Series(t, speed * np.sin(yaw)),
            "yaw": Series(t, yaw),
            "throttle": Series(told, np.round(np.cos(7.0 * told), 6)),
            "steering": Series(told, steering),
            "leftTicks": Series(t, np.arange(n) * 1_234_567.0),
        },
    )


@settings(max_examples=15)
@given(n=st.integers(5, 60), speed=st.floats(0, 2), turn=st.floats(-2, 2), rate_hz=st.floats(5, 60))
def test_there_and_back_keeps_poses_and_commands(
    tmp_path_factory: pytest.TempPathFactory, n: int, speed: float, turn: float, rate_hz: float
) -> None:
    folder = tmp_path_factory.mktemp("there") / "log"
    car = drive(n, speed, turn)
    lights = [LightTrack(2, "crossing", Series(np.array([0.0, 0.05]), np.array([1.0, 3.0])))]
    write_logs(folder, [car], lights, start_ms=START_MS, rate_hz=rate_hz)
    assert imported(folder).left_out == []
    recording = read_one(folder)
    with (folder / "V1 Log.csv").open() as stream:
        t = np.array([(stamp_ms(cells[0]) - START_MS) / 1000.0 for cells in csv.reader(stream)])
    read = {name: channel.values for name, channel in recording.channels.items()}
    for axis in "xy":
        asked = np.interp(t, *car.columns[f"pos{axis.upper()}"])
        assert_allclose(read[f"pose.{axis}"], asked, atol=1e-6)
    turned = read["pose.yaw"] - np.interp(t, *car.columns["yaw"])
    assert_allclose(np.sin(turned / 2.0), 0.0, atol=2e-6)
    held = np.searchsorted(car.columns["throttle"].t, t, "right") - 1
    for name in ("throttle", "steering"):
        assert read[f"command.{name}"].tolist() == car.columns[name].values[held].tolist()
    newest = np.searchsorted(car.columns["leftTicks"].t, t, "right") - 1
    assert read["encoder.left"].tolist() == (newest * 1_234_567.0).tolist()
    lit = np.where(t < 0.05, 1.0, 3.0)
    assert read["light.TL2"].tolist() == lit.tolist()


def test_no_rows_are_made_up_in_a_gap(tmp_path: Path) -> None:
    t = np.array([0.0, 0.1, 0.2, 1.2, 1.3])
    car = CarTrack("n1", {name: Series(t, t) for name in ("posX", "posY", "yaw")})
    (log,) = write_logs(tmp_path / "log", [car], start_ms=0, rate_hz=20.0)
    stamps = [line[-7:-4] for line in (tmp_path / "log/V1 Log.csv").read_text().split(",,,,")]
    assert log.rows == len([k for k in range(27) if k <= 4 or k >= 24]), stamps
    assert "throttle" in log.empty


def test_a_gap_of_a_thousand_years_costs_nothing(tmp_path: Path) -> None:
    t = np.array([0.0, 0.1, 3e10, 3e10 + 0.1])
    car = CarTrack("n1", {name: Series(t, t) for name in ("posX", "posY", "yaw")})
    (log,) = write_logs(tmp_path / "log", [car], start_ms=0, rate_hz=20.0)
    assert log.rows == 6


def test_scans_and_pictures_are_shown_until_they_are_old(tmp_path: Path) -> None:
    t = 0.1 * np.arange(20)
    pose = {name: Series(t, t) for name in ("posX", "posY", "yaw")}
    scans = np.full((1, 360), 2.5)
    car = CarTrack("n1", pose, np.array([0.45]), scans, {0: np.array([0.3, 0.95])})
    (log,) = write_logs(tmp_path / "log", [car], start_ms=START_MS, rate_hz=10.0)
    with (tmp_path / "log/V1 Log.csv").open() as stream:
        rows = list(csv.reader(stream))
    assert [k for k, cells in enumerate(rows) if cells[20]] == [5, 6, 7, 8, 9]
    first = f"V1 Camera Frames/Camera0_Frame_{stamp_of(START_MS + 300)}.jpg"
    assert log.pictures[0] == {0: first, 1: rows[10][18]}
    assert [cells[18] for cells in rows[3:9]] == [first] * 6


def test_a_described_steering_ratio_becomes_an_angle(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,x,s\n" + "".join(f"{0.1 * k},{k},0.5\n" for k in range(9)))
    pose = {name: {"column": "x", "unit": unit} for name, unit in
            (("pose.x", "m"), ("pose.y", "m"), ("pose.yaw", "rad"))}  # fmt: skip
    channels = {**pose, "command.steering": {"column": "s"}}
    table = {"file": "a.csv", "time": {"column": "t"}, "channels": channels}
    text = json.dumps({"recording": 1, "vehicle": "nigel", "tables": [table]})
    (tmp_path / "recording.yaml").write_text(text)
    track = car_track(read_recordings(tmp_path)[0])
    assert_allclose(track.columns["steering"].values, 0.5 * 0.5235988)


def test_the_commands_go_there_and_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = logs(tmp_path / "log", *(row(k) for k in range(100)))
    for words in (
        f"import autodrive {folder} --out {tmp_path / 'ours'}",
        f"export autodrive {tmp_path / 'ours'} --out {tmp_path / 'theirs'} --rate-hz 20 "
        "--start 2023_11_08_10_05_59_360",
    ):
        assert main(words.split(" ")) == 0, capsys.readouterr()
    there = (tmp_path / "theirs/V1 Log.csv").read_text().splitlines()
    numbers = [float(cell) for cell in there[40].split(",")[1:]]
    assert_allclose(numbers, [float(cell) for cell in row(40).split(",")[1:]], atol=2e-7)
    assert there[40].split(",")[0] == row(40).split(",")[0]
    assert len(there) == 100


@pytest.mark.skipif(not TINY_TOWN.is_dir(), reason=f"other people's data is not here: {TINY_TOWN}")
def test_the_simulators_own_log_reads_as_its_description_does(tmp_path: Path) -> None:
    with (TINY_TOWN / "vehicle.csv").open() as stream:
        rows = list(csv.reader(stream))[1:]
    stamped = [[stamp_of(START_MS + round(1000 * float(t))), *cells] for t, *cells in rows]
    folder = logs(tmp_path / "log", *(",".join(cells) for cells in stamped))
    imported(folder)
    description = Path(__file__).parents[3] / "recordings/autodrive_sim_tinytown.yaml"
    (theirs,) = read_recordings(description, TINY_TOWN)
    ours = read_one(folder)
    for name, channel in theirs.channels.items():
        assert_allclose(ours.channel(name).values, channel.values)
        assert_allclose(ours.channel(name).t, channel.t, atol=1e-9)
