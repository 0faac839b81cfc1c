"""What lies in the folder of a study, read without its scenario: nobody else's code is run.

runs/studies/NAME/
    study.toml, ...        the study file and all that it names, as they were
    manifest.json          name, factors, versions, machine, times
    parts/*.parquet        rows as they came, until the study is complete
    cases.parquet          all rows by case number, once it is
    recordings/*.mcap      recorded cases
    output.log             what scenarios printed

`results.py` writes it.
"""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import pyarrow.parquet as pq

from scm.errors import StudyError, reading
from scm.study.row import Row
from scm.study.study_file import RESERVED, StudyFile, load_study
from scm.study.targets import Axis

STUDIES = Path("runs/studies")
STUDY, MANIFEST, CASES, PARTS = "study.toml", "manifest.json", "cases.parquet", "parts"
RECORDINGS = "recordings"


class Manifest(msgspec.Struct, frozen=True, kw_only=True):
    """What the manifest says besides versions.

    Attributes:
        cases: How many there are in all.
        about: What the scenario does, in one line.
        factors: By column of the rows, the factor's key in the study file.
        state: `complete`, or empty.
        began, ended: ISO 8601; empty: not yet.
        host, pid: Where and as which process it runs, or ran last.
    """

    name: str
    cases: int
    about: str
    factors: dict[str, str]
    state: str = ""
    began: str = ""
    ended: str = ""
    host: str = ""
    pid: Annotated[int, msgspec.Meta(ge=0, lt=2**31)] = 0


@dataclass(frozen=True, slots=True)
class StoredResults:
    """Results of a study, to be looked at.

    Attributes:
        axes: Its factors.
        cases: How many there are in all.
        about: What the scenario does, in one line.
        rows: All that are there, by case.
    """

    folder: Path
    file: StudyFile
    axes: tuple[Axis, ...]
    cases: int
    about: str
    rows: Mapping[int, Row]


def read_results(folder: Path) -> StoredResults:
    """Return the results of a folder.

    Raises:
        StudyError: when there are none, or they cannot be read.
    """
    manifest, file = read_description(folder)
    axes = tuple(Axis(path, key, file.factors[key]) for path, key in manifest.factors.items())
    found = read_rows(folder, list(manifest.factors), file.measures)
    rows = {row.case: row for row in found}
    return StoredResults(folder, file, axes, manifest.cases, manifest.about, rows)


def read_description(folder: Path) -> tuple[Manifest, StudyFile]:
    """Return what describes a study: its manifest and its file.

    Raises:
        StudyError: when they are not there, or cannot be read.
    """
    check_folder(folder)
    with reading(folder / MANIFEST, "a study's manifest", StudyError):
        manifest = msgspec.convert(read_manifest(folder), Manifest)
    file = load_study(folder / STUDY, manifest.name)
    unknown = sorted({*manifest.factors.values()} - {*file.factors})
    if unknown:
        msg = f"{folder / MANIFEST}: factors: {STUDY} has none named {', '.join(unknown)}"
        raise StudyError(msg)
    return manifest, file


def check_folder(folder: Path) -> None:
    """Raise if a folder is not a study's.

    Raises:
        StudyError: naming those that there are.
    """
    if not (folder / STUDY).is_file():
        known = sorted(path.parent.name for path in STUDIES.glob(f"*/{STUDY}"))
        there = f"; in {STUDIES} are {', '.join(known)}" if known else ""
        raise StudyError(f"{folder}: expected the folder of a study, with {STUDY}{there}")


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return a study's manifest.

    Raises:
        StudyError: when it cannot be read.
    """
    path = folder / MANIFEST
    with reading(path, "a study's manifest", StudyError):
        manifest: dict[str, Any] = json.loads(path.read_text("utf-8"))
        return {"name": manifest["name"], **manifest}


def read_rows(folder: Path, factors: Collection[str], measures: Collection[str]) -> Iterator[Row]:
    """Yield all rows of a folder; after a crash one may come twice.

    Raises:
        StudyError: when a file cannot be read.
    """
    whole = folder / CASES
    for path in [*([whole] if whole.is_file() else []), *parts_of(folder)]:
        with reading(path, "rows of a study", StudyError):
            for entry in pq.read_table(path).to_pylist():
                found = {name: entry[name] for name in measures}
                yield Row(
                    **{name: entry[name] for name in RESERVED},
                    values={name: entry[name] for name in factors},
                    measures={name: value for name, value in found.items() if value is not None},
                )


def parts_of(folder: Path) -> list[Path]:
    """Return the files of rows of a study that is not complete."""
    return sorted((folder / PARTS).glob("*.parquet"))


def recording_of(folder: Path, number: int) -> Path | None:
    """Return the recording of a case; None: it was not recorded."""
    path = folder / RECORDINGS / recording_name(number)
    return path if path.is_file() else None


def recording_name(number: int) -> str:
    """Return the name of the recording of a case."""
    return f"case-{number}.mcap"
