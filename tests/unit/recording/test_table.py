"""Tables as people write them: every common dialect is read, and a bad cell is named."""

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.errors import RecordingError
from scm.recording import columns as limits
from scm.recording.columns import Columns
from scm.recording.table import read_table

PLAIN = b"t,x\n0,1\n1,2\n"


def columns(folder: Path, data: bytes, name: str = "table.csv") -> Columns:
    (folder / name).write_bytes(data)
    return read_table(folder / name)


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(b"\xef\xbb\xbf" + PLAIN, id="byte order mark"),
        pytest.param(PLAIN.replace(b"\n", b"\r\n"), id="windows line ends"),
        pytest.param(PLAIN.replace(b"\n", b"\r"), id="old line ends"),
        pytest.param(PLAIN.replace(b",", b";"), id="semicolons"),
        pytest.param(PLAIN.replace(b",", b"\t"), id="tabs"),
        pytest.param(b'"t","x"\n"0","1"\n"1","2"\n', id="quotes"),
        pytest.param(b"t, x\n0, 1\n1, 2\n", id="blanks"),
        pytest.param(b"t,x,\n0,1,\n1,2,\n", id="trailing commas"),
        pytest.param(b"t,x\n0,1,\n1,2,\n", id="trailing commas below the header only"),
        pytest.param(b"# by hand\n\n" + PLAIN, id="comment above"),
        pytest.param(b"# t,x\n0,1\n1,2\n", id="header in a comment"),
        pytest.param(b"t,x\n0,1\n# pause\n\n1,2\n", id="comment between"),
        pytest.param(b"t,x,by\n0,1,imu\n# pause\n1,2,vicon\n", id="comment between text"),
        pytest.param(b't,x,note\n0,1,"two\nlines"\n1,2,one\n', id="line end in quotes"),
        pytest.param(b"t,x,y,y\n0,1,3,4\n1,2,3,4\n", id="doubled column nobody needs"),
        pytest.param(b"t,x,image\n0,1," + b"a" * 200_000 + b"\n1,2,b\n", id="a picture a cell"),
    ],
)
def test_a_common_dialect_is_read(tmp_path: Path, data: bytes) -> None:
    read = columns(tmp_path, data)
    assert read.rows == 2
    assert_allclose(read["t"], [0.0, 1.0])
    assert_allclose(read["x"], [1.0, 2.0])


def test_words_for_nothing_and_for_truth_are_numbers(tmp_path: Path) -> None:
    read = columns(tmp_path, b"x,ok\nNaN,True\nN/A,false\nnull,TRUE\n,False\n")
    assert np.isnan(read["x"]).all()
    assert_allclose(read["ok"], [1.0, 0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"t,x\n0,1\n\n# pause\n1,two\n", "line 5, column 'x': got 'two', expected a number"),
        (b't,x,n\n0,1,"a\nb"\n1,1_0,c\n', "line 4, column 'x': got '1_0'"),
        (b"t;x;y\n0;0,5;1.5\n", "line 2, column 'x': got '0,5', expected a decimal point"),
        (b"t,x,x\n0,1,2\n", "2 columns are named 'x'"),
        (b"t,y\n0,1\n", "no column 'x'; it has t, y"),
        (b"0,1\n1,2\n", "line 1: got numbers, expected the names of the columns"),
        (b"", "empty, expected a text table"),
        (b"# nothing\n", "no rows below the header"),
        ("t,°\n".encode("latin-1"), "no rows below the header"),
    ],
)
def test_a_bad_table_is_refused_with_its_place(tmp_path: Path, data: bytes, said: str) -> None:
    with pytest.raises(RecordingError) as error:
        columns(tmp_path, data)["x"]
    assert said in str(error.value)
    assert "table.csv" in str(error.value)


def test_a_folder_is_no_table(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="a folder, expected a file"):
        read_table(tmp_path)


def test_a_file_that_is_too_large_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "MAX_BYTES", 8)
    with pytest.raises(RecordingError, match="split it"):
        columns(tmp_path, PLAIN)
    np.savez(tmp_path / "large.npz", t=np.zeros(9))
    with pytest.raises(RecordingError, match="split it"):
        read_table(tmp_path / "large.npz")


def test_reading_a_table_leaves_other_tables_of_the_process_their_fields(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "MAX_BYTES", 12)
    columns(tmp_path, PLAIN)
    assert next(csv.reader(["from,to,vehicles_per_hour"]))[2] == "vehicles_per_hour"


def test_an_npz_of_text_and_objects_is_read_as_far_as_it_is_numbers(tmp_path: Path) -> None:
    mixed = {"t": np.arange(2), "who": np.array(["a", "b"]), "any": np.array([{}, 1], object)}
    np.savez(tmp_path / "mixed.npz", **mixed)
    read = read_table(tmp_path / "mixed.npz")
    assert list(read) == ["t"]
    assert_allclose(read["t"], [0.0, 1.0])


def test_npz_columns_of_different_lengths_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "odd.npz", t=np.zeros(2), x=np.zeros(3))
    with pytest.raises(RecordingError, match="different lengths"):
        read_table(tmp_path / "odd.npz")


def test_a_file_that_is_no_npz_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="not a NumPy file that can be read"):
        columns(tmp_path, PLAIN, "table.npz")
