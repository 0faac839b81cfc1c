"""A `recording.yaml` and its tables become channels in SI, or a clear error."""

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.errors import RecordingError
from scm.recording.read import Recording, read_recordings

HEADER = "recording: 1\nvehicle: nigel\ntables:\n"
POSE_CSV = "t,x,y,head ing,ok\n0,100,0,90,1\n50,200,0,90,0\n100,300,10,180,1\n"
POSE_TABLE = """\
  - file: pose.csv
    time: {column: t, unit: ms}
    channels:
      pose.x: {column: x, unit: mm, std: 2}
      pose.yaw: {column: head ing, unit: deg}
"""


def write(folder: Path, tables: str = POSE_TABLE, csv: str = POSE_CSV) -> Path:
    (folder / "pose.csv").write_text(csv)
    (folder / "recording.yaml").write_text(HEADER + tables)
    return folder


def read_one(folder: Path) -> Recording:
    (recording,) = read_recordings(folder)
    return recording


def test_units_become_si(tmp_path: Path) -> None:
    recording = read_one(write(tmp_path))
    assert_allclose(recording.channel("pose.x").t, [0.0, 0.05, 0.1])
    assert_allclose(recording.channel("pose.x").values, [0.1, 0.2, 0.3])
    assert recording.channel("pose.x").std == pytest.approx(0.002)
    assert_allclose(recording.channel("pose.yaw").values, [math.pi / 2, math.pi / 2, math.pi])


def test_g_and_km_per_hour_are_understood(tmp_path: Path) -> None:
    table = """\
  - file: pose.csv
    time: {column: t, unit: ms}
    channels:
      imu.accel_x: {column: ok, unit: g}
      speed: {column: x, unit: km/h}
"""
    recording = read_one(write(tmp_path, table))
    assert_allclose(recording.channel("imu.accel_x").values, [9.80665, 0.0, 9.80665])
    assert_allclose(recording.channel("speed").values, [100 / 3.6, 200 / 3.6, 300 / 3.6])


