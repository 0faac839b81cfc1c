"""Recordings that people send: a zip of a folder with its `recording.yaml`, or of a city's run.

Nothing in it is trusted: only tables are let in, and they may name no file outside and no car but
those that the city knows, for a car file may bring laws of its own.
"""

import re
import secrets
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path, PurePosixPath
from typing import BinaryIO

import msgspec

from scm.api.problem import DISK_TROUBLE, RefusedError
from scm.api.upload_reader import MOST_READING_BYTES, MOST_READING_S, Read
from scm.recording.description import FILE_NAME
from scm.recording.table import KINDS
from scm.records.mismatch import Upload
from scm.runtime.parent_watch import with_parent

FOLDER = "uploads"
MOST_BYTES = 64 * 2**20
MOST_UNPACKED_BYTES = 512 * 2**20
MOST_FILES = 200
MOST_ENTRIES = 10 * MOST_FILES  # folders and what is left out among them
MOST_DESCRIPTION_BYTES = 256 * 1024
PATIENCE_S = 120.0  # on a busy computer
MAX_UPLOADS = 20
ID = r"^[a-z0-9][a-z0-9_-]{0,63}$"
_CHUNK = 2**20
_RUN = ".mcap"
_ENTRY = b"PK\x01\x02"  # begins each entry of a zip's list of contents


def store(reports: Path, body: BinaryIO, name: str, cars: tuple[str, ...]) -> Upload:
    """Unpack a recording below a folder and return what it is.

    Args:
        reports: Folder of reports: uploads lie in a folder of it.
        body: The zip, wherever it was read to.
        name: What the sender calls it: the id begins with it.
        cars: Names of the car files that it may use.

    Raises:
        RefusedError: when it is no such zip, too large, or refers to a path outside.
    """
    stem = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:40] or "upload"
    upload = f"{stem}-{secrets.token_hex(4)}"
    folder = reports / FOLDER / upload
    folder.mkdir(parents=True)
    try:
        size = _unpack(body, folder)
        _lift(folder)
        vehicles = _check(folder, cars)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    _forget(reports / FOLDER)
    files = sum(path.is_file() for path in folder.rglob("*"))
    return Upload(upload=upload, files=files, size_bytes=size, vehicles=vehicles)


def recording_in(folder: Path) -> Path:
    """Return what `scm mismatch` is to be given of an upload's folder."""
    run = next(iter(sorted(folder.glob("*" + _RUN))), None)
    return folder if (folder / FILE_NAME).is_file() or run is None else run


def _unpack(body: BinaryIO, folder: Path) -> int:
    entries = _entries(body)
    if entries > MOST_ENTRIES:  # to read such a list alone takes seconds and a lot of memory
        raise _refused(f"entries: got {entries}, expected at most {MOST_ENTRIES}")
    try:
        with zipfile.ZipFile(body) as packed:
            left = MOST_UNPACKED_BYTES
            for info in _files_of(packed):
                left -= _unpack_one(packed, info, folder, left)
            return MOST_UNPACKED_BYTES - left
    except RefusedError:
        raise
    except Exception as cause:  # whatever a library makes of a damaged zip
        if isinstance(cause, OSError) and cause.errno in DISK_TROUBLE:
            raise
        why = cause.strerror if isinstance(cause, OSError) else cause  # without our folders
        raise _refused(f"the zip cannot be read: {why}") from cause


def _entries(body: BinaryIO) -> int:
    """Return how many entries a zip may list."""
    count, edge = 0, b""
    body.seek(0)
    while chunk := body.read(_CHUNK):
        count += (edge + chunk).count(_ENTRY)
        edge = (edge + chunk)[1 - len(_ENTRY) :]
    return count


def _files_of(packed: zipfile.ZipFile) -> list[zipfile.ZipInfo]:
    infos = [info for info in packed.infolist() if not info.is_dir()]
    if len(infos) > MOST_FILES:
        raise _refused(f"files: got {len(infos)}, expected at most {MOST_FILES}")
    return infos


def _unpack_one(packed: zipfile.ZipFile, info: zipfile.ZipInfo, folder: Path, left: int) -> int:
    """Write one file; return its size, the real one, not that of the zip's header."""
    inner = PurePosixPath(info.filename.replace("\\", "/"))
    if inner.is_absolute() or ".." in inner.parts or len(inner.parts) > 6:
        raise _refused(f"{info.filename!r}: expected a path inside the recording's folder")
    known = inner.name.lower().endswith((*KINDS, ".yaml", ".msg"))
    if not known:
        return 0
    path, size = folder.joinpath(*inner.parts), 0
    path.parent.mkdir(parents=True, exist_ok=True)
    with packed.open(info) as source, path.open("wb") as target:
        while chunk := source.read(_CHUNK):
            size += len(chunk)
            if size > left:
                most = MOST_UNPACKED_BYTES // 2**20
                raise _refused(f"unpacked: more than {most} MiB; send a part of the recording")
            target.write(chunk)
    return size


def _lift(folder: Path) -> None:
    """Take a recording out of the one folder that a zip often has around it."""
    inside = list(folder.iterdir())
    if len(inside) == 1 and inside[0].is_dir():
        for path in list(inside[0].iterdir()):
            path.rename(folder / path.name)
        if not any(inside[0].iterdir()):
            inside[0].rmdir()


def _check(folder: Path, cars: tuple[str, ...]) -> tuple[str, ...]:
    """Return the cars that a recording names, once it names nothing that lies outside.

    Its description is read by a process of its own: whatever it makes of our reader, the server
    goes on answering, and its time and memory are limited.
    """
    description = folder / FILE_NAME
    if not description.is_file():
        if len(list(folder.glob("*" + _RUN))) == 1:
            return ()
        raise _refused(f"no {FILE_NAME} in it, and no {_RUN} of a city: expected one of them")
    size = description.stat().st_size
    if size > MOST_DESCRIPTION_BYTES:
        most = MOST_DESCRIPTION_BYTES // 1024
        raise _refused(f"{FILE_NAME}: got {size // 1024} KiB, expected at most {most} KiB")
    words = [str(MOST_READING_S), str(folder), *cars]
    program = with_parent([sys.executable, "-m", "scm.api.upload_reader", *words])
    reading = subprocess.run(
        program, stdin=subprocess.DEVNULL, capture_output=True, check=False, timeout=PATIENCE_S
    )
    if reading.returncode != 0:
        limits = f"{MOST_READING_S} s and {MOST_READING_BYTES // 2**20} MiB"
        raise _refused(f"{FILE_NAME}: to read it takes more than {limits}: send a simpler one")
    read = msgspec.json.decode(reading.stdout, type=Read)
    if read.refusal:
        raise _refused(read.refusal)
    return read.vehicles


def _forget(folder: Path) -> None:
    """Remove the oldest uploads beyond the number stored."""
    there = sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime_ns)
    for old in there[: max(0, len(there) - MAX_UPLOADS)]:
        shutil.rmtree(old, ignore_errors=True)


def _refused(detail: str) -> RefusedError:
    return RefusedError.of("invalid", f"upload: {detail}")
