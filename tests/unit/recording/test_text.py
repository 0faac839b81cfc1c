"""Text tables of any logger: every common dialect is read, and no line is lost without a word."""

import bz2
import gzip
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.errors import RecordingError
from scm.recording.columns import Columns
from scm.recording.read import Recording, read_recordings
from scm.recording.table import read_table

ROWS = [(0.02 * k, 0.25 * k, -0.5) for k in range(8)]
TABLE = """\
recording: 1
vehicle: nigel
tables:
  - file: FILE
    COLUMNS
    time: {column: t, unit: s}
    channels:
      pose.x: {column: x, unit: m}
      pose.y: {column: y, unit: m}
"""


def columns(folder: Path, data: bytes | str, name: str = "table.csv", **options: object) -> Columns:
    (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
    return read_table(folder / name, **options)  # type: ignore[arg-type]


def described(folder: Path, file: str, data: bytes | str, keys: str = "note: ''") -> Recording:
    (folder / file).write_bytes(data.encode() if isinstance(data, str) else data)
    text = TABLE.replace("FILE", file).replace("COLUMNS", keys)
    (folder / "recording.yaml").write_text(text.replace("    note: ''\n", ""))
    (recording,) = read_recordings(folder)
    return recording


def table(sep: str = ",", point: str = ".", head: str = "t,x,y", rows=ROWS) -> str:
    lines = [head.replace(",", sep)] if head else []
    lines += [sep.join(f"{v:.3f}".replace(".", point) for v in row) for row in rows]
    return "\n".join(lines) + "\n"


def expect_rows(read: Columns) -> None:
    for name, values in zip("txy", zip(*ROWS, strict=True), strict=True):
        assert_allclose(read[name], values, err_msg=name)
    assert read.left_out == ()


@pytest.mark.parametrize("suffix", ["csv", "txt", "tsv", "dat", "log", "tum", "CSV"])
@pytest.mark.parametrize("sep", [",", ";", "\t", " ", "   ", "|", ", "])
def test_a_table_is_read_whatever_its_suffix_and_separator(
    tmp_path: Path, suffix: str, sep: str
) -> None:
    expect_rows(columns(tmp_path, table(sep), f"table.{suffix}"))


@pytest.mark.parametrize("name", ["table.csv.gz", "table.txt.gz", "table.csv", "table.TUM.GZ"])
def test_a_gzipped_table_is_read_whatever_its_name(tmp_path: Path, name: str) -> None:
    expect_rows(columns(tmp_path, gzip.compress(table().encode()), name))
    expect_rows(columns(tmp_path, table(), name))


@pytest.mark.parametrize("sep", [";", "\t", " ", " ; "])
def test_decimal_commas_are_read(tmp_path: Path, sep: str) -> None:
    expect_rows(columns(tmp_path, table(sep, ",")))
    quoted = "\n".join(
        sep.strip(" ;").join(f'"{c}"' for c in line.split(sep)) if sep == "\t" else line
        for line in table(sep, ",").splitlines()
    )
    expect_rows(columns(tmp_path, quoted))


def test_decimal_commas_beside_points_are_refused_with_both_places(tmp_path: Path) -> None:
    read = columns(tmp_path, "t;x;y\n0;1,5;2.5\n1;2,5;3.5\n")
    with pytest.raises(RecordingError, match=r"line 2, column 'x': got '1,5'.*points"):
        read["x"]


def test_decimal_commas_between_commas_are_refused_by_the_common_width(tmp_path: Path) -> None:
    lines = ["t,x,y"] + ["0,02,1,5,-0,5"] * 194 + ["1,2,3"] * 6
    with pytest.raises(RecordingError) as error:
        columns(tmp_path, "\n".join(lines))
    said = str(error.value)
    assert "line 2: 6 cells" in said
    assert "194 of 200 lines" in said
    assert "3 columns" in said
    assert "decimal" in said


def test_a_tum_trajectory_is_read(tmp_path: Path) -> None:
    rows = "".join(f"{1e9 + k / 10:.1f} {k}.5  2 0 0 0  0.0 1\n" for k in range(5))
    head = "# ground truth\n# file: 'a.bag'\n# timestamp tx ty tz qx qy qz qw\n"
    for text in (head + rows, rows):
        read = columns(tmp_path, text, "stamped.tum")
        assert_allclose(read["timestamp"], 1e9 + np.arange(5) / 10)
        assert_allclose(read["tx"], np.arange(5) + 0.5)
        assert_allclose(read["qw"], 1.0)
    assert_allclose(columns(tmp_path, head + rows, "groundtruth.txt")["qw"], 1.0)


@pytest.mark.parametrize(
    ("data", "names"),
    [
        ("\tt\tx\tnote\n0\t5\t1.5\t\n1\t6\t2.5\t\n2\t7\t3.5\t\n", "txnote"),
        ("\tt\tx\t\n0\t5\t1.5\t\n1\t6\t2.5\t\n2\t7\t3.5\t\n", "tx"),
        ("t\tx\n0\t5\t1.5\n1\t6\t2.5\n2\t7\t3.5\n", "tx"),
        ("t\tx\t\n0\t5\t1.5\t\n1\t6\t2.5\t\n2\t7\t3.5\t\n", "tx"),
        ("t\tx\t\n5\t1.5\n6\t2.5\n7\t3.5\n", "tx"),
        ("t\tx\n5\t1.5\t\n6\t2.5\t\n7\t3.5\t\n", "tx"),
        ('"t" "x"\n"1" 5 1.5\n"2" 6 2.5\n"3" 7 3.5\n', "tx"),
    ],
)
def test_an_index_and_an_empty_last_column_shift_nothing(
    tmp_path: Path, data: str, names: str
) -> None:
    read = columns(tmp_path, data, "table.tsv")
    assert_allclose(read["t"], [5, 6, 7])
    assert_allclose(read["x"], [1.5, 2.5, 3.5])
    assert "".join(name for name in read if name) == names


def test_one_more_cell_than_names_that_is_no_index_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"line 2: 3 cells.*2 columns"):
        columns(tmp_path, "t,x\n0,5,1\n0,7,2\n1,5,3\n")


