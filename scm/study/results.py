"""Writes the folder of a study: its files, who ran it, and one row a case, safe against crashes.

`stored.py` lists the files. Rows are written at least once a second, to a file that gets its name
when it is whole. A case whose row is not there yet is run again.
"""

import json
import os
import platform
import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

import scm
from scm.clock import WallClock, seconds
from scm.errors import StudyError
from scm.study.design import Design
from scm.study.loaded_study import LoadedStudy, load
from scm.study.row import Row
from scm.study.stored import (
    CASES,
    MANIFEST,
    PARTS,
    STUDY,
    check_folder,
    parts_of,
    read_manifest,
    read_rows,
)
from scm.study.study_file import RESERVED, Measure, Value

WRITE_EVERY_S = 1.0
MAX_WAITING = 500
PACKAGES = ("numpy", "numba", "scipy", "msgspec", "distributed", "optuna", "pyarrow", "pymunk")


class Results:
    """The folder of one study.

    Attributes:
        rows: All that are there, by case.
        file, axes, cases, about: As `StoredResults` has them.
    """

    def __init__(self, folder: Path, study: LoadedStudy) -> None:
        self.folder, self.study = folder, study
        self._schema = schema_of(study.design, study.file.measures)
        self.file, self.axes = study.file, study.design.axes
        self.cases, self.about = len(study.design), study.scenario.about
        factors = [axis.path for axis in self.axes]
        found = read_rows(folder, factors, study.file.measures)
        self.rows: dict[int, Row] = {row.case: row for row in found}
        self._waiting: list[Row] = []
        self._clock = WallClock()
        self._written_ns = self._clock.now_ns()
        self._next_part = 1 + max((int(p.stem) for p in parts_of(folder)), default=0)

    def add(self, row: Row) -> None:
        """Add a row; it is on the disk within a second."""
        if row.case in self.rows:
            return  # a case that was run twice, as its first worker seemed lost
        self.rows[row.case] = row
        self._waiting.append(row)
        late_s = seconds(self._clock.now_ns() - self._written_ns)
        if late_s >= WRITE_EVERY_S or len(self._waiting) >= MAX_WAITING:
            self.write()

    def write(self) -> None:
        """Write what has not been written yet."""
        if self._waiting:
            path = self.folder / PARTS / f"{self._next_part:09d}.parquet"
            path.parent.mkdir(exist_ok=True)
            _write(table_of(self._waiting, self._schema), path)
            self._next_part += 1
            self._waiting.clear()
        self._written_ns = self._clock.now_ns()

    def finish(self, **facts: object) -> None:
        """Put all rows into one file, by case, and note in the manifest how it ended."""
        self.write()
        ordered = [self.rows[number] for number in sorted(self.rows)]
        _write(table_of(ordered, self._schema), self.folder / CASES)
        shutil.rmtree(self.folder / PARTS, ignore_errors=True)
        self.note(ended=_now(), **facts)

    def note(self, **facts: object) -> None:
        """Write further facts into the manifest."""
        manifest = {**read_manifest(self.folder), **facts}
        _write_text(json.dumps(manifest, indent=2) + "\n", self.folder / MANIFEST)


def create_results(study: LoadedStudy, folder: Path, command: Sequence[str]) -> Results:
    """Return the folder of a study, a new one or one that is to be continued.

    Raises:
        StudyError: when the folder holds another study, or this one with other content.
    """
    if (folder / STUDY).exists():
        _check_same(study, folder)
    else:
        folder.mkdir(parents=True, exist_ok=True)
        for name in study.file.files():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(study.file.folder / name, folder / name)
        manifest = {"name": study.file.name, **facts_of_run(command)}
        _write_text(json.dumps(manifest, indent=2) + "\n", folder / MANIFEST)
        _write_text(study.file.text, folder / STUDY)  # last: with it, the folder is complete
    results = Results(folder, study)
    results.note(
        cases=results.cases,
        about=results.about,
        factors={axis.path: axis.key for axis in results.axes},
        host=platform.node(),
        pid=os.getpid(),
    )
    return results


