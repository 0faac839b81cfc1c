"""Saved calibrations of overhead cameras: a TOML file each, of a lens or of a place.

Both are what the Eye's own commands write: a lens for `scm eye --calibration`, a place as the
`[[cameras]]` block of a map file. Beside each may lie the report of how it was found.
"""

import json
import re
import threading
import tomllib
from pathlib import Path
from typing import Any

import msgspec

from scm.api.city import not_found
from scm.api.problem import RefusedError
from scm.records.city_map import Camera
from scm.records.eye_calibrations import CalibrationFile, CalibrationRow
from scm.v2x.messages.calibration_request import MeasuredLens

NAME = re.compile(r"[a-z0-9_-]{1,48}")
MAX_CALIBRATIONS = 500


class _Lens(MeasuredLens, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What a lens file holds, as `scm eye calibrate` writes it."""


class _Place(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    cameras: tuple[Camera, ...]


class CalibrationRepository:
    """A folder of calibrations; its files may also be put there and taken away by hand.

    Attributes:
        folder: Where they lie.
        editing: Held from reading one to changing it: the second of two writers is refused.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.editing = threading.Lock()

    def path(self, name: str) -> Path:
        """Return where a calibration's file is, or would be."""
        return self.folder / f"{name}.toml"

    def report_path(self, name: str) -> Path:
        """Return where the report of a calibration is, or would be."""
        return self.folder / f"{name}.json"

    def rows(self) -> tuple[CalibrationRow, ...]:
        """Return all that can be read, newest first."""
        paths = [path for path in self.folder.glob("*.toml") if NAME.fullmatch(path.stem)]
        rows = (self._row(path) for path in paths)
        found = [row for row in rows if row is not None]
        return tuple(sorted(found, key=lambda row: (-row.made_ns, row.name)))

    def find(self, name: str) -> CalibrationFile | None:
        """Return a calibration; None: there is no such file, or it is none."""
        row = self._row(self.path(name))
        if row is None:
            return None
        return CalibrationFile(row=row, toml=self.path(name).read_text("utf-8"))

    def get(self, name: str) -> CalibrationFile:
        """Return a calibration.

        Raises:
            RefusedError: there is none of that name.
        """
        found = self.find(name)
        if found is None:
            raise not_found("calibration", name)
        return found

    def holds(self, name: str) -> tuple[Camera | None, MeasuredLens | None]:
        """Return the place and the lens of a calibration, as `CalibrationRequest` wants them.

        A place includes the measured lens that it was found with, if that is saved.

        Raises:
            RefusedError: there is none of that name.
        """
        found = checked(self.get(name).toml)
        if isinstance(found, MeasuredLens):
            return None, found
        lenses = (checked(self.get(row.name).toml) for row in self.rows() if row.kind == "lens")
        mine = (one for one in lenses if isinstance(one, _Lens) and _is_lens_of(one, found))
        return found, next(mine, None)

    def free_name(self, name: str) -> str:
        """Return a name that no calibration has: this one, or it with a number."""
        free, number = name, 2
        while self.path(free).exists():
            free, number = f"{name[:43]}-{number}", number + 1
        return free

    def write(self, name: str, toml: str) -> CalibrationFile:
        """Save a calibration, or replace the one of that name.

        Raises:
            RefusedError: the text is neither a lens nor a place, or there are too many.
        """
        checked(toml)
        self.folder.mkdir(parents=True, exist_ok=True)
        if not self.path(name).exists() and len(self.rows()) >= MAX_CALIBRATIONS:
            detail = f"calibrations: {MAX_CALIBRATIONS} are stored; delete some first"
            raise RefusedError.of("full", detail)
        whole = self.path(name).with_suffix(".part")
        whole.write_text(toml, "utf-8")
        whole.replace(self.path(name))
        return self.get(name)

    def delete(self, name: str) -> None:
        """Delete a calibration and its report."""
        for path in (self.path(name), self.report_path(name)):
            path.unlink(missing_ok=True)

    def report(self, name: str) -> Any:
        """Return the report of how a calibration was found; None: there is none."""
        return read_json(self.report_path(name))

    def _row(self, path: Path) -> CalibrationRow | None:
        try:
            found, made_ns = checked(path.read_text("utf-8")), path.stat().st_mtime_ns
        except (OSError, UnicodeDecodeError, RefusedError):
            return None
        is_lens = isinstance(found, _Lens)
        return CalibrationRow(
            name=path.stem,
            kind="lens" if is_lens else "place",
            camera="" if isinstance(found, _Lens) else found.name,
            made_ns=made_ns,
            width_px=found.width_px,
            height_px=found.height_px,
            rms_px=found.rms_px if isinstance(found, _Lens) else None,
            views=found.views if isinstance(found, _Lens) else None,
            reported=self.report_path(path.stem).is_file(),
        )


def checked(toml: str) -> _Lens | Camera:
    """Return what a calibration's text holds.

    Raises:
        RefusedError: it is neither a lens nor one `[[cameras]]` block; with key, expected and got.
    """
    try:
        read = tomllib.loads(toml)
        if "cameras" not in read:
            return msgspec.convert(read, _Lens)
        place = msgspec.convert(read, _Place)
    except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        detail = (
            f"toml: expected a lens or one [[cameras]] block: {error}; `scm eye convert` makes one "
            "of a lens of ROS or OpenCV"
        )
        raise RefusedError.of("invalid", detail) from error
    if len(place.cameras) != 1:
        detail = f"toml: expected one [[cameras]] block, got {len(place.cameras)}"
        raise RefusedError.of("invalid", detail)
    return place.cameras[0]


def _is_lens_of(lens: MeasuredLens, camera: Camera) -> bool:
    """Return whether a camera looks through this lens, to the last digit."""
    shared = set(MeasuredLens.__struct_fields__) & set(Camera.__struct_fields__)
    return all(getattr(lens, name) == getattr(camera, name) for name in shared)


def read_json(path: Path) -> Any:
    """Return what a JSON file holds; None: there is none that can be read."""
    try:
        return json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return None
