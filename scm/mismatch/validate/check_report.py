"""A report's figures, worked out again from what it wrote: its cars in its own windows."""

import csv
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.mismatch.fit.data_split import NAMES
from scm.mismatch.report.car_file import FILE
from scm.mismatch.report.write import FIELDS, GIVEN, WINDOWS
from scm.mismatch.usable_data import check
from scm.mismatch.validate.witness import UNSEEN, rms, strayed_by
from scm.recording.read import Recording
from scm.replay.drive import Drive
from scm.replay.free_run import free_run
from scm.vehicles.car import Car, load_car

Row = tuple[int, str, float, str]
"""Recording, part, start [s], and the file of the car found that it was driven with."""
AGREES = 0.005  # relative difference within which a figure is the report's


@dataclass(frozen=True, slots=True)
class Figure:
    """One root mean square error at a window's end, as reported and worked out again.

    Attributes:
        part: `fit`, `choose` or `confirm`.
        name: `position_m` or `yaw_rad`.
        car: `given.toml`, `car.toml` or `bicycle`, whose numbers `report.json` holds.
    """

    part: str
    windows: int
    name: str
    car: str
    reported: float
    again: float

    @property
    def agrees(self) -> bool:
        """Whether both are the same, within half a per cent."""
        return abs(self.again - self.reported) <= AGREES * self.reported + 1e-6


def check_report(folder: Path, recordings: Sequence[Recording]) -> list[Figure]:
    """Return every pose error that a report states, worked out again from its files.

    Args:
        folder: Of the report.
        recordings: Those that it was made of, in the same order, as they were read.

    Raises:
        ScmError: when a file of the report is missing, or these are other recordings.
    """
    fields = _fields(folder)
    fit, compared_s = fields["fit"], fields.get("compared_s")
    if fit is None:
        return []
    given, found = (load_car(folder / name) for name in (GIVEN, FILE))
    usable = check(recordings, given, math.inf if compared_s is None else compared_s).recordings
    rows = _windows(folder, len(usable))
    figures, horizon = list[Figure](), float(fit["horizon_s"])
    stages = {name: found if name == FILE else load_car(folder / name) for *_, name in rows}
    for name, side in ((GIVEN, "before"), (FILE, "after")):
        driven = dict.fromkeys(stages, given) if side == "before" else stages
        parts, errors = _errors(usable, driven, rows, horizon)
        for part in NAMES:
            mine = parts == part
            for error, reported in fit[part][side].items():
                if error in errors and mine.any():
                    again = float(np.sqrt(np.mean(errors[error][mine] ** 2)))
                    figures.append(Figure(part, int(mine.sum()), error, name, reported, again))
    return [*figures, *_of_bicycle(fit, usable, given, rows)]


def _of_bicycle(
    fit: Mapping[str, Any], recordings: Sequence[Recording], given: Car, rows: Sequence[Row]
) -> Iterator[Figure]:
    """Yield the errors of the kinematic bicycle on the part that only confirms."""
    reported = fit.get("witness")
    unseen = [row for row in rows if row[1] == UNSEEN]
    if reported is None or not unseen:
        return
    drives = [Drive(recording, given) for recording in recordings]
    windows = np.array([row[0] for row in unseen]), np.array([row[2] for row in unseen])
    again = strayed_by(drives, given, windows, float(fit["horizon_s"]), reported["numbers"])
    for name, errors in again.items():
        yield Figure(UNSEEN, len(unseen), name, "bicycle", reported[name], rms(errors))


def _fields(folder: Path) -> dict[str, Any]:
    try:
        fields: dict[str, Any] = json.loads((folder / FIELDS).read_text(encoding="utf-8"))
    except (OSError, ValueError) as cause:
        msg = f"{folder / FIELDS}: expected the fields of a report: {cause}"
        raise RecordingError(msg) from cause
    return fields


def _windows(folder: Path, recordings: int) -> list[Row]:
    """Return a report's windows; those of an older report were all driven with the car found."""
    path = folder / WINDOWS
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            rows = [
                (int(row["recording"]), row["part"], float(row["start_s"]), row.get("car", FILE))
                for row in csv.DictReader(stream)
            ]
    except (OSError, KeyError, TypeError, ValueError) as cause:
        msg = f"{path}: expected the windows of a report: {type(cause).__name__}: {cause}"
        raise RecordingError(msg) from cause
    most = max((number for number, *_ in rows), default=-1)
    if most >= recordings:
        msg = (
            f"{path}: the report is of {most + 1} or more stretches of recordings; "
            f"{recordings} are here: give the same recordings, in the same order"
        )
        raise RecordingError(msg)
    return rows


def _errors(
    recordings: Sequence[Recording],
    cars: Mapping[str, Car],
    rows: Sequence[Row],
    horizon: float,
) -> tuple[np.ndarray[tuple[int], np.dtype[np.str_]], dict[str, Floats]]:
    """Return the part of each window, and the errors at its end."""
    parts, position, yaw = list[str](), list[Floats](), list[Floats]()
    for number, recording in enumerate(recordings):
        for name, car in cars.items():
            mine = sorted(
                (start, part) for at, part, start, by in rows if (at, by) == (number, name)
            )
            if not mine:
                continue
            run = free_run(recording, car, horizon, starts_s=np.array([start for start, _ in mine]))
            known = dict(mine)
            parts += [known[float(start)] for start in run.start_s]
            position.append(run.position_error()[:, -1])
            yaw.append(run.yaw_error()[:, -1])
    return np.array(parts), {
        "position_m": np.concatenate(position),
        "yaw_rad": np.concatenate(yaw),
    }