def test_columns_are_named_by_position(tmp_path: Path) -> None:
    recording = described(tmp_path, "log.txt", table(" ", head=""), "columns: [t, x, y]")
    assert_allclose(recording.channel("pose.x").values, [row[1] for row in ROWS])
    skipped = table(",", head="", rows=[(9.0, *row) for row in ROWS])
    recording = described(tmp_path, "log.csv", skipped, "columns: [~, t, x, y]")
    assert_allclose(recording.channel("pose.x").values, [row[1] for row in ROWS])


@pytest.mark.parametrize(
    ("data", "keys", "said"),
    [
        ("0,1,2\n1,2,3\n", "note: ''", r"line 1: got numbers.*columns: \[t, x, y\]|columns: "),
        ("t,x,y\n0,1,2\n1,2,3\n", "columns: [t, x, y]", "line 1: got names.*take `columns:` out"),
        ("0,1,2,3\n1,2,3,4\n", "columns: [t, x, y]", "line 1: 4 cells.*3 columns"),
        ("0,1,2\n1,2,3\n", "columns: [t, x, x]", "columns: 'x' stands twice"),
        ("0,1,2\n1,2,3\n", "columns: [t, x, q]", "no column 'y'"),
        ("0,1,2\n1,2,3\n", "columns: []", "columns: expected at least one"),
    ],
)
def test_a_table_without_names_is_refused_with_what_to_write(
    tmp_path: Path, data: str, keys: str, said: str
) -> None:
    with pytest.raises(RecordingError, match=said):
        described(tmp_path, "log.csv", data, keys)


def test_text_cells_of_a_headerless_table_are_no_names(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="line 1: got numbers"):
        columns(tmp_path, "0.5,camera,2,3\n1.5,lidar,3,4\n")
    read = columns(tmp_path, "0.5,camera,2\n1.5,lidar,3\n", columns=("t", "by", "x"))
    assert list(read.words("by")) == ["camera", "lidar"]
    assert_allclose(read["x"], [2, 3])


