"""Parquet files as columns: numbers, times in seconds, words; fields of structs by dotted names."""

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from scm.arrays import Floats, Ints
from scm.errors import RecordingError
from scm.recording.columns import NS_PER_S, Columns, refuse_large

BYTES_A_CELL = 8


def read(path: Path, topic: str | None, wanted: Collection[str] | None) -> Columns:
    """Return the wanted columns of a Parquet file.

    Raises:
        RecordingError: when they hold neither numbers, nor times, nor words, or are too large.
    """
    del topic
    with pq.ParquetFile(path) as file:
        leaves = [file.schema.column(i).path for i in range(len(file.schema))]
        chosen = [leaf for leaf in leaves if wanted is None or leaf in wanted]
        rows, groups = file.metadata.num_rows, range(file.metadata.num_row_groups)
        encoded = sum(
            group.column(leaves.index(leaf)).total_uncompressed_size
            for group in map(file.metadata.row_group, groups)
            for leaf in chosen
        )
        refuse_large(max(encoded, rows * BYTES_A_CELL * len(chosen)), path)
        table = file.read(columns=chosen)
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    names: list[str] = []
    cells: list[Sequence[str] | Floats] = []
    ticks: dict[str, tuple[Ints, int]] = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        values, exact = _column(column, None if wanted is None else f"{path}: column {name!r}")
        if values is not None:
            names.append(name)
            cells.append(values)
        if exact is not None:
            ticks[name] = exact
    return Columns(path, names, cells, range(1, rows + 1), known=leaves, ticks=ticks)


def _column(
    column: pa.ChunkedArray, where: str | None
) -> tuple[Sequence[str] | Floats | None, tuple[Ints, int] | None]:
    """Return a column's numbers or words, and its whole numbers where it holds such.

    What is neither is None, or refused where `where` says what to name in the error.
    """
    kind = column.type
    if pa.types.is_dictionary(kind):
        column, kind = column.cast(kind.value_type), kind.value_type
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
        whole = pa.timestamp("ns", kind.tz) if pa.types.is_timestamp(kind) else pa.duration("ns")
        count = column.cast(whole).cast(pa.int64())
        return _numbers(count) / NS_PER_S, _whole(count, NS_PER_S)
    if pa.types.is_integer(kind):
        return _numbers(column), _whole(column, 1)
    if pa.types.is_boolean(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
        return _numbers(column), None
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return [word or "" for word in column.to_pylist()], None
    if where is not None:
        msg = f"{where}: holds {kind}, expected numbers, times or words"
        raise RecordingError(msg)
    return None, None


def _numbers(column: pa.ChunkedArray) -> Floats:
    """Return a column as floats; what is missing is NaN."""
    return np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), np.float64)


def _whole(column: pa.ChunkedArray, per_value: int) -> tuple[Ints, int] | None:
    """Return a column as integers, None where some are missing or too large."""
    if column.null_count or (
        column.type == pa.uint64() and column.to_numpy().max(initial=0) > np.iinfo(np.int64).max
    ):
        return None
    return np.asarray(column.to_numpy(), np.int64), per_value