def test_where_keeps_only_matching_rows(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("    channels", '    where: "ok == 1 and x > 100"\n    channels')
    assert_allclose(read_one(write(tmp_path, table)).channel("pose.x").values, [0.3])


def test_an_expression_over_columns_is_a_channel(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("column: x, unit: mm", 'expression: "x * ok - `head ing`", unit: mm')
    assert_allclose(read_one(write(tmp_path, table)).channel("pose.x").values, [0.01, -0.09, 0.12])


def test_scale_offset_and_sign_apply_before_the_unit(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("unit: mm, std: 2", "unit: mm, scale: 2, offset: 10, sign: -1")
    assert_allclose(
        read_one(write(tmp_path, table)).channel("pose.x").values, [-0.21, -0.41, -0.61]
    )


def test_gzipped_csv_and_npz_are_read(tmp_path: Path) -> None:
    write(tmp_path, POSE_TABLE.replace("pose.csv", "pose.csv.gz"))
    (tmp_path / "pose.csv.gz").write_bytes(gzip.compress(POSE_CSV.encode()))
    assert_allclose(read_one(tmp_path).channel("pose.x").values, [0.1, 0.2, 0.3])
    columns = {"t": [0.0, 5.0], "x": [1.0, 2.0], "head ing": [0.0, 0.0], "image": np.zeros((2, 2))}
    np.savez(tmp_path / "pose.npz", **columns)
    (tmp_path / "recording.yaml").write_text(HEADER + POSE_TABLE.replace("pose.csv", "pose.npz"))
    assert_allclose(read_one(tmp_path).channel("pose.x").values, [0.001, 0.002])


def test_several_cars_become_several_recordings(tmp_path: Path) -> None:
    second = POSE_TABLE.replace("    time", "    vehicle: f1tenth\n    time")
    recordings = read_recordings(write(tmp_path, POSE_TABLE + second))
    assert [recording.vehicle for recording in recordings] == ["nigel", "f1tenth"]


def test_an_empty_cell_drops_that_sample_only(tmp_path: Path) -> None:
    recording = read_one(write(tmp_path, csv=POSE_CSV.replace("50,200,", "50,,")))
    assert_allclose(recording.channel("pose.x").t, [0.0, 0.1])
    assert len(recording.channel("pose.yaw").t) == 3


def test_data_may_lie_elsewhere(tmp_path: Path) -> None:
    elsewhere = tmp_path / "data"
    elsewhere.mkdir()
    (elsewhere / "pose.csv").write_text(POSE_CSV)
    (tmp_path / "mine.yaml").write_text(HEADER + POSE_TABLE)
    (recording,) = read_recordings(tmp_path / "mine.yaml", elsewhere)
    assert len(recording.channel("pose.x").t) == 3


@pytest.mark.parametrize(
    ("tables", "csv", "said"),
    [
        (POSE_TABLE, POSE_CSV.replace("200", "two"), "line 3, column 'x': got 'two'"),
        (POSE_TABLE, POSE_CSV.replace(",1\n", ",1,1\n"), "line 2: 6 cells, as 2 of 3 lines have"),
        (
            POSE_TABLE.replace("unit: mm", "unit: deg"),
            POSE_CSV,
            "pose.x: unit 'deg' measures angle",
        ),
        (POSE_TABLE.replace("unit: mm", "unit: mn"), POSE_CSV, "unknown unit 'mn' (did you mean"),
        (POSE_TABLE.replace("pose.x", "pose.ex"), POSE_CSV, "no channel named 'pose.ex' (did you"),
        (
            POSE_TABLE.replace("column: x", "column: xx"),
            POSE_CSV,
            "no column 'xx' (did you mean 'x'",
        ),
        (POSE_TABLE.replace("std: 2", "std: 0"), POSE_CSV, "std: expected more than 0, got 0"),
        (POSE_TABLE.replace("column: x", "colum: x"), POSE_CSV, "unknown field `colum`"),
        (POSE_TABLE.replace("pose.csv", "pose.txt"), POSE_CSV, "no such file"),
        (POSE_TABLE, "t,x,y,head ing,ok\n", "no rows below the header"),
        (POSE_TABLE + POSE_TABLE, POSE_CSV, "channel 'pose.x' of nigel is given twice"),
    ],
)
def test_a_bad_recording_is_refused_with_place_and_reason(
    tmp_path: Path, tables: str, csv: str, said: str
) -> None:
    with pytest.raises(RecordingError) as error:
        read_recordings(write(tmp_path, tables, csv))
    assert said in str(error.value)
    assert str(tmp_path) in str(error.value)


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("std: .nan", "pose.x: std: expected more than 0, got nan"),
        ("scale: 0", "pose.x: scale: 0 would lose the values"),
        ("offset: .inf", "pose.x: offset: expected a finite number, got inf"),
        ("point: [.nan, 0]", "pose.x: point[0]: expected a finite number"),
        ("sign: 2", "table pose.csv: pose.x: Invalid enum value 2"),
        ("column: y", "line 7: the key 'column' stands twice"),
    ],
)
def test_a_bad_key_of_a_channel_is_refused_with_its_channel(
    tmp_path: Path, key: str, said: str
) -> None:
    with pytest.raises(RecordingError) as error:
        read_recordings(write(tmp_path, POSE_TABLE.replace("std: 2", key)))
    assert said in str(error.value)


def test_a_channel_that_stands_twice_in_a_table_is_refused(tmp_path: Path) -> None:
    table = POSE_TABLE + "      pose.x: {column: y, unit: mm}\n"
    with pytest.raises(RecordingError, match=r"line 9: the key 'pose\.x' stands twice"):
        read_recordings(write(tmp_path, table))


@pytest.mark.parametrize("text", [b"\xb0 no text", b"[" * 5000, b"[]", b"", b"1: 2", b"a: &a [*a]"])
def test_a_file_that_is_no_description_is_refused(tmp_path: Path, text: bytes) -> None:
    (tmp_path / "recording.yaml").write_bytes(text)
    with pytest.raises(RecordingError, match=r"recording\.yaml"):
        read_recordings(tmp_path)


def test_the_unit_1_needs_no_quotes(tmp_path: Path) -> None:
    table = POSE_TABLE + "      light.left: {column: ok, unit: 1}\n"
    assert_allclose(read_one(write(tmp_path, table)).channel("light.left").values, [1, 0, 1])


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("1 / 0 + x * (ok > 0)", None),
        ("x / ok", [0.1, 0.3]),
        ("10 ** 10 ** 10 ** 10", None),
        ("50 < x < 250", [0.001, 0.001, 0.0]),
        ("+x", [0.1, 0.2, 0.3]),
        ("True and x", [0.001, 0.001, 0.001]),
    ],
)
def test_arithmetic_without_an_answer_drops_the_row(
    tmp_path: Path, text: str, values: list[float] | None
) -> None:
    folder = write(tmp_path, POSE_TABLE.replace("column: x,", f'expression: "{text}",'))
    if values is None:
        with pytest.raises(RecordingError, match=r"pose\.x: no row is left"):
            read_recordings(folder)
    else:
        assert_allclose(read_one(folder).channel("pose.x").values, values)


def test_an_endless_expression_is_refused(tmp_path: Path) -> None:
    text = "-" * 50_000 + "x"
    table = POSE_TABLE.replace("column: x,", f'expression: "{text}",')
    with pytest.raises(RecordingError, match="expected at most 1000"):
        read_recordings(write(tmp_path, table))


