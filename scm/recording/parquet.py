"""Parquet and Feather files as columns: numbers, times in seconds, text.

A field of a struct is `pose.x`, an element of a list `points[0]`.
"""

import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.ipc
import pyarrow.parquet as pq

from scm.arrays import Floats, Ints
from scm.errors import RecordingError
from scm.recording.columns import NS_PER_S, Columns, Selection, refuse_large

BYTES_A_CELL = 8
BATCH_ROWS = 1 << 16
MAX_NAMED = 9  # elements of a list that get a name where nobody said which are wanted
NS_PER_DAY = 86_400 * NS_PER_S
_ELEMENT = re.compile(r"\[\d+\]")
_LEAF_OF_LIST = re.compile(r"\.(list|bag)\.(element|item|array_element|array)")


def read(path: Path, selection: Selection) -> Columns:
    """Return the wanted columns of a Parquet or Feather file.

    Raises:
        RecordingError: when they hold neither numbers, nor times, nor words, or are too large.
    """
    wanted = selection.wanted
    table, known = (_of_parquet if _is_parquet(path) else _of_feather)(path, wanted)
    names: list[str] = []
    cells: list[Sequence[str] | Floats] = []
    ticks: dict[str, tuple[Ints, int]] = {}
    for top, whole in zip(table.column_names, table.columns, strict=True):
        for name, column in _parts(top, whole, wanted):
            if wanted is not None and name not in wanted:
                continue
            where = None if wanted is None else f"{path}: column {name!r}"
            values, exact = _column(column, where)
            if values is not None:
                names.append(name)
                cells.append(values)
            if exact is not None:
                ticks[name] = exact
    lines = range(1, table.num_rows + 1)
    return Columns(path, names, cells, lines, known=known, ticks=ticks)


def _is_parquet(path: Path) -> bool:
    return path.name.lower().endswith(".parquet")


def _of_parquet(path: Path, wanted: Collection[str] | None) -> tuple[pa.Table, list[str]]:
    """Return the columns of a Parquet file that hold what is wanted, and the names of all."""
    with pq.ParquetFile(path) as file:
        leaves = [file.schema.column(i).path for i in range(len(file.schema))]
        plain = [_LEAF_OF_LIST.sub("", leaf) for leaf in leaves]
        chosen = [k for k, name in enumerate(plain) if _is_wanted(name, wanted)]
        refuse_large(file.metadata.num_rows * BYTES_A_CELL * len(chosen), path)
        # Sizes by column stand in the metadata, but pyarrow aborts where those are damaged.
        batches, size = [], 0
        for batch in file.iter_batches(BATCH_ROWS, columns=[leaves[k] for k in chosen]):
            size += batch.nbytes
            refuse_large(size, path)
            batches.append(batch)
        if batches:
            return pa.Table.from_batches(batches), plain
        return file.read(columns=[leaves[k] for k in chosen]), plain


def _of_feather(path: Path, wanted: Collection[str] | None) -> tuple[pa.Table, list[str]]:
    """Return the columns of a Feather (Arrow IPC) file that hold what is wanted, and all names."""
    refuse_large(path.stat().st_size, path)
    with pa.memory_map(str(path)) as source:
        schema = pa.ipc.open_file(source).schema
        tops = [k for k, name in enumerate(schema.names) if _is_wanted(name, wanted)]
        options = pa.ipc.IpcReadOptions(included_fields=tops or [0])
        table = pa.ipc.open_file(source, options=options).read_all()
    refuse_large(table.nbytes, path)
    return table, list(schema.names)


def _is_wanted(name: str, wanted: Collection[str] | None) -> bool:
    """Say whether a column, or a part of it, is wanted."""
    if wanted is None:
        return True
    bases = [_ELEMENT.sub("", one) for one in wanted]
    return any(base == name or base.startswith(f"{name}.") for base in bases)


def _parts(
    name: str, column: pa.ChunkedArray, wanted: Collection[str] | None
) -> Iterator[tuple[str, pa.ChunkedArray]]:
    """Yield a column, or the fields of its structs and the elements of its lists, by name."""
    kind = column.type
    if pa.types.is_dictionary(kind):
        column, kind = column.cast(kind.value_type), kind.value_type
    if pa.types.is_struct(kind):
        for field, part in zip(kind, column.flatten(), strict=True):
            yield from _parts(f"{name}.{field.name}", part, wanted)
    elif (
        pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)
    ):
        for k in _elements(name, column, wanted):
            part = pc.list_slice(column, k, k + 1, return_fixed_size_list=True)
            yield from _parts(f"{name}[{k}]", pc.list_element(part, 0), wanted)
        if wanted is not None and name in wanted:
            yield name, column
    else:
        yield name, column


def _elements(name: str, column: pa.ChunkedArray, wanted: Collection[str] | None) -> list[int]:
    """Return which elements of the lists of a column are wanted, as far as there are any."""
    longest = pc.max(pc.list_value_length(column)).as_py() or 0
    if wanted is None:
        return list(range(min(longest, MAX_NAMED)))
    begins = [one.removeprefix(f"{name}[") for one in wanted if one.startswith(f"{name}[")]
    return sorted(
        {int(k) for one in begins if (k := one.split("]")[0]).isdecimal()} & {*range(longest)}
    )


def _column(
    column: pa.ChunkedArray, where: str | None
) -> tuple[Sequence[str] | Floats | None, tuple[Ints, int] | None]:
    """Return a column's numbers or words, and its whole numbers where it holds such.

    What is neither is None, or refused where `where` says what to name in the error.
    """
    kind = column.type
    if (count := _nanoseconds(column)) is not None:
        return _numbers(count) / NS_PER_S, _whole(count, NS_PER_S)
    if pa.types.is_integer(kind):
        return _numbers(column), _whole(column, 1)
    if pa.types.is_boolean(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
        return _numbers(column), None
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan), None
    if pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_string_view(kind):
        return [word or "" for word in column.to_pylist()], None
    if where is not None:
        name = where.rsplit("'", 2)[1]
        hint = f": name one element, as `{name}[0]`" if hasattr(kind, "value_type") else ""
        msg = f"{where}: holds {kind}, expected numbers, times or words{hint}"
        raise RecordingError(msg)
    return None, None


def _nanoseconds(column: pa.ChunkedArray) -> pa.ChunkedArray | None:
    """Return times, durations and dates as counts of nanoseconds, None for others.

    A time of day counts from midnight, a date from 1970.
    """
    kind = column.type
    if pa.types.is_timestamp(kind):
        return column.cast(pa.timestamp("ns", kind.tz)).cast(pa.int64())
    if pa.types.is_duration(kind):
        return column.cast(pa.duration("ns")).cast(pa.int64())
    if pa.types.is_time(kind):
        return column.cast(pa.time64("ns")).cast(pa.int64())
    if pa.types.is_date(kind):
        return pc.multiply(column.cast(pa.date32()).cast(pa.int32()).cast(pa.int64()), NS_PER_DAY)
    return None


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