def open_results(folder: Path) -> Results:
    """Return the results of a folder with all that running more of them needs.

    Raises:
        StudyError: when there are none, or they cannot be read.
    """
    check_folder(folder)
    return Results(folder, load(folder / STUDY, read_manifest(folder)["name"]))


def facts_of_run(command: Sequence[str]) -> dict[str, object]:
    """Return what a reader needs to run a study again: versions, machine, time, command."""
    return {
        "scm": scm.__version__,
        "git": _git_hash(),
        "python": platform.python_version(),
        "packages": {name: found for name in PACKAGES if (found := _version(name))},
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, {platform.platform()}",
        "command": " ".join(command),
        "began": _now(),
    }


def schema_of(design: Design, measures: Mapping[str, Measure]) -> pa.Schema:
    """Return the columns of a study's rows; units are in the fields' metadata."""
    case, replication, seed, outcome, detail, took = RESERVED
    fields = [pa.field(case, pa.int64()), pa.field(replication, pa.int64())]
    fields.append(pa.field(seed, pa.int64()))
    for axis in design.axes:
        kind = pa.float64() if axis.factor.is_drawn else _type_of(axis.factor.levels)
        fields.append(pa.field(axis.path, kind, metadata={"role": "factor"}))
    for name, measure in measures.items():
        facts = {"role": "measure", "unit": measure.unit, "about": measure.about}
        fields.append(pa.field(name, pa.float64(), metadata=facts))
    fields += [pa.field(outcome, pa.string()), pa.field(detail, pa.string())]
    return pa.schema([*fields, pa.field(took, pa.float64(), metadata={"unit": "s"})])


def table_of(rows: Iterable[Row], schema: pa.Schema) -> pa.Table:
    """Return rows as a table."""
    return pa.Table.from_pylist([_flat(row, schema) for row in rows], schema=schema)


def _flat(row: Row, schema: pa.Schema) -> dict[str, object]:
    plain = {name: getattr(row, name) for name in RESERVED} | {**row.values} | {**row.measures}
    return {
        field.name: str(plain[field.name])
        if pa.types.is_string(field.type) and field.name in row.values
        else plain.get(field.name)
        for field in schema
    }


def _type_of(levels: Sequence[Value]) -> pa.DataType:
    """Return the type of a factor's column; levels of several types are written as text."""
    if all(isinstance(level, bool) for level in levels):
        return pa.bool_()
    if any(isinstance(level, bool | str) for level in levels):
        return pa.string()
    whole = all(isinstance(level, int) for level in levels)
    return pa.int64() if whole else pa.float64()


def _check_same(study: LoadedStudy, folder: Path) -> None:
    """Refuse to mix the rows of two studies in one folder."""
    old = read_manifest(folder)["name"]
    if old != study.file.name:
        msg = f"{folder}: expected results of {study.file.name}, got those of {old}: use --out"
        raise StudyError(msg)
    names = [Path(STUDY), *study.file.files()]
    own = [study.file.text.encode()]
    own += [(study.file.folder / name).read_bytes() for name in study.file.files()]
    changed = [
        str(name)
        for name, content in zip(names, own, strict=True)
        if not (folder / name).is_file() or (folder / name).read_bytes() != content
    ]
    if changed:
        msg = (
            f"{folder}: {' and '.join(changed)} changed since these results were begun: "
            f"use --out for another folder, or delete this one"
        )
        raise StudyError(msg)


def _write(table: pa.Table, path: Path) -> None:
    """Write a file that is there whole or not at all, whatever happens."""
    new = path.with_suffix(".new")
    pq.write_table(table, new)
    _sync(new)
    new.replace(path)
    _sync(path.parent)


def _write_text(text: str, path: Path) -> None:
    new = path.with_suffix(".new")
    new.write_text(text, "utf-8")
    _sync(new)
    new.replace(path)


def _sync(path: Path) -> None:
    opened = os.open(path, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _git_hash() -> str:
    """Return the commit that this program is of; empty: it is not of a repository."""
    folder = Path(scm.__file__).parent
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10.0, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