def test_two_tables_of_one_file_may_name_its_columns_differently(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(table(head=""))
    second = (
        TABLE.split("tables:\n")[1].replace("pose.x", "speed").replace("unit: m}", "unit: m/s}", 1)
    )
    second = second.split("      pose.y")[0].replace("COLUMNS", "columns: [t, y, x]")
    text = TABLE.replace("COLUMNS", "columns: [t, x, y]") + second
    (tmp_path / "recording.yaml").write_text(text.replace("FILE", "log.csv"))
    (recording,) = read_recordings(tmp_path)
    assert_allclose(recording.channel("speed").values, -0.5)


def test_lines_of_another_width_are_left_out_one_by_one(tmp_path: Path) -> None:
    lines = table().splitlines()
    lines[3:3] = ["0.1,2", "1,2,3,4"]
    recording = described(tmp_path, "log.csv", "\n".join(lines))
    assert len(recording.channel("pose.x").t) == len(ROWS)
    assert [(one.file, one.line, one.text) for one in recording.left_out] == [
        ("log.csv", 4, "0.1,2"), ("log.csv", 5, "1,2,3,4"),
    ]  # fmt: skip
    assert "2 cells, expected 3" in str(recording.left_out[0])


def test_lines_of_no_common_width_are_refused(tmp_path: Path) -> None:
    lines = ["t,x,y"] + [",".join("1" * n) for n in (1, 2, 3, 4, 5, 6)] * 4
    with pytest.raises(RecordingError, match="no common width"):
        columns(tmp_path, "\n".join(lines))


def test_a_few_cells_that_are_no_numbers_are_left_out_one_by_one(tmp_path: Path) -> None:
    lines = table(rows=ROWS * 4).splitlines()
    lines[5] = lines[5].replace("-0.500", "ERR")
    recording = described(tmp_path, "log.csv", "\n".join(lines))
    assert len(recording.channel("pose.x").t) == 32
    assert len(recording.channel("pose.y").t) == 31
    (one,) = recording.left_out
    assert str(one) == "log.csv: line 6: column 'y': got 'ERR', expected a number"


def test_a_row_of_units_and_lines_above_the_names_are_left_out(tmp_path: Path) -> None:
    lines = ["Logger 7", "Date: today", "", "t,x,y", "[s],[m],[m]", *table().splitlines()[1:]]
    read = columns(tmp_path, "\n".join(lines))
    assert_allclose(read["x"], [row[1] for row in ROWS])
    assert [one.line for one in read.left_out] == [1, 2, 5]


def test_of_several_lines_of_names_the_one_with_most_counts(tmp_path: Path) -> None:
    lines = ["Format,1.23", ",,Marker,Marker", ",,m1,m1", ",,Position,Position", "Frame,Time,X,Y"]
    lines += [f"{k},{k / 100},{k}.5,2.5" for k in range(9)]
    read = columns(tmp_path, "\n".join(lines))
    assert_allclose(read["X"], np.arange(9) + 0.5)
    assert [one.line for one in read.left_out] == [1, 2, 3, 4]


@pytest.mark.parametrize("head", ["t;x;y", "t\tx\ty", "t x y", "# t x y", "sep=,\nt,x,y"])
def test_names_may_be_parted_by_something_else_than_the_cells(tmp_path: Path, head: str) -> None:
    expect_rows(columns(tmp_path, head + "\n" + table(head="")))


@pytest.mark.parametrize(
    "encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig", "latin-1", "cp1252"]
)
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_any_encoding_is_read(tmp_path: Path, encoding: str, newline: str) -> None:
    head = "t,x,y" if encoding.startswith("utf-16-") else "t,x,y,ψ°"
    head = head.replace("ψ", "") if encoding in ("latin-1", "cp1252") else head
    text = table(head=head, rows=ROWS if head == "t,x,y" else [(*r, 90.0) for r in ROWS])
    read = columns(tmp_path, text.replace("\n", newline).encode(encoding))
    expect_rows(read)
    if head != "t,x,y":
        assert_allclose(read[head.split(",")[3]], 90.0)


