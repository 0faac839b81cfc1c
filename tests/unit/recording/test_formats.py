"""Parquet and MATLAB files are tables like any other."""

import datetime
import importlib
import io
import struct
import zipfile
import zlib
from decimal import Decimal
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet as pq
import pytest
import scipy.io
from numpy.testing import assert_allclose, assert_array_equal

from scm.errors import RecordingError
from scm.recording import columns as limits
from scm.recording.read import read_recordings
from scm.recording.table import read_table

T_NS = 1_700_000_000_123_456_789 + 20_000_001 * np.arange(3)
TABLE = """\
recording: 1
vehicle: nigel
tables:
  - file: FILE
    time: {TIME}
    where: "WHERE"
    channels:
      pose.x: {column: pose.x, unit: mm}
      pose.yaw: {expression: "atan2(pose.s, pose.c)", unit: rad}
"""


def read_pose(folder: Path, file: str, time: str, where: str = "pose.c > 0"):
    text = TABLE.replace("FILE", file).replace("TIME", time).replace("WHERE", where)
    (folder / "recording.yaml").write_text(text)
    (recording,) = read_recordings(folder)
    return recording


def write_parquet(folder: Path, **columns) -> Path:
    pq.write_table(pa.table(columns), folder / "drive.parquet")
    return folder / "drive.parquet"


def poses():
    return [{"x": 10.0 * k, "s": 1.0, "c": 1.0} for k in range(3)]


@pytest.mark.parametrize(
    ("kind", "time"),
    [
        (pa.timestamp("ns"), "column: t, unit: s"),
        (pa.timestamp("ns", tz="UTC"), "column: t"),
        (pa.int64(), "column: t, unit: ns"),
        (pa.uint64(), "column: t, unit: ns"),
    ],
)
def test_parquet_becomes_channels_with_times_to_the_nanosecond(
    tmp_path: Path, kind: pa.DataType, time: str
) -> None:
    by = pa.array(["lidar", None, "camera"]).dictionary_encode()
    write_parquet(tmp_path, t=pa.array(T_NS).cast(kind), pose=poses(), by=by)
    recording = read_pose(tmp_path, "drive.parquet", time, "by == 'camera' or by == 'lidar'")
    assert_allclose(recording.channel("pose.x").values, [0.0, 0.02])
    assert_allclose(recording.channel("pose.yaw").values, np.pi / 4)
    since_ns = T_NS[[0, 2]] - 1_700_000_000 * 10**9
    assert_array_equal(np.round(recording.channel("pose.x").t * 1e9), since_ns)


def test_every_number_of_parquet_is_read(tmp_path: Path) -> None:
    columns = {
        "whole": pa.array([1, None, 3], pa.int32()),
        "small": pa.array([1.5, None, 2.5], pa.float32()),
        "true": pa.array([True, None, False]),
        "exact": pa.array([Decimal("1.25"), None, Decimal(3)], pa.decimal128(5, 2)),
        "late": pa.array([datetime.timedelta(milliseconds=1500)] * 2 + [None], pa.duration("ms")),
        "name": ["1", "", "x"],
        "picture": [b"x", b"", None],
    }
    read = read_table(write_parquet(tmp_path, **columns))
    assert_allclose(read["whole"], [1.0, np.nan, 3.0])
    assert_allclose(read["small"], [1.5, np.nan, 2.5])
    assert_allclose(read["true"], [1.0, np.nan, 0.0])
    assert_allclose(read["exact"], [1.25, np.nan, 3.0])
    assert_allclose(read["late"], [1.5, 1.5, np.nan])
    assert "picture" not in list(read)
    with pytest.raises(RecordingError, match="line 3, column 'name': got 'x', expected a number"):
        read["name"]


@pytest.mark.parametrize(
    ("wanted", "said"),
    [("pose.ex", r"no column 'pose.ex' \(did you mean 'pose.x'"), ("zzz", "it has t, pose.x")],
)
def test_a_column_that_parquet_has_not_is_refused(tmp_path: Path, wanted: str, said: str) -> None:
    read = read_table(write_parquet(tmp_path, t=T_NS, pose=poses()), None, ["t", wanted])
    with pytest.raises(RecordingError, match=said):
        read[wanted]


