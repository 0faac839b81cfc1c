"""A process that runs cases one by one, and its owner's side, which ends one that hangs.

Whatever a case does to its process (it hangs, takes all memory, or dies) costs that case alone.
A process stays for the next case: map, cars and compiled physics are loaded once.
"""

import os
import signal
import subprocess
import sys
import threading
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue

import msgspec
import psutil

from scm.clock import WallClock, seconds
from scm.errors import StudyError
from scm.study.loaded_study import LoadedStudy, load
from scm.study.row import Outcome, Row
from scm.study.study_file import Value

LOOK_S = 0.25  # between two looks at a case's memory
START_S = 300.0  # a first start compiles physics
MB = 1e6
STUDY, OUTPUT = "study.toml", "output.log"
ONE_THREAD = {  # each core has a case of its own
    f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")
}


class Task(msgspec.Struct, frozen=True, kw_only=True):
    """One case to run.

    Attributes:
        values: Of its factors; None: as the design has them.
        record_to: File to record the city to; empty: none.
    """

    case: int
    values: dict[str, Value] | None = None
    record_to: str = ""


class Started(msgspec.Struct, frozen=True, kw_only=True):
    """The process is ready for its first case, or why it never will be."""

    problem: str = ""


class CaseProcess:
    """The owner's side.

    Args:
        study: What is run, loaded here too.
        folder: Of the study file, `study.toml`, and all that it names.

    Attributes:
        folder: The same.

    Raises:
        StudyError: when the process cannot load the study.
    """

    def __init__(self, study: LoadedStudy, folder: Path) -> None:
        self._study, self.folder = study, folder
        self._closing = threading.Lock()  # the thread of a case that was killed closes, too
        self._start()

    def run(self, task: Task) -> Row:
        """Run one case; one that outlives its limits, or its process, becomes a row that says so.

        Raises:
            StudyError: when a new process is needed and cannot load the study.
        """
        if self._process.poll() is not None:
            self._start()
        clock, study = WallClock(), self._study.file.study
        began_ns, base_b = clock.now_ns(), self._memory_b()
        try:
            self._to.send_bytes(msgspec.msgpack.encode(task))
            while not self._from.poll(LOOK_S):
                took_s = seconds(clock.now_ns() - began_ns)
                used_mb = (self._memory_b() - base_b) / MB
                if took_s > study.time_limit_s:
                    return self._ended(task, "time_limit", took_s, f"{study.time_limit_s:g} s")
                if used_mb > study.memory_limit_mb:
                    text = f"{used_mb:.0f} MB more than before, {study.memory_limit_mb:g} allowed"
                    return self._ended(task, "memory_limit", took_s, text)
            return msgspec.msgpack.decode(self._from.recv_bytes(), type=Row)
        except (EOFError, OSError):
            code = self._process.wait()
            took_s = seconds(clock.now_ns() - began_ns)
            return self._ended(task, "error", took_s, f"its process ended: {_ending(code)}")

    def memory_mb(self) -> float:
        """Return how much memory the process has now."""
        return self._memory_b() / MB

    def close(self) -> None:
        """End the process."""
        with self._closing:
            self._process.kill()
            self._process.wait()
            for end in (self._to, self._from):
                if not end.closed:
                    end.close()

    def _start(self) -> None:
        down_read, down_write = os.pipe()
        up_read, up_write = os.pipe()
        command = [sys.executable, "-m", "scm.study.case_process", str(down_read), str(up_write)]
        command += [str(self.folder), self._study.file.name]
        with (self.folder / OUTPUT).open("ab") as output:
            self._process = subprocess.Popen(
                command, pass_fds=(down_read, up_write), stdin=subprocess.DEVNULL,
                stdout=output, stderr=output, env={**os.environ, **ONE_THREAD},
            )  # fmt: skip
        os.close(down_read)
        os.close(up_write)
        self._to, self._from = Connection(down_write, readable=False), Connection(up_read)
        problem = "it did not start"
        if self._from.poll(START_S):
            try:
                problem = msgspec.msgpack.decode(self._from.recv_bytes(), type=Started).problem
            except EOFError:
                problem = f"it ended: {_ending(self._process.wait())}"
        if problem:
            self.close()
            raise StudyError(f"a process for cases of {self._study.file.name}: {problem}")

    def _memory_b(self) -> int:
        try:
            return int(psutil.Process(self._process.pid).memory_info().rss)
        except psutil.Error:
            return 0

    def _ended(self, task: Task, outcome: Outcome, took_s: float, detail: str) -> Row:
        """Return the row of a case whose process is gone, or has to go."""
        self.close()
        return self._study.row(task.case, task.values, outcome, took_s, detail)


def _ending(code: int) -> str:
    return f"signal {-code}" if code < 0 else f"exit status {code}"


class CaseProcesses:
    """The case processes of one study; each is used by one thread at a time.

    Attributes:
        folder: Of the study file, and all that it names.
    """

    def __init__(self, study: LoadedStudy, folder: Path) -> None:
        self._study, self.folder = study, folder
        self._idle: list[CaseProcess] = []
        self._all: list[CaseProcess] = []
        self._lock = threading.Lock()

    def run(self, task: Task) -> Row:
        """Run one case in a process that is free, or a new one."""
        with self._lock:
            process = self._idle.pop() if self._idle else None
        if process is None:
            process = CaseProcess(self._study, self.folder)
            with self._lock:
                self._all.append(process)
        try:
            return process.run(task)
        finally:
            with self._lock:
                self._idle.append(process)

    def close(self) -> None:
        """End all processes."""
        for process in self._all:
            process.close()


def main(arguments: list[str]) -> None:
    """Run cases until the owner is gone.

    A scheduler that ends a job sends SIGTERM to all its processes. It is no case's fault: the owner
    decides, and the case ends with it.
    """
    signal.signal(signal.SIGTERM, lambda *_: None)  # not SIG_IGN: a case's children inherit that
    down, up, folder, name = arguments
    to_owner = Connection(int(up), readable=False)
    tasks: SimpleQueue[Task] = SimpleQueue()
    threading.Thread(
        target=_receive, args=(Connection(int(down), writable=False), tasks), daemon=True
    ).start()
    try:
        study = load(Path(folder) / STUDY, name)
    except Exception as cause:  # noqa: BLE001  the owner says what is wrong
        to_owner.send_bytes(msgspec.msgpack.encode(Started(problem=str(cause))))
        return
    to_owner.send_bytes(msgspec.msgpack.encode(Started()))
    while True:
        task = tasks.get()
        to_owner.send_bytes(msgspec.msgpack.encode(_run(study, task)))


def _receive(from_owner: Connection, tasks: "SimpleQueue[Task]") -> None:
    """Queue what the owner sends; end this process, whatever it is doing, when he is gone."""
    try:
        while True:
            tasks.put(msgspec.msgpack.decode(from_owner.recv_bytes(), type=Task))
    finally:
        os._exit(0)


def _run(study: LoadedStudy, task: Task) -> Row:
    if not task.record_to:
        return study.run(task.case, task.values)
    from scm.study.recorded import recorded_lockstep  # noqa: PLC0415  few cases are recorded

    return study.run(task.case, task.values, recorded_lockstep(Path(task.record_to)))


if __name__ == "__main__":
    main(sys.argv[1:])
