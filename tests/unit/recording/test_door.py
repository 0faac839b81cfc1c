"""Whatever file a user gives: one line that names it, quickly, or what is whole of it."""

import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet as pq
import pytest
import scipy.io

from scm.errors import RecordingError
from scm.recording.description import read_description
from scm.recording.read import read_recordings
from scm.recording.table import KINDS, read_table
from tests.unit.recording.made_bag import write_bag

COLUMNS = {"t": np.arange(40) / 50, "x": np.sin(np.arange(40.0))}
DESCRIPTION = """\
recording: 1
vehicle: nigel
tables:
  - file: d.csv
    time: {column: t, unit: s}
    channels:
      pose.x: {column: x, unit: m}
"""


def write_text(path: Path) -> None:
    rows = zip(*COLUMNS.values(), strict=True)
    path.write_text("t;x\n" + "".join(f"{t};{x}\n" for t, x in rows))


WRITERS: dict[str, Callable[[Path], object]] = {
    "a.csv": write_text,
    "a.parquet": lambda path: pq.write_table(pa.table(COLUMNS), path),
    "a.feather": lambda path: pyarrow.feather.write_feather(pa.table(COLUMNS), path),
    "a.mat": lambda path: scipy.io.savemat(path, {**COLUMNS, "s": {"x": COLUMNS}}),
    "a.npz": lambda path: np.savez_compressed(path, **COLUMNS),
    "a.npy": lambda path: np.save(path, np.stack(list(COLUMNS.values()), axis=1)),
}


def read_all(path: Path) -> None:
    """Read a file; an error must be one line that begins with its path."""
    columns = read_table(path, "/odom" if path.suffix in (".bag", ".db3", ".mcap") else None)
    for name in {*columns} - {""}:
        try:
            columns[name]
        except RecordingError as error:
            assert str(error).startswith(f"{path}: ")  # noqa: PT017
            assert "\n" not in str(error)  # noqa: PT017


def expect_one_line(path: Path) -> str:
    try:
        read_all(path)
    except RecordingError as error:
        assert str(error).startswith(f"{path}: "), error  # noqa: PT017
        assert "\n" not in str(error)  # noqa: PT017
        assert len(str(error)) < 800  # noqa: PT017
        return str(error)
    return ""


@pytest.mark.parametrize("name", WRITERS)
def test_damage_of_any_kind_is_one_line_or_goes_unnoticed(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    WRITERS[name](path)
    whole = path.read_bytes()
    dice = np.random.default_rng(5)
    began = time.process_time()
    for number in range(200):
        torn = bytearray(whole[: dice.integers(len(whole))] if number % 3 == 0 else whole)
        for at in dice.integers(len(torn) or 1, size=number % 3 * 4):
            torn[at : at + 1] = dice.bytes(1)
        if number % 10 == 7:  # a size that is declared
            at = int(dice.integers(max(1, len(torn) - 8)))
            torn[at : at + 4] = b"\xff\xff\xff\x7f"
        path.write_bytes(torn)
        expect_one_line(path)
    assert time.process_time() - began < 20.0


@pytest.mark.parametrize("suffix", KINDS)
def test_a_file_of_another_kind_is_one_line(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"wrong{suffix}"
    contents = [
        b"",
        b"\0" * 300,
        b"\n",
        bytes(range(256)) * 4,
        b"PK\x03\x04" * 50,
        b"{}",
        b"<html>",
    ]
    contents += [np.random.default_rng(1).bytes(3000), "t,x\n0,1\n".encode("utf-16")]
    for write in WRITERS.values():
        write(tmp_path / "other")
        other = next(one for one in tmp_path.iterdir() if one.name.startswith("other"))
        contents.append(other.read_bytes())
        other.unlink()
    for content in contents:
        path.write_bytes(content)
        expect_one_line(path)
    path.unlink()
    path.mkdir()
    assert "a folder" in expect_one_line(path)
    path.rmdir()
    assert "no such file" in expect_one_line(path)


@pytest.mark.parametrize("name", ["a.csv", "a.parquet", "a.npz", "drive.bag", "drive.db3"])
def test_a_bag_or_table_of_another_name_says_what_it_is(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    source = write_bag(path) if name.startswith("drive") else (WRITERS[name](path), path)[1]
    shutil.copyfile(source, tmp_path / "odd.mat")
    assert " got " in expect_one_line(tmp_path / "odd.mat") or "not a .mat" in expect_one_line(
        tmp_path / "odd.mat"
    )


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read every file")
def test_a_file_that_may_not_be_read_is_one_line(tmp_path: Path) -> None:
    write_text(tmp_path / "a.csv")
    (tmp_path / "a.csv").chmod(0)
    assert "Permission denied" in expect_one_line(tmp_path / "a.csv")


def test_a_device_is_no_file() -> None:
    assert "not a regular file" in expect_one_line(Path("/dev/null"))


def test_a_description_of_many_keys_is_read_in_linear_time(tmp_path: Path) -> None:
    lines = [f"      light.x{k}: {{}}\n" for k in range(24_000)]
    (tmp_path / "recording.yaml").write_text(DESCRIPTION + "".join(lines))
    began = time.process_time()
    with pytest.raises(RecordingError, match="and 23980 problems more"):
        read_description(tmp_path / "recording.yaml")
    assert time.process_time() - began < 3.0
    (tmp_path / "recording.yaml").write_text(DESCRIPTION + "".join(lines) + lines[7])
    with pytest.raises(RecordingError, match=r"line 24008: the key 'light\.x7' stands twice"):
        read_description(tmp_path / "recording.yaml")


@pytest.mark.parametrize(
    "text",
    [
        b"", b"[", b"a: [" * 3000, b"{" * 5000, b"\xff\xfe", b"\0", b"recording: 2023-13-45",
        b"? [a]\n: b", b"!!python/object:os.system {}", b"a: !!int x", b"- 1", b"&a [*a]",
        b"recording: 1\ntables: 3", b"recording: 1\ntables: [{file: 1}]", b"x: 0b", b"a: 1:99:1e",
        b"%YAML 9.9\n---\n", b"a: !!binary '!'", b"a: !!timestamp 1", b"{[]: 1}", b"<<: 1",
    ],
)  # fmt: skip
def test_a_bad_description_is_one_line(tmp_path: Path, text: bytes) -> None:
    path = tmp_path / "recording.yaml"
    path.write_bytes(text)
    with pytest.raises(RecordingError) as error:
        read_recordings(tmp_path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_a_description_that_unfolds_without_end_is_refused_quickly(tmp_path: Path) -> None:
    lines = ["a0: &a0 [x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    (tmp_path / "recording.yaml").write_text("\n".join(lines) + "\ntables: *a11\nrecording: 1\n")
    began = time.process_time()
    with pytest.raises(RecordingError):
        read_recordings(tmp_path)
    assert time.process_time() - began < 2.0


def test_descriptions_of_any_damage_are_one_line(tmp_path: Path) -> None:
    write_text(tmp_path / "d.csv")
    path = tmp_path / "recording.yaml"
    dice = np.random.default_rng(6)
    whole = DESCRIPTION.encode()
    for number in range(200):
        torn = bytearray(whole[: dice.integers(len(whole))] if number % 3 == 0 else whole)
        for at in dice.integers(len(torn) or 1, size=number % 3 * 2):
            torn[at : at + 1] = dice.bytes(1)
        path.write_bytes(torn)
        try:
            read_recordings(tmp_path)
        except RecordingError as error:
            for line in str(error).split("\n"):
                assert line.startswith(str(tmp_path)), line