def test_elements_of_lists_are_columns_in_parquet_and_feather(tmp_path: Path) -> None:
    ranges = pa.array([[1.0, 2.0], [3.0], None], pa.list_(pa.float32()))
    fixed = pa.array([[1, 2], [3, 4], [5, 6]], pa.list_(pa.int64(), 2))
    poses_of = pa.array([[{"x": 1.5}], [], [{"x": 2.5}, {"x": 3.5}]])
    file = write_parquet(tmp_path, t=T_NS, ranges=ranges, fixed=fixed, poses=poses_of)
    feather = tmp_path / "drive.feather"
    pa.feather.write_feather(pq.read_table(file), feather)
    for one in (file, feather):
        wanted = ["t", "ranges[0]", "ranges[1]", "fixed[1]", "poses[0].x", "ranges[7]"]
        read = read_table(one, None, wanted)
        assert_allclose(read["ranges[0]"], [1.0, 3.0, np.nan])
        assert_allclose(read["ranges[1]"], [2.0, np.nan, np.nan])
        assert_allclose(read["fixed[1]"], [2, 4, 6])
        assert_allclose(read["poses[0].x"], [1.5, np.nan, 2.5])
        assert read.nanoseconds("t", "ns") is not None
        with pytest.raises(RecordingError, match=r"no column 'ranges\[7\]'"):
            read["ranges[7]"]
        assert {"ranges[0]", "fixed[0]", "fixed[1]", "poses[1].x"} <= set(read_table(one))


def test_a_whole_list_is_refused_with_what_to_write(tmp_path: Path) -> None:
    file = write_parquet(tmp_path, t=T_NS, points=[[1.0], [2.0], []])
    with pytest.raises(RecordingError, match=r"holds list<.*name one element, as `points\[0\]`"):
        read_table(file, None, ["t", "points"])


def test_times_of_day_and_dates_are_times(tmp_path: Path) -> None:
    day, clock = datetime.date(1970, 1, 3), datetime.time(0, 1, 0, 500_000)
    columns = {
        "ns": pa.array([clock, None], pa.time64("ns")),
        "us": pa.array([clock, clock], pa.time64("us")),
        "ms": pa.array([clock, clock], pa.time32("ms")),
        "s": pa.array([datetime.time(0, 1), None], pa.time32("s")),
        "date": pa.array([day, None], pa.date32()),
        "date64": pa.array([day, day], pa.date64()),
        "none": pa.nulls(2),
        "half": pa.array(np.array([1.5, 2.5], np.float16)),
    }
    read = read_table(write_parquet(tmp_path, **columns))
    assert_allclose(read["ns"], [60.5, np.nan])
    assert_allclose(read["us"], 60.5)
    assert_allclose(read["ms"], 60.5)
    assert_allclose(read["s"], [60.0, np.nan])
    assert_allclose(read["date"], [2 * 86400.0, np.nan])
    assert_allclose(read["date64"], 2 * 86400.0)
    assert_allclose(read["none"], np.nan)
    assert_allclose(read["half"], [1.5, 2.5])
    t_ns = read.nanoseconds("us", "s")
    assert t_ns is not None
    assert t_ns.tolist() == [60_500_000_000] * 2


def test_a_large_parquet_file_is_refused_by_what_is_asked_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = write_parquet(tmp_path, t=np.zeros(500), picture=[b"x" * 10**5] + [b""] * 499)
    monkeypatch.setattr(limits, "MAX_BYTES", 4100)
    assert read_table(file, None, ["t"]).rows == 500
    monkeypatch.setattr(limits, "MAX_BYTES", 3900)  # some bytes in the file: all are zero
    with pytest.raises(RecordingError, match="split it"):
        read_table(file, None, ["t"])


def write_mat(folder: Path, *, packed: bool = True, **columns) -> Path:
    scipy.io.savemat(folder / "drive.mat", columns, do_compression=packed, oned_as="column")
    return folder / "drive.mat"


def log():
    return {"x": 10.0 * np.arange(3), "s": np.ones(3), "c": np.ones(3)}


@pytest.mark.parametrize("packed", [False, True])
def test_a_mat_file_becomes_channels(tmp_path: Path, packed: bool) -> None:
    write_mat(tmp_path, packed=packed, t=T_NS, pose=log(), gain=2.0, other=np.zeros(9), by="me")
    recording = read_pose(tmp_path, "drive.mat", "column: t, unit: ns")
    assert_allclose(recording.channel("pose.x").values, [0.0, 0.01, 0.02])
    assert_allclose(recording.channel("pose.yaw").values, np.pi / 4)
    since_ns = T_NS - 1_700_000_000 * 10**9
    assert_array_equal(np.round(recording.channel("pose.x").t * 1e9), since_ns)


def test_columns_of_a_matrix_and_fields_of_many_structs_are_read(tmp_path: Path) -> None:
    steps = np.array([(1.0, "a"), (2.0, "b")], dtype=[("v", object), ("who", object)])
    file = write_mat(tmp_path, m=np.array([[1.0, 2.0], [3.0, 4.0]]), steps=steps)
    read = read_table(file, None, ["m[1]", "steps.v"])
    assert_allclose(read["m[1]"], [2.0, 4.0])
    assert_allclose(read["steps.v"], [1.0, 2.0])
    with pytest.raises(RecordingError, match=r"no column 'steps.who'"):
        read["steps.who"]


