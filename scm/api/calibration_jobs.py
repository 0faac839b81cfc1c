"""Calibration of overhead cameras: pictures of a board, and the Eye's own tools run on them.

Pictures lie in a folder for each camera. What measures a lens or a place is `scm eye calibrate` and
`scm eye locate`, each run as a program of its own on an operation, and killed when called off.
"""

import re
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec

from scm.api.calibration_repository import CalibrationRepository, read_json
from scm.api.city import not_found
from scm.api.operations import Cancelled, ProgressReporter
from scm.api.problem import RefusedError
from scm.errors import RunError
from scm.runtime.parent_watch import with_parent

LARGEST_PICTURE = 8 * 1024 * 1024
MOST_VIEWS = 60
MOST_CAMERAS = 50
LONGEST_S = 600.0
LOOK_S = 0.1
_LAST_WORDS = 2_000
_JPEG, _PNG = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"
_JPEG_SIZES = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
VIEW = re.compile(r"[0-9]{4}\.(jpg|png)")


class FloorTag(msgspec.Struct, kw_only=True, frozen=True):
    """A tag laid on the floor, whose place was measured."""

    id: int
    x_m: float
    y_m: float
    yaw_rad: float
    size_m: float


class CalibrationJobs:
    """Pictures and tools of one city's cameras.

    Args:
        repository: Where calibrations are stored; pictures lie below it.
        map_file: Name or path of the map, as passed to the tools.
    """

    def __init__(self, repository: CalibrationRepository, map_file: str) -> None:
        self.repository = repository
        self._map_file = map_file
        self._views = repository.folder / "views"

    def views(self, camera: str) -> tuple[Path, ...]:
        """Return a camera's pictures of a board, in the order they came."""
        found = (self._views / camera).glob("*.*")
        return tuple(sorted(path for path in found if VIEW.fullmatch(path.name)))

    def view(self, camera: str, name: str) -> Path:
        """Return where a picture is.

        Raises:
            RefusedError: there is none of that name.
        """
        path = self._views / camera / name
        if not VIEW.fullmatch(name) or not path.is_file():
            raise not_found("picture", name)
        return path

    def add_view(self, camera: str, picture: bytes) -> Path:
        """Keep a picture, a JPEG or PNG file.

        Raises:
            RefusedError: it is neither, of another size than those there, or one too many.
        """
        size = size_of(picture)
        there = self.views(camera)
        if len(there) >= MOST_VIEWS:
            detail = f"pictures of {camera}: {MOST_VIEWS} are stored; delete some first"
            raise RefusedError.of("full", detail)
        if there:
            first = size_of(there[0].read_bytes())
            if size != first:
                wanted = f"{first[0]} x {first[1]} px as {there[0].name}"
                detail = f"picture: expected {wanted}, got {size[0]} x {size[1]} px"
                raise RefusedError.of("invalid", detail)
        folder = self._views / camera
        if not folder.exists() and sum(1 for _ in self._views.glob("*")) >= MOST_CAMERAS:
            detail = f"pictures of {MOST_CAMERAS} cameras are stored; delete those of one first"
            raise RefusedError.of("full", detail)
        folder.mkdir(parents=True, exist_ok=True)
        number = int(there[-1].stem) + 1 if there else 1
        ending = "jpg" if picture.startswith(_JPEG) else "png"
        path = folder / f"{number:04d}.{ending}"
        path.write_bytes(picture)
        return path

    def delete_views(self, camera: str) -> None:
        """Throw all of a camera's pictures away, and what was found in them."""
        for path in (*self.views(camera), self._report_path(camera)):
            path.unlink(missing_ok=True)
        folder = self._views / camera
        if folder.is_dir():
            folder.rmdir()

    def findings(self, camera: str) -> dict[str, Any] | None:
        """Return what was last found in a camera's pictures; None: nothing was searched."""
        found = read_json(self._report_path(camera))
        return found if isinstance(found, dict) else None

    def measure_lens(
        self, camera: str, board: Sequence[str], save_as: str
    ) -> Callable[[ProgressReporter], str]:
        """Return work that looks for a board in all pictures and, with `save_as`, keeps the lens.

        Args:
            camera: Whose pictures.
            board: What was printed, as arguments of `scm eye calibrate`.
            save_as: Name of the calibration, unless it is taken by then; empty: only look.
        """

        def work(progress: ProgressReporter) -> str:
            paths = self.views(camera)
            if not paths:
                raise RunError(f"pictures of {camera}: expected some, got none")
            progress(f"looks for the board in {len(paths)} pictures")
            with tempfile.TemporaryDirectory() as folder:
                lens, report = Path(folder) / "lens.toml", Path(folder) / "report.json"
                words = ["calibrate", *map(str, paths), *board, "--report", str(report)]
                words += ["--out", str(lens)] if save_as else ["--look"]
                try:
                    _run(words, progress)
                finally:
                    if report.is_file():
                        self._report_path(camera).write_bytes(report.read_bytes())
                if not save_as:
                    return f"/api/v1/eye/cameras/{camera}/views"
                return self._keep(save_as, lens.read_text("utf-8"), report)

        return work

    def locate(
        self, camera: str, frame: bytes, lens: str, tags: Sequence[FloorTag], save_as: str
    ) -> Callable[[ProgressReporter], str]:
        """Return work that finds where a camera hangs from the tags in a frame, and keeps it.

        Args:
            camera: One of the map's.
            frame: A JPEG file.
            lens: Name of a saved lens; empty: the map's.
            tags: That lie on the floor beside the map's own.
            save_as: Name of the calibration, unless it is taken by then.
        """

        def work(progress: ProgressReporter) -> str:
            progress("looks for tags on the floor")
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                picture, report = folder / "frame.jpg", folder / "report.json"
                picture.write_bytes(frame)
                words = ["locate", str(picture), "--map", self._map_file, "--camera", camera]
                words += ["--report", str(report)]
                if lens:
                    words += ["--calibration", str(self.repository.path(lens))]
                if tags:
                    more = folder / "tags.toml"
                    more.write_text("\n".join(map(_tag_block, tags)), "utf-8")
                    words += ["--tags", str(more)]
                _run(words, progress)
                found = read_json(report)
                block = f"# The place of a camera, found by `scm eye locate`.\n{found['toml']}\n"
                return self._keep(save_as, block, report)

        return work

    def _keep(self, name: str, toml: str, report: Path) -> str:
        """Keep what was found; under the next free name where somebody took that one meanwhile."""
        with self.repository.editing:
            free = self.repository.free_name(name)
            self.repository.write(free, toml)
            self.repository.report_path(free).write_bytes(report.read_bytes())
        return f"/api/v1/eye/calibrations/{free}"

    def _report_path(self, camera: str) -> Path:
        return self._views / camera / "report.json"


