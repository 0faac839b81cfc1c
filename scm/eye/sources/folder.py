"""Frames from a folder of pictures: by `timestamps.csv`, by times in their names, or by a rate."""

import csv
import math
import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from scm.arrays import Image
from scm.clock import NS_PER_S, nanoseconds
from scm.errors import EyeError, nearest
from scm.eye.picture import read_picture
from scm.eye.sources.player import Player

STILLS = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff")
TIMES = "timestamps.csv"
DEFAULT_RATE_HZ = 10.0  # of pictures without times
_COLUMNS = ("file", "t_s")
_SECONDS = re.compile(r"(\d+\.\d+)$")
_EPOCH = re.compile(r"(\d{16}|\d{19})$")


class FolderSource(Player):
    """Plays the pictures of a folder.

    Their times come from `timestamps.csv` (columns `file`, `t_s`) if the folder has one, which
    then also selects the pictures; else from their names if every one ends in decimal seconds
    (`cam_12.050.png`) or in 16 or 19 digits (microseconds, nanoseconds); else from the rate, in
    natural order (`2` before `10`).

    Args:
        path: The folder.
        rate_hz: If nothing else gives the times.
        loop: Whether to restart at the end; time continues.

    Raises:
        EyeError: No folder, no pictures, or times that do not ascend; names file and line.
    """

    def __init__(self, path: Path, rate_hz: float = DEFAULT_RATE_HZ, loop: bool = False) -> None:
        if not path.is_dir():
            raise EyeError(f"{path}: expected a folder of pictures, found none")
        if not (math.isfinite(rate_hz) and rate_hz > 0.0):
            raise EyeError(f"{path}: expected a rate above 0 Hz, got {rate_hz:g}")
        super().__init__(str(path), FolderReel(*_files_and_times(path, rate_hz)), loop)


class FolderReel:
    """Picture files and their times.

    Args:
        files: In order.
        times_ns: As many, ascending.
    """

    def __init__(self, files: Sequence[Path], times_ns: Sequence[int]) -> None:
        self._files = files
        self._times_ns = [t_ns - times_ns[0] for t_ns in times_ns]
        self._at = 0

    def next_ns(self) -> int | None:
        """Return the time of the next picture [ns], None at the end."""
        return self._times_ns[self._at] if self._at < len(self._files) else None

    def following_ns(self) -> int | None:
        """Return when the picture after the next is due [ns], None if that is the last."""
        return self._times_ns[self._at + 1] if self._at + 1 < len(self._files) else None

    def skip(self) -> None:
        """Skip the next picture."""
        self._at += 1

    def show(self) -> Image:
        """Return the next picture; raises an `EyeError` where it cannot be read."""
        self._at += 1
        return read_picture(self._files[self._at - 1])

    def rewind(self) -> int:
        """Go back to the first picture; return how long after the previous first it is [ns]."""
        self._at = 0
        count = len(self._files)
        mean_ns = (
            self._times_ns[-1] // (count - 1) if count > 1 else round(NS_PER_S / DEFAULT_RATE_HZ)
        )
        return self._times_ns[-1] + mean_ns

    def close(self) -> None:
        """Do nothing: no file is open."""


def _files_and_times(path: Path, rate_hz: float) -> tuple[list[Path], list[int]]:
    if (path / TIMES).is_file():
        return _from_table(path)
    files = [file for file in path.iterdir() if file.suffix.lower() in STILLS and file.is_file()]
    if not files:
        raise EyeError(f"{path}: expected pictures ({', '.join(STILLS)}), found none")
    named = [(_named_ns(file), file) for file in files]
    if all(t_ns is not None for t_ns, _ in named):
        known = sorted((t_ns or 0, file) for t_ns, file in named)
        for (t_ns, file), (later_ns, later) in pairwise(known):
            if t_ns == later_ns:
                raise EyeError(f"{path}: {file.name} and {later.name} have the same time")
        return [file for _, file in known], [t_ns for t_ns, _ in known]
    files.sort(key=_as_counted)
    return files, [round(i * NS_PER_S / rate_hz) for i in range(len(files))]


def _from_table(path: Path) -> tuple[list[Path], list[int]]:
    table = path / TIMES
    files: list[Path] = []
    times_ns: list[int] = []
    with table.open(encoding="utf-8-sig", newline="") as lines:
        rows = csv.DictReader(lines)
        if not set(_COLUMNS) <= set(rows.fieldnames or ()):
            got = ", ".join(rows.fieldnames or ()) or "nothing"
            raise EyeError(f"{table}: expected the columns file, t_s; got {got}")
        for row in rows:
            where = f"{table}: line {rows.line_num}"
            files.append(_there(path, row["file"] or "", where))
            times_ns.append(_time_ns(row["t_s"] or "", where))
            if len(times_ns) > 1 and times_ns[-1] <= times_ns[-2]:
                raise EyeError(f"{where}: expected a later time than the line before, got "
                               f"{row['t_s']}")  # fmt: skip
    if not files:
        raise EyeError(f"{table}: expected at least one picture, got none")
    return files, times_ns


def _there(path: Path, name: str, where: str) -> Path:
    if not (path / name).is_file():
        close = nearest(name, [file.name for file in path.iterdir()])
        raise EyeError(f"{where}: expected a picture in the folder, got {name!r}{close}")
    return path / name


def _time_ns(text: str, where: str) -> int:
    try:
        t_s = float(text)
    except ValueError:
        t_s = math.nan
    if not math.isfinite(t_s):
        raise EyeError(f"{where}: t_s: expected seconds, got {text!r}")
    return nanoseconds(t_s)


def _named_ns(file: Path) -> int | None:
    """Return the time in a picture's name [ns], None if there is none."""
    if of_seconds := _SECONDS.search(file.stem):
        return nanoseconds(float(of_seconds[1]))
    if of_epoch := _EPOCH.search(file.stem):
        return int(of_epoch[1].ljust(19, "0"))
    return None


def _as_counted(file: Path) -> list[tuple[int, int, str]]:
    """Return a sort key for natural order: `2` before `10`."""
    chunks = re.split(r"(\d+)", file.name.lower())
    return [(1, int(chunk), chunk) if chunk.isdigit() else (0, 0, chunk) for chunk in chunks]