@pytest.mark.parametrize(
    "text", ["__import__('os')", "(x + 1).real", "x[0:1]", "[x]", "x if x else 1", "x @ x", "'a'"]
)
def test_an_expression_can_do_nothing_but_arithmetic(tmp_path: Path, text: str) -> None:
    table = POSE_TABLE.replace("column: x, unit: mm", f'expression: "{text}", unit: mm')
    with pytest.raises(RecordingError, match="is not arithmetic"):
        read_recordings(write(tmp_path, table))


def test_real_recordings_described_in_the_project_are_read(root: Path, shared: Path) -> None:
    dart = read_recordings(
        root / "recordings/dart/free_driving_10_02_28.yaml", shared / "recordings/dart"
    )
    assert len(dart[0].channel("pose.x").t) == 9825
    tinytown = read_recordings(
        root / "recordings/autodrive_sim_tinytown.yaml",
        shared / "recordings/autodrive_sim_tinytown",
    )
    assert tinytown[0].channel("command.steering").dimension == "angle"


def test_a_time_may_be_computed_and_its_clock_shifted(tmp_path: Path) -> None:
    table = """\
  - file: pose.csv
    time: {expression: ok + t * 1e-3, unit: s, offset: 0.5}
    channels:
      pose.x: {column: x, unit: mm}
"""
    assert_allclose(read_one(write(tmp_path, table)).channel("pose.x").t, [1.5, 0.55, 1.6])


@pytest.mark.parametrize("time", ["{unit: s}", "{column: t, expression: t}"])
def test_a_time_is_a_column_or_an_expression(tmp_path: Path, time: str) -> None:
    table = POSE_TABLE.replace("{column: t, unit: ms}", time)
    with pytest.raises(RecordingError, match="time: expected either column or expression"):
        read_recordings(write(tmp_path, table))


def test_a_quaternion_becomes_a_yaw(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("column: head ing, unit: deg", 'expression: "2 * atan2(y, x)"')
    table = table.replace("expression", "unit: rad, expression")
    yaw = read_one(write(tmp_path, table)).channel("pose.yaw").values
    assert_allclose(yaw, [0.0, 0.0, 2.0 * math.atan2(10.0, 300.0)])


EVENTS = "t,source,x\n0,camera,1\n5,car,\n10,camera,3\n"


def test_rows_of_an_event_table_are_chosen_by_a_word(tmp_path: Path) -> None:
    table = """\
  - file: pose.csv
    time: {column: t, unit: ms}
    where: source == 'camera'
    channels:
      pose.x: {column: x, unit: m}
"""
    assert_allclose(read_one(write(tmp_path, table, EVENTS)).channel("pose.x").values, [1.0, 3.0])
    other = table.replace("== 'camera'", "!= 'car'")
    assert_allclose(read_one(write(tmp_path, other, EVENTS)).channel("pose.x").t, [0.0, 0.01])


def test_a_word_compared_with_numbers_is_refused(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("    channels", "    where: ok == 'yes'\n    channels")
    with pytest.raises(RecordingError, match="column 'ok' holds numbers, not words"):
        read_recordings(write(tmp_path, table))


def test_a_function_wants_its_number_of_inputs(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("column: x, unit: mm", 'expression: "atan2(x)", unit: mm')
    with pytest.raises(RecordingError, match="is not arithmetic"):
        read_recordings(write(tmp_path, table))


def test_a_file_without_times_counts_its_rows(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("column: t, unit: ms", "expression: row / 30, unit: s")
    table = table.replace("    channels", '    where: "x > 100"\n    channels')
    assert_allclose(read_one(write(tmp_path, table)).channel("pose.x").t, [1 / 30, 2 / 30])


def test_a_column_named_row_comes_before_the_count(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("column: t,", "column: row,")
    recording = read_one(write(tmp_path, table, POSE_CSV.replace("t,", "row,", 1)))
    assert_allclose(recording.channel("pose.x").t, [0.0, 0.05, 0.1])


def test_min_and_max_compare_row_by_row(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("column: t,", 'expression: "max(t, 40 + 2 * row) + min(y, 5)",')
    assert_allclose(read_one(write(tmp_path, table)).channel("pose.x").t, [0.04, 0.05, 0.105])


def test_a_column_of_variances_gives_the_noise(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("unit: mm, std: 2", "unit: mm, variance: ok")
    assert read_one(write(tmp_path, table)).channel("pose.x").std == pytest.approx(0.001)


def test_a_broken_line_does_not_shift_the_count_of_the_rows_after_it(tmp_path: Path) -> None:
    table = POSE_TABLE.replace("column: t, unit: ms", "expression: row / 30, unit: s")
    lines = [f"{k},{k},0,90,1" for k in range(200)]
    lines[10] = "10,oh"
    csv = "\n".join(("t,x,y,head ing,ok", *lines)) + "\n"
    recording = read_one(write(tmp_path, table, csv))
    assert len(recording.left_out) == 1
    channel = recording.channel("pose.x")
    assert_allclose(channel.t, channel.values * 1000.0 / 30.0)
