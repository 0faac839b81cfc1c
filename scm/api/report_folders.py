"""Stored mismatch reports: which there are, what each found, and its files.

A report is a folder with `report.json`; of several cars it is a folder with a report for each, and
each of those is a report of its own here, `FOLDER.CAR`. `job.json` holds what it was made from.
"""

import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from scm.records.mismatch import Job, ReportRow, Together

NAME = r"^[a-z0-9][a-z0-9_-]{0,63}(\.[a-zA-Z0-9_-]{1,64})?$"
FILES = {
    "report.html": "text/html",
    "report.json": "application/json",
    "drawn.json": "application/json",
    "car.toml": "application/toml",
    "retuned.toml": "application/toml",
    "given.toml": "application/toml",
    "windows.csv": "text/csv",
}
_FIELDS, _DRAWN, _JOB, _CARS = "report.json", "drawn.json", "job.json", "cars.json"
_DRIVE, _RECORDED_DRIVE = re.compile(r"next_drive(_\d{1,2})?"), re.compile(r"told_\d{1,4}")
PARTIAL = ".partial"
"""Ends the name of a folder that is being written or removed; it begins with a dot."""
MOST_SHOWN_BYTES = 16 * 2**20


class _Cars(msgspec.Struct):
    said: str
    conclusions: tuple[str, ...] = ()


class _Errors(msgspec.Struct):
    before: dict[str, float | None] = {}
    after: dict[str, float | None] = {}


class _Fit(msgspec.Struct):
    confirm: _Errors


class _Report(msgspec.Struct):
    verdict: str
    runtime_s: float = 0.0
    fit: _Fit | None = None
    unasked: tuple[Any, ...] = ()


class _Title(msgspec.Struct):
    title: str


class _Drawn(msgspec.Struct):
    said: str
    vehicle: str = ""
    recordings: tuple[str, ...] = ()
    effects: tuple[_Title, ...] = ()


class ReportFolders:
    """The folder of reports; None: there is none, and no report."""

    def __init__(self, root: Path | None) -> None:
        self.root = root
        self._rows: dict[Path, tuple[int, ReportRow]] = {}

    def rows(self) -> list[ReportRow]:
        """Return all reports, newest first."""
        found = []
        for name, folder in self._folders():
            with suppress(FileNotFoundError):  # somebody removes it at this moment
                found.append(self._row(name, folder))
        return sorted(found, key=lambda row: (-row.made_ns, row.name))

    def find(self, name: str) -> Path | None:
        """Return a report's folder; None: there is none of that name."""
        if self.root is None or not re.fullmatch(NAME, name):
            return None
        folder = self.root.joinpath(*name.split(".", 1))
        return folder if (folder / _FIELDS).is_file() else None

    def row(self, name: str, folder: Path) -> ReportRow:
        """Return one report as the list has it."""
        return self._row(name, folder)

    def remove(self, name: str) -> bool:
        """Remove a report; of several cars' the one car's. Return whether there was one."""
        folder = self.find(name)
        if folder is None or self.root is None:
            return False
        # Renamed first: who reads reports at this moment finds a whole one or none.
        removed = Path(tempfile.mkdtemp(prefix=".", suffix=PARTIAL, dir=self.root))
        try:
            folder.rename(removed)
        except FileNotFoundError:  # somebody else removed it at this moment
            return False
        finally:
            shutil.rmtree(removed)
        if folder.parent != self.root and not _cars_in(folder.parent):
            shutil.rmtree(folder.parent, ignore_errors=True)
        return True

    def job(self, folder: Path) -> Job | None:
        """Return what a report was made from; None: unknown."""
        for place in (folder, folder.parent):
            try:
                return msgspec.json.decode((place / _JOB).read_bytes(), type=Job)
            except (OSError, msgspec.MsgspecError):
                continue
        return None

    def fields(self, folder: Path) -> tuple[Any, Any]:
        """Return `report.json` and `drawn.json`; None for one that is missing or damaged."""
        return _read(folder / _FIELDS, dict), _read(folder / _DRAWN, dict)

    def together(self, folder: Path) -> Together | None:
        """Return what a report's car has in common with those beside it; None: it is alone."""
        above = folder.parent
        found = _read(above / _CARS, _Cars) if above != self.root else None
        if found is None:
            return None
        cars = sorted(f"{above.name}.{car.name}" for car in _cars_in(above))
        return Together(said=found.said, conclusions=found.conclusions, cars=tuple(cars))

    def drives(self, folder: Path) -> list[str]:
        """Return the names of the drives that the report suggests."""
        found = [one.name for one in folder.iterdir() if _DRIVE.fullmatch(one.name)]
        return sorted(name for name in found if any((folder / name).glob("*.yaml")))

    def recorded_drives(self, folder: Path) -> list[Path]:
        """Return recordings of suggested drives that were driven, oldest first."""
        found = [one for one in folder.iterdir() if _RECORDED_DRIVE.fullmatch(one.name)]
        return sorted(
            (one for one in found if (one / "recording.yaml").is_file()),
            key=lambda one: int(one.name.removeprefix("told_")),
        )

    def _folders(self) -> Iterator[tuple[str, Path]]:
        if self.root is None or not self.root.is_dir():
            return
        for folder in self.root.iterdir():
            if not re.fullmatch(NAME, folder.name) or not folder.is_dir():
                continue
            if (folder / _FIELDS).is_file():
                yield folder.name, folder
            elif (folder / _CARS).is_file():
                for car in _cars_in(folder):
                    yield f"{folder.name}.{car.name}", car

    def _row(self, name: str, folder: Path) -> ReportRow:
        made_ns = (folder / _FIELDS).stat().st_mtime_ns
        known = self._rows.get(folder)
        if known is None or known[0] != made_ns:
            known = self._rows[folder] = made_ns, self._read_row(name, folder, made_ns)
        return known[1]

    def _read_row(self, name: str, folder: Path, made_ns: int) -> ReportRow:
        report = _read(folder / _FIELDS, _Report)
        drawn = _read(folder / _DRAWN, _Drawn)
        if report is None:
            text = "Its files are damaged, or of another version."
            return ReportRow(name=name, made_ns=made_ns, verdict="unreadable", said=text)
        job = self.job(folder)
        confirm = report.fit.confirm if report.fit else _Errors()
        return ReportRow(
            name=name,
            made_ns=made_ns,
            verdict=report.verdict,
            said=drawn.said if drawn else "",
            effects=tuple(effect.title for effect in drawn.effects) if drawn else (),
            vehicle=drawn.vehicle if drawn else "",
            source=job.source if job else ", ".join(drawn.recordings if drawn else ()),
            before_m=confirm.before.get("position_m"),
            after_m=confirm.after.get("position_m"),
            runtime_s=report.runtime_s,
            cut_short=bool(report.unasked),
        )


def _cars_in(folder: Path) -> list[Path]:
    try:
        return [car for car in folder.iterdir() if (car / _FIELDS).is_file()]
    except FileNotFoundError:  # the last car's report is removed at this moment
        return []


def _read(path: Path, kind: Any) -> Any:
    try:
        if path.stat().st_size > MOST_SHOWN_BYTES:
            return None
        return msgspec.json.decode(path.read_bytes(), type=kind)
    except (OSError, msgspec.MsgspecError):
        return None