def test_nul_bytes_of_a_power_cut_are_left_out_and_counted(tmp_path: Path) -> None:
    read = columns(tmp_path, table().encode() + b"0.16,2.0" + b"\0" * 400)
    assert read.rows == len(ROWS)
    (one,) = read.left_out
    assert one.line == len(ROWS) + 2
    assert "NUL" in one.why
    assert len(one.text) < 100


def test_a_file_of_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="not a text table"):
        columns(tmp_path, bytes(range(256)) * 40, "table.dat")


def test_quoted_cells_may_hold_separators_and_line_ends(tmp_path: Path) -> None:
    read = columns(tmp_path, 't;"x [m; map]";y\n0;"1,5";"a;\nb"\n1;"2,5";"c ""d"""\n')
    assert_allclose(read["x [m; map]"], [1.5, 2.5])
    assert list(read.words("y")) == ["a;\nb", 'c "d"']


def test_a_quote_that_is_never_closed_is_no_end_of_the_table(tmp_path: Path) -> None:
    lines = table(head="t,x,y,note", rows=[(*row, 1.0) for row in ROWS] * 4).splitlines()
    lines[2] = lines[2].replace("1.000", '"open')
    read = columns(tmp_path, "\n".join(lines))
    assert_allclose(read["x"], [row[1] for row in ROWS * 4])


def test_empty_cells_are_nan_in_any_place(tmp_path: Path) -> None:
    read = columns(tmp_path, "t,x,y\n,1,2\n1,,\n2, ,3\n,,\n3,4,\n")
    assert_allclose(read["t"], [np.nan, 1, 2, 3])
    assert_allclose(read["x"], [1, np.nan, np.nan, 4])
    assert_allclose(read["y"], [2, np.nan, 3, np.nan])


def test_a_cut_off_gzipped_table_is_read_as_far_as_it_is_whole(tmp_path: Path) -> None:
    rows = [(k / 100, 1.0 / (k + 1), np.sin(k)) for k in range(5000)]
    packed = gzip.compress(table(rows=rows).encode())
    read = columns(tmp_path, packed[: len(packed) // 2], "table.csv.gz")
    assert 1000 < read.rows < 4000
    assert_allclose(read["t"], np.arange(read.rows) / 100)
    assert "cut off" in str(read.left_out[-1])


def test_a_date_and_time_of_day_is_a_time(tmp_path: Path) -> None:
    read = columns(tmp_path, "t,x\n2025-11-25 10:00:00.25,1\n2025-11-25T10:00:01.5Z,2\n")
    t_ns = read.nanoseconds("t", "s")
    assert t_ns is not None
    assert t_ns.tolist() == [1_764_064_800_250_000_000, 1_764_064_801_500_000_000]


@pytest.mark.parametrize(
    ("cells", "since_s"),
    [
        (["12:34:56.5", "12:34:57.75"], 45296.5),
        (["2025-11-25 11:00:00.5+01:00", "2025-11-25 11:00:01.75+01:00"], 1764064800.5),
        (["2025/11/25 10:00:00.5", "2025/11/25 10:00:01.75"], 1764064800.5),
        (["2025-11-25T10:00:00.500000000", "2025-11-25T10:00:01.750000000"], 1764064800.5),
    ],
)
def test_times_of_any_common_form_are_seconds(
    tmp_path: Path, cells: list[str], since_s: float
) -> None:
    read = columns(tmp_path, "t,x\n" + "".join(f"{cell},1\n" for cell in cells))
    assert_allclose(read["t"], [since_s, since_s + 1.25], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("a.pkl", r"pickle.*to_parquet"), ("a.pickle", "pickle"), ("a.joblib", "pickle"),
        ("a.xlsx", "save the sheet as CSV"), ("a.h5", r"HDF5.*to_parquet"), ("a.json", "to_csv"),
        ("a.jsonl", "to_csv"), ("a.zip", "unpack"), ("a.csv.bz2", "unpack"),
        ("a.ulg", "expected one of"),
    ],
)  # fmt: skip
def test_another_kind_of_file_is_refused_with_the_way_out(
    tmp_path: Path, name: str, said: str
) -> None:
    with pytest.raises(RecordingError, match=said):
        columns(tmp_path, bz2.compress(b"x"), name)
    with pytest.raises(RecordingError, match=said if name != "a.ulg" else "not a YAML file"):
        read_recordings(tmp_path / name)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"PK\x03\x04" + b"x" * 99, "a zip archive or an Excel file"),
        (b"PAR1" + b"x" * 99, "a Parquet file"),
        (b"\x89HDF\r\n\x1a\n" + b"x" * 99, "HDF5"),
        (b"SQLite format 3\0" + b"x" * 99, "db3"),
        (b"\x89MCAP0\r\n" + b"x" * 99, "MCAP"),
        (b"#ROSBAG V2.0\n" + b"x" * 99, "ROS 1 bag"),
        (b"\x80\x04\x95" + b"x" * 99, "pickle"),
        (b"", "empty"),
        (b"\n\n\n", "no rows"),
    ],
)
def test_content_of_another_kind_is_named(tmp_path: Path, data: bytes, said: str) -> None:
    with pytest.raises(RecordingError, match=said):
        columns(tmp_path, data)