@pytest.mark.parametrize("shape", [(6, 40), (40, 6)])
def test_the_short_side_of_a_matrix_are_its_columns(tmp_path: Path, shape: tuple[int, int]) -> None:
    values = np.arange(240.0).reshape(6, 40)
    file = write_mat(tmp_path, m=values if shape == values.shape else values.T)
    read = read_table(file, None, ["m[0]", "m[5]", "m[6]"])
    assert_allclose(read["m[0]"], values[0])
    assert_allclose(read["m[5]"], values[5])
    with pytest.raises(RecordingError, match=r"no column 'm\[6\]'"):
        read["m[6]"]


@pytest.mark.parametrize("shape", [(1, 5), (5, 1)])
def test_a_matrix_of_one_row_or_column_is_a_vector(tmp_path: Path, shape: tuple[int, int]) -> None:
    file = write_mat(tmp_path, m=np.arange(5.0).reshape(shape))
    read = read_table(file, None, ["m", "m[0]"])
    assert_allclose(read["m"], np.arange(5))
    assert_allclose(read["m[0]"], np.arange(5))


def test_structs_of_simulink_are_read(tmp_path: Path) -> None:
    signals = np.zeros(2, [("values", object), ("label", object)])
    signals[0] = (np.arange(4.0), "x")
    signals[1] = (np.arange(8.0).reshape(4, 2), "yz")
    one = {"time": np.arange(4.0), "signals": {"values": np.arange(4.0), "label": "x"}}
    file = write_mat(tmp_path, one=one, two={"time": np.arange(4.0), "signals": signals})
    wanted = ["one.time", "one.signals.values", "two.signals[0].values", "two.signals[1].values[1]"]
    read = read_table(file, None, wanted)
    assert_allclose(read["one.time"], np.arange(4))
    assert_allclose(read["one.signals.values"], np.arange(4))
    assert_allclose(read["two.signals[0].values"], np.arange(4))
    assert_allclose(read["two.signals[1].values[1]"], [1, 3, 5, 7])


@pytest.mark.parametrize("version", ["4", "5"])
def test_every_class_of_numbers_of_matlab_is_read(tmp_path: Path, version: str) -> None:
    kinds = (
        ("f8", "f4", "i4", "i2", "u2", "u1")
        if version == "4"
        else ["f8", "f4", "i1", "u1", "i2", "i8", "u8"]
    )
    values = {f"a_{kind}": np.arange(5).astype(kind) for kind in kinds}
    scipy.io.savemat(tmp_path / "a.mat", values, format=version)
    read = read_table(tmp_path / "a.mat", None, list(values))
    for name in values:
        assert_array_equal(read[name], np.arange(5))


def test_cells_of_matlab_are_read(tmp_path: Path) -> None:
    cell = np.empty(2, object)
    cell[:] = [np.arange(3.0), "word"]
    read = read_table(write_mat(tmp_path, c=cell), None, ["c[0]"])
    assert_allclose(read["c[0]"], np.arange(3))


def test_an_object_of_matlab_is_refused_with_what_to_save(tmp_path: Path) -> None:
    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    parts = element(6, struct.pack("<II", 17, 0)) + element(1, b"log") + element(1, b"MCOS")
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    (tmp_path / "log.mat").write_bytes(head + element(14, parts + element(1, b"timeseries")))
    with pytest.raises(RecordingError, match=r"log: MATLAB objects .*x\.Time"):
        read_table(tmp_path / "log.mat", None, ["log.Time"])


def test_an_npy_file_is_read(tmp_path: Path) -> None:
    file = tmp_path / "drive.npy"
    np.save(file, np.array([(0.0, 1), (1.0, 2)], [("t", "f8"), ("x", "i4")]))
    assert_allclose(read_table(file)["x"], [1, 2])
    np.save(file, np.arange(12.0).reshape(4, 3))
    assert_allclose(read_table(file)["[2]"], [2, 5, 8, 11])
    assert_allclose(read_table(file, columns=("t", None, "x"))["x"], [2, 5, 8, 11])
    with pytest.raises(RecordingError, match=r"shape \(4, 3\), but names for 2 columns"):
        read_table(file, columns=("t", "x"))
    np.save(file, np.array([{}, 1], object))
    with pytest.raises(RecordingError, match="a pickle, which is never opened"):
        read_table(file)


