"""The recordings of a folder: what each holds, what people wrote about it, and taking one away.

A recording is `<name>.mcap`; what people call it and note stands beside it in `<name>.notes.json`.
Indexes are stored, so that a list reads each file once, and of one that grows only what is new.
"""

import re
import threading
from collections import OrderedDict
from pathlib import Path

import msgspec

from scm.api.city import not_found
from scm.api.folders import written_ns
from scm.api.problem import RefusedError
from scm.clock import NS_PER_S, Clock, WallClock
from scm.errors import RecordingError
from scm.recorder.run_index import RunIndex, read_index
from scm.records.recordings import Notes, RecordingRow, State

NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,99}$"
SUFFIX, NOTES = ".mcap", ".notes.json"
QUIET_S = 3.0  # a recorder writes four times a second
MAX_INDEXES = 200
_CAR = re.compile(r"scm/@v\d+/[^/]+/v/([^/]+)/state")


class RecordingRepository:
    """One folder of recordings; safe from any thread.

    Attributes:
        editing: Held from reading notes to changing them: the second of two writers is refused.
    """

    def __init__(self, folder: Path | None, clock: Clock | None = None) -> None:
        self._folder, self._clock = folder, clock or WallClock()
        self.editing = threading.Lock()
        self._lock = threading.Lock()
        self._indexes: OrderedDict[str, RunIndex] = OrderedDict()

    def names(self) -> list[str]:
        """Return all recordings, the one that was written last first."""
        if self._folder is None or not self._folder.is_dir():
            return []
        files = [
            (written_ns(file), file.name.removesuffix(SUFFIX))
            for file in self._folder.glob(f"*{SUFFIX}")
            if re.fullmatch(NAME, file.name.removesuffix(SUFFIX))
        ]
        return [name for _, name in sorted(files, reverse=True)]

    def path(self, name: str) -> Path:
        """Return a recording's file.

        Raises:
            RefusedError: when there is none of that name.
        """
        if self._folder is not None and re.fullmatch(NAME, name):
            path = self._folder / f"{name}{SUFFIX}"
            if path.is_file():
                return path
        raise not_found("recording", name)

    def free_path(self, name: str) -> Path:
        """Return a file for a new recording; one of that name gets a number behind it.

        Raises:
            RefusedError: when this city keeps no recordings.
        """
        if self._folder is None:
            raise not_found("recording", name)
        ends = ("", *(f"-{number}" for number in range(2, 1000)))
        paths = (self._folder / f"{name}{end}{SUFFIX}" for end in ends)
        return next(path for path in paths if not path.exists())

    def index(self, name: str) -> RunIndex:
        """Return what a recording holds now.

        Raises:
            RefusedError: when there is none of that name, or it cannot be read.
        """
        path = self.path(name)
        with self._lock:
            known = self._indexes.get(name)
        try:
            found = read_index(path, known)
        except RecordingError as error:
            raise unreadable(error) from None
        with self._lock:
            self._indexes[name] = found
            self._indexes.move_to_end(name)
            while len(self._indexes) > MAX_INDEXES:
                self._indexes.popitem(last=False)
        return found

    def row(self, name: str) -> RecordingRow:
        """Return the row of one recording, also of one that cannot be read.

        Raises:
            RefusedError: when there is none of that name.
        """
        path, notes = self.path(name), self.notes(name)
        row = RecordingRow(
            name=name,
            title=notes.title,
            notes=notes.notes,
            state="unreadable",
            trouble="",
            begin_ns=None,
            length_s=0.0,
            size_bytes=path.stat().st_size,
            cars=(),
        )
        try:
            index = self.index(name)
        except RefusedError as error:
            return msgspec.structs.replace(row, trouble=error.refused.detail)
        state = self._state(index)
        return msgspec.structs.replace(
            row,
            state=state,
            trouble=_trouble(state, index),
            begin_ns=index.begin_ns or None,
            length_s=(index.end_ns - index.begin_ns) / NS_PER_S,
            cars=cars_of(index),
        )

    def notes(self, name: str) -> Notes:
        """Return the notes about a recording; empty: none."""
        path = self.path(name)
        try:
            return msgspec.json.decode(path.with_name(name + NOTES).read_bytes(), type=Notes)
        except (OSError, msgspec.MsgspecError):
            return Notes()

    def write_notes(self, name: str, notes: Notes) -> None:
        """Keep what somebody wrote about a recording.

        Raises:
            RefusedError: when there is no such recording, or its folder cannot be written.
        """
        beside = self.path(name).with_name(name + NOTES)
        fresh = beside.with_suffix(".part")
        try:
            fresh.write_bytes(msgspec.json.encode(notes))
            fresh.replace(beside)
        except OSError as cause:
            raise _not_written(beside, cause) from None

    def remove(self, name: str) -> None:
        """Delete a recording and what was written about it.

        Raises:
            RefusedError: when there is none, when it is being written, or may not be deleted.
        """
        path = self.path(name)
        if not self._is_quiet(path) and not self._is_whole(name):
            detail = f"{name} is being written: stop the recorder first"
            raise RefusedError.of("being_written", detail)
        try:
            path.unlink()
            path.with_name(name + NOTES).unlink(missing_ok=True)
        except OSError as cause:
            raise _not_written(path, cause) from None
        with self._lock:
            self._indexes.pop(name, None)

    def _is_whole(self, name: str) -> bool:
        try:
            return self.index(name).whole
        except RefusedError:
            return False

    def _state(self, index: RunIndex) -> State:
        if index.whole:
            return "complete"
        return "cut off" if self._is_quiet(index.path) else "being written"

    def _is_quiet(self, path: Path) -> bool:
        """Return whether a file has not been written for a while."""
        return self._clock.now_ns() - written_ns(path) > QUIET_S * NS_PER_S


def cars_of(index: RunIndex) -> tuple[str, ...]:
    """Return the cars that reported themselves: n2 before n10."""
    found = {match[1] for key in index.topics.values() if (match := _CAR.fullmatch(key))}
    return tuple(sorted(found, key=natural))


def natural(name: str) -> list[tuple[int, str]]:
    """Return what sorts n2 before n10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]


def unreadable(error: RecordingError) -> RefusedError:
    """Return the refusal for a recording that cannot be read; without the server's folders."""
    where, _, why = str(error).partition(": ")
    return RefusedError.of("unreadable", f"{Path(where).name}: {why}")


def _trouble(state: State, index: RunIndex) -> str:
    if state == "cut off":
        lost = index.size - index.read_to
        return (
            "its writer was killed before the end"
            f"{f'; the last {lost} bytes are no whole message' if lost else ''}. What is whole is "
            f"shown; `scm recover {index.path.name}` repairs it."
        )
    return "" if index.chunks else "nothing was recorded yet"


def _not_written(path: Path, cause: OSError) -> RefusedError:
    detail = f"{path.name}: cannot be changed: {cause.strerror or cause}"
    return RefusedError.of("not_written", detail)
