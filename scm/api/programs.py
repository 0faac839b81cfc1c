"""Long work that is another program of ours: started, listened to, ended when it is called off.

What is heavy or holds the interpreter never runs beside the server: it is a process of its own,
kinder to others than the city is.
"""

import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Sequence
from queue import Empty, SimpleQueue

from scm.api.operations import ProgressReporter
from scm.errors import RunError
from scm.runtime.parent_watch import with_parent
from scm.runtime.priority import stand_back

LOOK_S = 0.2
GRACE_S = 8.0
MAX_LINES = 40
OnLine = Callable[[str], None]


def run_scm(
    words: Sequence[str],
    progress: ProgressReporter | None,
    on_line: OnLine,
    *,
    kinder: bool = True,
) -> list[str]:
    """Run `scm WORDS` to its end and return its last lines.

    Args:
        words: Command and arguments.
        progress: Of the operation; when it is cancelled, the program is requested to end. None:
            it belongs to none.
        on_line: Receives every line, on this thread.
        kinder: Whether the city's parts go first.

    Raises:
        Cancelled: when the work was called off.
        RunError: when the program failed, in its own words.
    """
    command = with_parent([sys.executable, "-m", "scm", *words])
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, errors="replace", start_new_session=True,
    )  # fmt: skip
    if kinder:
        stand_back(process.pid)
    lines: SimpleQueue[str | None] = SimpleQueue()
    reader = threading.Thread(target=_read, args=(process, lines), daemon=True)
    reader.start()
    try:
        last = _follow(lines, progress, on_line)
    finally:
        _end(process)
        reader.join(GRACE_S)
    if process.returncode != 0:
        msg = "\n".join(last).strip() or f"it ended with code {process.returncode}"
        raise RunError(_failure(msg))
    return last


def _read(process: "subprocess.Popen[str]", lines: "SimpleQueue[str | None]") -> None:
    if process.stdout is not None:
        with process.stdout:
            for line in process.stdout:
                lines.put(line.rstrip())
    lines.put(None)


def _follow(
    lines: "SimpleQueue[str | None]", progress: ProgressReporter | None, on_line: OnLine
) -> list[str]:
    """Pass lines on until there are no more; raise when the work was called off."""
    last: deque[str] = deque(maxlen=MAX_LINES)
    while True:
        if progress is not None:
            progress.check()
        try:
            line = lines.get(timeout=LOOK_S)
        except Empty:
            continue
        if line is None:
            return list(last)
        last.append(line)
        on_line(line)


def _end(process: "subprocess.Popen[str]") -> None:
    """Request the program to end, and make sure that it does."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            process.kill()
    process.wait()


def _failure(output: str) -> str:
    """Return a program's message of its failure: from its `scm ...:` on, or the last line."""
    lines = output.splitlines()
    begin = next((i for i, line in enumerate(lines) if line.startswith("scm ")), len(lines) - 1)
    return " ".join(lines[begin:])