def test_matrices_structs_and_times_of_an_npz_file_are_columns(tmp_path: Path) -> None:
    log = np.array([(0.5, 1), (1.5, 2)], [("t", "f8"), ("x", "i4")])
    stamps = np.array(["2025-11-25T10:00:00.25", "2025-11-25T10:00:01"], "datetime64[ns]")
    np.savez(tmp_path / "drive.npz", log=log, m=np.array([[1.0, 2.0], [3.0, 4.0]]), at=stamps)
    read = read_table(tmp_path / "drive.npz", None, ["log.t", "m[1]", "at"])
    assert_allclose(read["log.t"], [0.5, 1.5])
    assert_allclose(read["m[1]"], [2, 4])
    t_ns = read.nanoseconds("at", "s")
    assert t_ns is not None
    assert t_ns[0] == 1_764_064_800_250_000_000


@pytest.mark.parametrize("name", ["drive.npy", "drive.npz"])
def test_an_array_that_declares_a_huge_size_is_refused(tmp_path: Path, name: str) -> None:
    head = io.BytesIO()
    shape = {"shape": (10**12,), "fortran_order": False, "descr": "<f8"}
    np.lib.format.write_array_header_1_0(head, shape)
    (tmp_path / "drive.npy").write_bytes(head.getvalue() + bytes(80))
    with zipfile.ZipFile(tmp_path / "drive.npz", "w") as packed:
        packed.writestr("t.npy", head.getvalue() + bytes(80))
    with pytest.raises(RecordingError, match="more than 1024 MiB"):
        read_table(tmp_path / name)


def test_mat_columns_of_different_lengths_are_refused_where_they_are_asked_for(
    tmp_path: Path,
) -> None:
    file = write_mat(tmp_path, t=np.zeros(2), x=np.zeros(3))
    assert read_table(file, None, ["t"]).rows == 2
    with pytest.raises(RecordingError, match="different lengths"):
        read_table(file, None, ["t", "x"])
    with pytest.raises(RecordingError, match=r"no column 'tt' \(did you mean 't'"):
        read_table(file, None, ["tt", "x"])["tt"]


def test_a_mat_file_that_is_large_when_unpacked_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = write_mat(tmp_path, t=np.zeros(100_000))
    assert file.stat().st_size < 2000
    monkeypatch.setattr(limits, "MAX_BYTES", 700_000)
    with pytest.raises(RecordingError, match="split it"):
        read_table(file, None, ["t"])


def test_a_mat_file_of_version_7_3_is_refused_with_what_to_do(tmp_path: Path) -> None:
    head = b"MATLAB 7.3 MAT-file".ljust(124) + struct.pack("<H", 0x0200) + b"IM"
    (tmp_path / "drive.mat").write_bytes(head.ljust(512, b"\0") + b"\x89HDF\r\n\x1a\n")
    with pytest.raises(RecordingError, match=r"version 7.3 \(HDF5\): save it with -v7"):
        read_table(tmp_path / "drive.mat", None, ["t"])


@pytest.mark.parametrize("name", ["drive.parquet", "drive.mat", "drive.npz", "drive.csv.gz"])
def test_a_damaged_file_is_refused_in_a_sentence(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    write_parquet(tmp_path, t=T_NS, x=np.arange(3.0))
    write_mat(tmp_path, t=T_NS, x=np.arange(3.0), pose=log())
    np.savez_compressed(tmp_path / "drive.npz", t=T_NS, x=np.arange(3.0))
    packed = zlib.compressobj(wbits=31)
    lines = b"t,x\n" + b"".join(b"%d,%d\n" % (k, k * k) for k in range(99))
    (tmp_path / "drive.csv.gz").write_bytes(packed.compress(lines) + packed.flush())
    whole, dice = file.read_bytes(), np.random.default_rng(2)
    assert read_table(file, None, ["x"]).rows >= 3
    for number in range(90):
        torn = bytearray(whole[: dice.integers(len(whole))] if number % 3 == 0 else whole)
        for at in dice.integers(len(torn) or 1, size=number % 3 * 4):
            torn[at : at + 1] = dice.bytes(1)
        file.write_bytes(torn)
        try:
            read_table(file, None, ["t", "x"])
        except RecordingError as error:
            assert str(file) in str(error)  # noqa: PT017  damage may as well go unnoticed


@pytest.mark.parametrize(
    ("name", "library"), [("a.parquet", "pyarrow"), ("a.feather", "pyarrow"), ("a.bag", "rosbags")]
)
def test_a_library_that_is_not_there_is_named_with_the_command_that_brings_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, library: str
) -> None:
    def without(module: str) -> None:
        raise ModuleNotFoundError(name=f"{library}.part")

    (tmp_path / name).write_bytes(b"x")
    monkeypatch.setattr(importlib, "import_module", without)
    with pytest.raises(RecordingError, match=rf"needs {library}.*pip install -e '\.\[formats\]'"):
        read_table(tmp_path / name)
