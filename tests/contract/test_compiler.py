"""What kernels need of numba, tried on the pinned version through its public interface only."""

import ast
import math
import pickle
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest

from scm.vehicles import jit
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.compiler.vector_code import LANES, WIDTH, fetch, put, put_lane, stage
from scm.vehicles.jit import array_kernel, inlined, kernel_function, version_folder

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "scm" / "vehicles" / "compiler"
PUBLIC = {"numba", "numba.extending"}

GAIN, SPEED, RESULT = 0, 1, 2
WHEEL_ROWS = 1
ROWS = 3


class Pair(NamedTuple):
    """Two arrays."""

    a: np.ndarray
    b: np.ndarray


class Table(ArrayStruct):
    """Arrays of several types and shapes, as drivers pass them."""

    flags: np.ndarray
    counts: np.ndarray
    values: np.ndarray


class Tables(ArrayStruct):
    first: Table
    second: Table


@kernel_function
def weighted(table, row):
    return table.counts[row] * table.values[row, -1] if table.flags[row] else 0.0


@array_kernel
def add_up(tables, out):
    for row in range(len(tables.first.counts)):
        out[row] = weighted(tables.first, row) + weighted(tables.second, row)
    tables.second.values[0, 0] = tables.second.values.shape[1]


def table(rows, columns, *, flag):
    return Table(
        flags=np.full(rows, flag),
        counts=np.arange(rows),
        values=np.arange(float(rows * columns)).reshape(rows, columns),
    )


@kernel_function
def total(pair, k):
    return pair.a[k] + pair.b[k]


@inlined
def clipped(x):
    return min(max(x, -1.0), 1.0)


@kernel_function
def over(x, y):
    return x / y


@array_kernel
def fill(pair, out):
    for k in range(len(out)):
        out[k] = clipped(total(pair, k)) + over(0.5, pair.a[k])


@stage
def work(car, wheel, w, dt, vectors):
    gain = car[GAIN]
    speed = car[SPEED]
    "skeleton"
    fused = gain * speed + dt
    "terms"
    root = np.sqrt(np.maximum(fused, 0.0))
    car[RESULT] = np.where(speed < 0.0, -root, np.copysign(root, np.floor(speed) + 0.5))


@array_kernel
def run(car, wheel, block, vectors, lane):
    car_at, block_at, width = car.ctypes.data, block.ctypes.data, block.shape[1]
    fetch(car_at, GAIN, block_at, width, 0, LANES, 2, 2)
    work(car_at, wheel.ctypes.data, 0, 0.25, vectors)
    if lane < 0:
        put(car_at, RESULT, block_at, width, 1, LANES, 1, 1)
    else:
        put_lane(car_at, RESULT, block_at, width, 1, LANES, 1, 1, lane)


def buffer(rows):
    """Return rows that begin on a cache line."""
    room = np.zeros(rows * LANES + 8)
    begin = (64 - room.ctypes.data % 64) // 8 % 8
    return room[begin : begin + rows * LANES].reshape(rows, LANES)


def block():
    """Return two tiles of cars: gains, nothing, speeds."""
    columns = np.arange(2.0 * LANES)
    return np.array([1.0 + columns, 0.0 * columns, columns - 1.25 * LANES])


def expected(values):
    roots = np.sqrt(np.maximum(values[0] * values[2] + 0.25, 0.0))
    return np.where(values[2] < 0.0, -roots, roots)


def test_only_the_public_interface_of_numba_is_imported():
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "scm").rglob("*.py")]
    imported = {
        name
        for text in texts if "numba" in text
        for node in ast.walk(ast.parse(text))
        for name in (
            [alias.name for alias in node.names] if isinstance(node, ast.Import)
            else [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        )
        if name.partition(".")[0] == "numba"
    }  # fmt: skip
    assert imported <= PUBLIC
    assert imported


def test_the_generator_is_at_most_1700_lines():
    assert (
        sum(len(p.read_text(encoding="utf-8").splitlines()) for p in PACKAGE.glob("*.py")) <= 1700
    )


def test_numba_is_pinned_to_one_minor_version():
    minor = int(numba.__version__.split(".")[1])
    assert f'"numba>=0.{minor},<0.{minor + 1}"' in (ROOT / "pyproject.toml").read_text()


def test_functions_of_tuples_of_arrays_are_called_from_kernels():
    out = np.zeros(2)
    fill(Pair(np.array([0.5, -4.0]), np.array([0.25, 1.0])), out)
    assert out.tolist() == [1.75, -1.125]


def test_kernels_read_and_write_the_arrays_of_a_record_of_records():
    tables, out = Tables(table(4, 2, flag=True), table(4, 3, flag=True)), np.zeros(4)
    add_up(tables, out)
    assert out.tolist() == [0.0, 3.0 + 5.0, 2 * (5.0 + 8.0), 3 * (7.0 + 11.0)]
    assert tables.second.values[0, 0] == 3.0
    off = Tables(tables.first, table(4, 3, flag=False))
    add_up(off, out)
    assert out.tolist() == [0.0, 3.0, 10.0, 21.0]


def test_a_function_of_a_record_is_called_from_python():
    assert weighted(table(4, 2, flag=True), 3) == 21.0


def test_a_record_refuses_arrays_with_gaps():
    with pytest.raises(ValueError, match="values must be C-contiguous"):
        Table(np.ones(2, np.bool_), np.arange(2), np.zeros((3, 2)).T)


def test_division_by_zero_gives_infinity_in_kernels_and_in_plain_calls():
    out = np.zeros(1)
    fill(Pair(np.zeros(1), np.zeros(1)), out)
    assert out[0] == math.inf
    assert over(1.0, 0.0) == math.inf


def test_a_kernel_function_survives_pickling():
    assert pickle.loads(pickle.dumps(over)) is over


def test_a_stage_works_on_a_tile_of_the_block_and_leaves_the_others():
    values, car = block(), buffer(ROWS)
    run(car, buffer(4), values, LANES // WIDTH, -1)
    np.testing.assert_allclose(values[1, LANES:], expected(block()[:, LANES:]), rtol=1e-15)
    assert not values[1, :LANES].any()


def test_a_stage_leaves_lanes_beyond_its_vectors():
    values, car = block(), buffer(ROWS)
    run(car, buffer(4), values, 1, -1)
    assert values[1, LANES : LANES + WIDTH].any()
    assert not values[1, LANES + WIDTH :].any()


def test_one_lane_is_put_alone():
    values, car = block(), buffer(ROWS)
    run(car, buffer(4), values, LANES // WIDTH, 12)
    assert np.flatnonzero(values[1]).tolist() == [LANES + 12]


def test_a_changed_file_has_another_cache_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    source = tmp_path / "package" / "part.py"
    source.parent.mkdir()
    source.write_text("A = 1\n")
    before = version_folder.__wrapped__(source.parent)
    assert version_folder.__wrapped__(source.parent) == before
    source.write_text("A = 10\n")
    assert version_folder.__wrapped__(source.parent) != before


def test_cut_off_files_of_the_cache_are_deleted(tmp_path):
    whole, cut = tmp_path / "a" / "whole.nbi", tmp_path / "a" / "cut.nbc"
    whole.parent.mkdir()
    whole.write_bytes(pickle.dumps("numba"))
    cut.write_bytes(pickle.dumps("numba")[:-2])
    jit.delete_damaged(tmp_path)
    assert whole.exists()
    assert not cut.exists()
