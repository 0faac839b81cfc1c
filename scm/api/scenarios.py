"""Fleet scenarios: Python scripts of a folder, and running one beside the live city.

A script is a program with all rights of the server: who may write one may do anything there. It
gets the city's address in `SCM_CONNECT` and by `{connect}` among its arguments, and who it is
there in `SCM_CREDENTIALS`, which `scm.fleet.open_city` reads. Where the web interface requires
keys it is lent one while it runs, in the file that `SCM_API_KEY_FILE` names, which `scm.client`
heeds: with it a script may do what who runs it may.
"""

import os
import re
import signal
import subprocess
import sys
import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import IO

import msgspec

import scm
from scm.api.city import not_found
from scm.api.keys import KeyRing
from scm.api.operations import Cancelled, Operations, ProgressReporter
from scm.api.problem import RefusedError
from scm.errors import ScmError
from scm.records.operations import Operation
from scm.records.scenarios import Lines, Scenario

NAME = r"^[A-Za-z][A-Za-z0-9_-]{0,59}$"
MAX_LINES, MAX_RUNS, LINE_CHARACTERS = 2000, 50, 2000
LOOK_S, GRACE_S = 0.1, 8.0
SHIPPED = Path(scm.__file__).parents[1] / "examples"
KIND = "scenario"
_CONNECT = "{connect}"
_LAUNCH = """
import runpy, signal, sys
from pathlib import Path
signal.signal(signal.SIGINT, signal.default_int_handler)  # ours may have been started without
sys.argv = sys.argv[1:]
sys.path[0] = str(Path(sys.argv[0]).parent)
runpy.run_path(sys.argv[0], run_name="__main__")
"""


class ScenarioRepository:
    """The scripts of a folder, and those that came with the program.

    Attributes:
        editing: Held from reading one to changing it: the second of two writers is refused.
    """

    def __init__(self, folder: Path | None, shipped: Path = SHIPPED) -> None:
        self._folder, self._shipped = folder, shipped
        self.editing = threading.Lock()

    def rows(self) -> tuple[Scenario, ...]:
        """Return all scripts without their texts; people's own first."""
        found: dict[str, Scenario] = {}
        for folder in (self._folder, self._shipped):
            if folder is None or not folder.is_dir():
                continue
            for file in sorted(folder.glob("*.py")):
                if re.fullmatch(NAME, file.stem) and file.stem not in found:
                    with suppress(FileNotFoundError):  # somebody deletes it at this moment
                        row = self._read(file)
                        found[file.stem] = msgspec.structs.replace(row, text="")
        return tuple(found.values())

    def find(self, name: str) -> Scenario | None:
        """Return a script, None where there is none of that name."""
        file = self._file(name)
        return self._read(file) if file is not None else None

    def path(self, name: str) -> Path:
        """Return a script's file.

        Raises:
            RefusedError: when there is none of that name.
        """
        file = self._file(name)
        if file is None:
            raise not_found("scenario", name)
        return file

    def write(self, name: str, text: str) -> Scenario:
        """Keep a script.

        Raises:
            RefusedError: when it is no Python, it came with the program, or nothing can be stored.
        """
        self._check_own(name)
        try:
            compile(text, f"{name}.py", "exec", dont_inherit=True)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            line = f", line {error.lineno}" if isinstance(error, SyntaxError) else ""
            text = error.msg if isinstance(error, SyntaxError) else str(error)
            detail = f"{name}.py{line}: expected a Python script: {text}"
            raise RefusedError.of("invalid", detail) from None
        assert self._folder is not None  # noqa: S101  or it would not be one's own
        file = self._folder / f"{name}.py"
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            fresh = file.with_suffix(".part")
            fresh.write_text(text, "utf-8")
            fresh.replace(file)
        except OSError as cause:
            raise _not_written(name, cause) from None
        return self._read(file)

    def remove(self, name: str) -> None:
        """Delete a script.

        Raises:
            RefusedError: when there is none of that name, or it came with the program.
        """
        path = self.path(name)
        self._check_own(name)
        try:
            path.unlink()
        except OSError as cause:
            raise _not_written(name, cause) from None

    def _check_own(self, name: str) -> None:
        if self._folder is None:
            detail = "this city keeps no scenarios: start it with a folder (scm api --data FOLDER)"
            raise RefusedError.of("not_kept", detail)
        found = self.find(name)
        if found is not None and found.shipped:
            detail = f"{name} came with the program: save it under another name"
            raise RefusedError.of("shipped", detail)

    def _file(self, name: str) -> Path | None:
        if not re.fullmatch(NAME, name):
            return None
        folders = (folder for folder in (self._folder, self._shipped) if folder is not None)
        files = (folder / f"{name}.py" for folder in folders)
        return next((file for file in files if file.is_file()), None)

    def _read(self, file: Path) -> Scenario:
        text = file.read_text("utf-8", "replace")
        about = re.match(r'\s*(?:#.*\n|\s)*r?"""(.+?)(?:\n|""")', text)
        return Scenario(
            name=file.stem,
            about=about[1].strip() if about else "",
            shipped=file.parent == self._shipped,
            text=text,
        )