def test_errors_are_one_line_that_begins_with_the_file(tmp_path: Path) -> None:
    whole = table().encode()
    dice = np.random.default_rng(3)
    file = tmp_path / "table.csv"
    for number in range(200):
        torn = bytearray(whole[: dice.integers(len(whole))] if number % 3 == 0 else whole)
        for at in dice.integers(len(torn) or 1, size=number % 3 * 6):
            torn[at : at + 1] = dice.bytes(1)
        file.write_bytes(torn)
        try:
            read = read_table(file)
            [read[name] for name in set(read) if name]
        except RecordingError as error:
            assert re.match(rf"{re.escape(str(file))}: .*\Z", str(error))  # noqa: PT017


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_numbers_are_read_to_the_last_bit(tmp_path, separator):
    rng = np.random.default_rng(5)
    rows = rng.normal(size=(5000, 3)) * 10.0 ** rng.integers(-20, 20, size=(5000, 3))
    lines = [separator.join(repr(float(cell)) for cell in row) for row in rows]
    path = tmp_path / "t.csv"
    path.write_text("\n".join(("a b c".replace(" ", separator), *lines)) + "\n")
    found = read_table(path)
    assert np.array_equal(np.column_stack([found[name] for name in "abc"]), rows)


@pytest.mark.parametrize(
    "cell",
    ["1.", ".5", "+1", "007", "1e5", "1E+05", "-0.0", "1700000000123456789", "18446744073709551615",
     "123456789012345678901234567890", "1e400", "nan", "-inf", "0.10000000000000000555111"],
)  # fmt: skip
def test_a_number_is_what_python_makes_of_it_however_it_is_written(tmp_path, cell):
    path = tmp_path / "t.csv"
    path.write_text("a,b\n1.5,2.5\n" + f"{cell},4.5\n" + "5.5,6.5\n")
    found = read_table(path)["a"]
    assert np.array_equal(found, [1.5, float(cell), 5.5], equal_nan=True)
    assert np.signbit(found[1]) == np.signbit(float(cell)) or cell == "nan"


@pytest.mark.parametrize("cell", ["[1", "1]", "true", '"2"', "1 2", "{}"])
def test_what_is_no_number_is_none_in_json_either(tmp_path, cell):
    path = tmp_path / "t.csv"
    path.write_text("a,b\n1.5,2.5\n" + f"{cell},4.5\n" + "5.5,6.5\n" * 3)
    assert list(read_table(path)["b"]) == [2.5, 4.5, 6.5, 6.5, 6.5]