def size_of(picture: bytes) -> tuple[int, int]:
    """Return width and height of a JPEG or PNG file [px], by its head alone.

    Raises:
        RefusedError: it is neither.
    """
    try:
        if picture.startswith(_PNG):
            width, height = struct.unpack_from(">II", picture, 16)
            return width, height
        if picture.startswith(_JPEG):
            return _jpeg_size(picture)
    except struct.error:
        pass
    raise RefusedError.of("invalid", "picture: expected a JPEG or PNG file, got something else")


def _jpeg_size(picture: bytes) -> tuple[int, int]:
    """Walk the segments of a JPEG file up to the one with its size."""
    at = 2
    while True:
        begin, marker, length = struct.unpack_from(">BBH", picture, at)
        if begin != 0xFF or length < 2:
            raise struct.error("no segment")
        if marker in _JPEG_SIZES:
            height, width = struct.unpack_from(">HH", picture, at + 5)
            return width, height
        at += 2 + length


def _tag_block(tag: FloorTag) -> str:
    numbers = (f"{name} = {getattr(tag, name)!r}" for name in FloorTag.__struct_fields__)
    return "\n".join(["[[tags]]", *numbers, ""])


def _run(words: Sequence[str], progress: ProgressReporter) -> None:
    """Run a command of the Eye until it ends, is called off, or takes too long.

    Raises:
        RunError: it failed; with its last words.
        Cancelled: it was called off.
    """
    with tempfile.TemporaryFile() as output:
        child = subprocess.Popen(
            with_parent([sys.executable, "-m", "scm", "eye", *words]),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=output,
        )
        try:
            status = _ended(child, progress)
        finally:
            if child.poll() is None:
                child.kill()
                child.wait()
        if status != 0:
            output.seek(0)
            text = output.read()[-_LAST_WORDS:].decode("utf-8", "replace").strip()
            raise RunError(text or f"scm eye {words[0]} ended with {status} and no word")


def _ended(child: "subprocess.Popen[bytes]", progress: ProgressReporter) -> int:
    for _ in range(round(LONGEST_S / LOOK_S)):
        try:
            return child.wait(LOOK_S)
        except subprocess.TimeoutExpired:
            if progress.cancelled.is_set():
                raise Cancelled from None
    raise RunError(f"expected an end within {LONGEST_S:.0f} s, got none")