class ScenarioRuns:
    """Scripts that run or ran: each an operation, with what it printed."""

    def __init__(
        self,
        repository: ScenarioRepository,
        work: Operations,
        connect: str,
        credentials: Path | None,
        keys: KeyRing | None,
    ) -> None:
        self._repository, self._work, self._connect, self._keys = repository, work, connect, keys
        self._environment = {"SCM_CONNECT": connect, "PYTHONUNBUFFERED": "1"}
        if credentials is not None:
            self._environment["SCM_CREDENTIALS"] = str(credentials.absolute())
        self._lock = threading.Lock()
        self._printed: OrderedDict[str, _Printed] = OrderedDict()

    def start(self, name: str, arguments: Sequence[str], *, owner: str, key: str = "") -> Operation:
        """Run a script.

        Args:
            name: Of the script.
            arguments: Of its command line.
            owner: Who requested it.
            key: Their API key, on behalf of which the script is lent one; empty: the city has none.

        Raises:
            RefusedError: when there is none of that name, or too many wait.
        """
        path = self._repository.path(name)
        with self._lock:
            printed = _Printed()
            filled = [one.replace(_CONNECT, self._connect) for one in arguments]

            def work(progress: ProgressReporter) -> str:
                with self._lent(key, name) as environment:
                    return self._run(path, filled, printed, progress, environment)

            row = self._work.start(KIND, name, work, owner=owner)
            printed.run = row.id
            self._printed[row.id] = printed
            while len(self._printed) > MAX_RUNS:
                self._printed.popitem(last=False)
        return row

    def lines(self, run: str, after: int) -> Lines:
        """Return what a run printed, from line `after` on.

        Raises:
            RefusedError: when there was no such run, or it is forgotten.
        """
        with self._lock:
            printed = self._printed.get(run)
        if printed is None:
            raise not_found("run of a scenario", run)
        return printed.after(after)

    @contextmanager
    def _lent(self, key: str, name: str) -> Iterator[dict[str, str]]:
        """Lend a script an API key while it runs; yield the arguments and environment for it."""
        if self._keys is None:
            yield {}
            return
        lent = self._keys.lend(key, name)
        try:
            with NamedTemporaryFile("w", prefix="scm-key-") as file:  # only its owner reads it
                file.write(lent)
                file.flush()
                yield {"SCM_API_KEY_FILE": file.name}
        finally:
            self._keys.end_lent(lent)

    def _run(
        self,
        path: Path,
        arguments: list[str],
        printed: "_Printed",
        progress: ProgressReporter,
        environment: Mapping[str, str],
    ) -> str:
        try:
            process = subprocess.Popen(
                [sys.executable, "-c", _LAUNCH, str(path), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                env={**os.environ, **self._environment, **environment},
                start_new_session=True,
            )
        except OSError as cause:
            msg = f"{path.name}: cannot be started: {cause.strerror or cause}"
            raise ScmError(msg) from cause
        assert process.stdout is not None  # noqa: S101  it was requested
        reader = threading.Thread(target=printed.read, args=(process.stdout,), daemon=True)
        reader.start()
        try:
            while process.poll() is None:
                progress(printed.last() or "runs")
                progress.cancelled.wait(LOOK_S)
        except Cancelled:
            _end(process)
            raise
        finally:
            reader.join(GRACE_S)
        if process.returncode:
            why = printed.last() or "it printed nothing"
            msg = f"{path.name} ended with exit code {process.returncode}: {why}"
            raise ScmError(msg)
        return f"/recordings/scenarios?run={printed.run}"


class _Printed:
    """The last lines that a run printed."""

    def __init__(self) -> None:
        self.run = ""
        self._lock = threading.Lock()
        self._first = 0
        self._lines: list[str] = []

    def read(self, stream: IO[str]) -> None:
        """Take lines until the program ends."""
        with stream:
            while line := stream.readline(LINE_CHARACTERS):
                with self._lock:
                    self._lines.append(line.rstrip("\n"))
                    if len(self._lines) > MAX_LINES:
                        del self._lines[0]
                        self._first += 1

    def last(self) -> str:
        """Return the last line that is not empty."""
        with self._lock:
            return next((line for line in reversed(self._lines) if line.strip()), "")[:200]

    def after(self, number: int) -> Lines:
        """Return the lines from a number on."""
        with self._lock:
            first = max(number, self._first)
            return Lines(run=self.run, first=first, lines=tuple(self._lines[first - self._first :]))


def _end(process: "subprocess.Popen[str]") -> None:
    """Press Ctrl-C, so that the script takes its cars away; kill what does not listen."""
    for number, patience_s in ((signal.SIGINT, GRACE_S), (signal.SIGKILL, GRACE_S)):
        try:
            os.killpg(process.pid, number)
            process.wait(patience_s)
        except ProcessLookupError:
            return
        except subprocess.TimeoutExpired:
            continue
        else:
            return


def _not_written(name: str, cause: OSError) -> RefusedError:
    detail = f"{name}.py: cannot be changed: {cause.strerror or cause}"
    return RefusedError.of("not_written", detail)
