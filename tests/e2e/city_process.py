"""A whole city as a child process, started as a user would, watched through its web address."""

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from scm.runtime.parent_watch import with_parent

START_S = 180.0  # a cold start compiles the physics


def wait_for(
    condition: Callable[[], Any], timeout_s: float, what: str, every_s: float = 0.05
) -> Any:
    """Return the first true value of a condition; fail with words when it does not come."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        value = condition()
        if value:
            return value
        time.sleep(every_s)
    msg = f"not within {timeout_s:g} s: {what}"
    raise AssertionError(msg)


class CityProcess:
    """`scm up` on free ports."""

    def __init__(self, folder: Path, *arguments: str, city_map: str = "driving_school") -> None:
        command = [sys.executable, "-m", "scm", "up", city_map, "--port", "0"]
        command += ["--listen", "tcp/127.0.0.1:0", "--record-dir", str(folder), *arguments]
        self.folder = folder
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            with_parent(command),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        self.url = str(self._said(r"dashboard: (http://\S+)"))
        self.endpoint = str(self._said(r"(tcp/127\.0\.0\.1:\d+)"))
        self.web = httpx.Client(base_url=self.url + "/api/v1", timeout=60.0)

    def get(self, path: str) -> Any:
        """Return the JSON of a resource."""
        answer = self.web.get(path)
        answer.raise_for_status()
        return answer.json()

    def stop(self) -> float:
        """Press Ctrl-C; return how long the city took to end [s]."""
        began = time.monotonic()
        self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=60.0)
        return time.monotonic() - began

    def pid(self, name: str) -> int:
        """Return the process id of a part or agent, as last told."""
        found = (re.fullmatch(rf" *{name} .* pid (\d+)", line) for line in self.lines)
        return [int(match.group(1)) for match in found if match][-1]

    def kill(self, name: str) -> None:
        """Kill a part, and wait until it is back."""
        before = self.pid(name)
        os.kill(before, signal.SIGKILL)
        wait_for(lambda: self.pid(name) != before, 90.0, f"{name} is back")

    @contextmanager
    def frozen(self, name: str) -> Iterator[None]:
        """Keep a part from running."""
        os.kill(self.pid(name), signal.SIGSTOP)
        try:
            yield
        finally:
            os.kill(self.pid(name), signal.SIGCONT)

    def descendants(self) -> set[int]:
        """Return the process ids of everything the city started and that still runs."""
        return {pid for pid in _pids() if _is_below(pid, self.process.pid)}

    def close(self) -> None:
        """Make sure that nothing is left, whatever the test did."""
        self.web.close()
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait(timeout=60.0)
        self._reader.join(timeout=60.0)
        if self.process.stdout is not None:
            self.process.stdout.close()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip())

    def _said(self, pattern: str) -> str:
        def look() -> str | None:
            if self.process.poll() is not None:
                raise AssertionError("the city ended at once:\n" + "\n".join(self.lines))
            found = (re.search(pattern, line) for line in self.lines)
            return next((match.group(1) for match in found if match), None)

        try:
            return str(wait_for(look, START_S, f"the city says {pattern!r}"))
        except AssertionError:
            self.close_quietly()
            raise AssertionError("\n".join(self.lines)) from None

    def close_quietly(self) -> None:
        """Kill everything, without a web client yet."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait(timeout=60.0)


@contextmanager
def city(folder: Path, *arguments: str, city_map: str = "driving_school") -> Iterator[CityProcess]:
    """Run a city for a test, of a map's name or file."""
    process = CityProcess(folder, *arguments, city_map=city_map)
    try:
        yield process
    finally:
        process.close()


def _pids() -> list[int]:
    return [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]


def _is_below(pid: int, ancestor: int) -> bool:
    while pid > 1:
        try:
            stat = Path(f"/proc/{pid}/stat").read_text()
        except OSError:
            return False
        state, parent = stat.rpartition(")")[2].split()[:2]
        if state == "Z":
            return False
        pid = int(parent)
        if pid == ancestor:
            return True
    return False
