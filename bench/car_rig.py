"""A city, an Eye that sees one car stand, its agent, and a device whose motor is watched.

The car's pose never changes, so its driver wants to go on for ever; who looks at the motor sees
when it no longer may. Both firmwares are asked for the motor's PWM as they themselves give it.
"""

import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from scm.clock import WallClock
from scm.maps.load import load_map
from scm.runtime.parent_watch import with_parent
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.mailbox import Mailbox
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.part_status import PartStatus
from vehicle_agent.emulate.part import place_of

ROOT = Path(__file__).resolve().parents[1]
FIRMWARE = ROOT / "vehicle_agent" / "firmware"
EYE_S = 0.05
"""As the Eye tells: 20 times a second."""
SURE = tuple(tuple(1e-6 * (row == column) for column in range(6)) for row in range(6))
POSE_AGE_S = 0.02
DRIVES_S = 0.4
"""For so long the motor must have run before anything is done to it."""
START_S, DRIVES_LATEST_S = 60.0, 20.0


class ReadProcess:
    """A process whose lines are read as they come.

    Attributes:
        lines: (monotonic time it came [ns], text).
    """

    def __init__(self, *command: str, plain: bool = False) -> None:
        whole = list(command) if plain else [sys.executable, "-m", *command]
        self.lines: list[tuple[int, str]] = []
        self.process = subprocess.Popen(
            with_parent(whole), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, bufsize=1, cwd=ROOT,
        )  # fmt: skip
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        return self.process.pid

    def _read(self) -> None:
        for line in self.process.stdout or ():
            self.lines.append((time.monotonic_ns(), line.strip()))

    def mentioned_ns(self, word: str, since_ns: int) -> int | None:
        """Return when a watched process says that something was, after `since_ns`."""
        for _, line in list(self.lines):
            name, _, stamp = line.rpartition(" ")
            if name == word and int(stamp) >= since_ns:
                return int(stamp)
        return None

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join(5.0)


class Motor(ReadProcess):
    """A device at the end of the cable, and when its motor's PWM changed."""

    def changes(self) -> list[tuple[int, int]]:
        """Return (monotonic time [ns], PWM), oldest first."""
        found = ((t, re.search(r"\bpwm (\d+)", line, re.IGNORECASE)) for t, line in self.lines)
        return [(t, int(match[1])) for t, match in found if match]

    def pwm(self) -> int:
        """Return its last command."""
        return next((pwm for _, pwm in reversed(self.changes())), 0)

    def runs(self) -> bool:
        """Return whether it has run for a while without a stop."""
        seen = self.changes()
        rests = [t for t, pwm in seen if pwm == 0]
        began = next((t for t, pwm in seen if pwm and t > max(rests, default=0)), None)
        return began is not None and time.monotonic_ns() - began > DRIVES_S * 1e9

    def stopped(self, since_ns: int) -> int | None:
        """Return when it first stopped after an instant; None: not yet."""
        return next((t for t, pwm in self.changes() if t >= since_ns and pwm == 0), None)


def published(link: Path, *faults: str) -> Motor:
    """Return the published firmware, emulated."""
    words = ("--faults", *faults) if faults else ()
    return Motor("vehicle_agent", "emulate", "--link", str(link), *words)


def ours(link: Path) -> Motor:
    """Return our firmware on a simulated chip."""
    subprocess.run(["make", "-s", "-C", str(FIRMWARE), "all", "board"], check=True)
    build = FIRMWARE / "build"
    return Motor(str(build / "board"), str(build / "firmware.hex"), "--pty", str(link), plain=True)


FIRMWARES: dict[str, Callable[..., Motor]] = {"published": published, "ours": ours}


class FixedEye:
    """An Eye that sees one car, always at the same place, while `is_open`."""

    def __init__(self, endpoint: str, map_name: str) -> None:
        self.is_open, self.vehicle = True, ""
        self.bus = ZenohBus("city", "bench", endpoint)
        self.statuses = Mailbox(200)
        self.bus.subscribe(PartStatus, {}, self.statuses)
        self._pose = place_of(load_map(map_name), "")
        self._end, self._clock = threading.Event(), WallClock()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._thread.start()

    def _look(self) -> None:
        while not self._end.wait(EYE_S):
            if self.is_open and self.vehicle:
                self.bus.publish(self._track())

    def _track(self) -> EyeTrack:
        x, y, yaw = self._pose
        return EyeTrack(
            vehicle=self.vehicle, tag_id=1, t_ns=self._clock.now_ns(), x_m=x, y_m=y, yaw_rad=yaw,
            speed_mps=0.0, lateral_speed_mps=0.0, yaw_rate_radps=0.0, covariance=SURE,
            age_s=POSE_AGE_S, stale=False,
        )  # fmt: skip

    def close(self) -> None:
        self._end.set()
        self._thread.join(5.0)
        self.bus.close()


def wait_for(condition: Callable[[], object], span_s: float) -> bool:
    """Return whether it came true in time."""
    end = time.monotonic() + span_s
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.005)
    return True


class Rig:
    """One car with its device; a new agent whenever the last one was ended."""

    def __init__(self, endpoint: str, eye: FixedEye, motor: Motor, link: Path) -> None:
        self.endpoint, self.eye, self.motor = endpoint, eye, motor
        self.agents = ReadProcess("bench.watched_agent")
        self.agent: int | None = None
        self._link, self._number, self._in_vain = link, 0, False

    def drive(self) -> int:
        """Have the motor run, by a new agent where there is none; return its process number."""
        self.eye.is_open = True
        if self.agent is None or not Path(f"/proc/{self.agent}").exists():
            self._number += 1
            runs_on, began_ns = self.motor.pwm() > 0, time.monotonic_ns()
            self.eye.vehicle = f"k{time.monotonic_ns() % 10**6}-{self._number}"
            self.agent = self._new_agent(
                f"join --name {self.eye.vehicle} --connect {self.endpoint} --serial {self._link}"
            )
            if runs_on:  # as the last agent left it, until the port is opened
                wait_for(lambda: self.motor.stopped(began_ns), START_S)
        if not wait_for(self.motor.runs, DRIVES_LATEST_S):
            lines = [line for _, line in (*self.agents.lines[-20:], *self.motor.lines[-5:])]
            lines += [repr(item.message) for item in self.eye.statuses.drain()[-8:]]
            print("the car does not drive:", *lines, sep="\n", file=sys.stderr, flush=True)
            if self._in_vain:
                raise SystemExit(1)
            self._in_vain = True
            self.end_agent()
            return self.drive()
        self._in_vain = False
        return self.agent

    def watchdog(self) -> int:
        """Return the process number of the agent's watchdog."""
        agent = self.drive()
        children = Path(f"/proc/{agent}/task/{agent}/children").read_text().split()
        return int(children[-1])

    def end_agent(self) -> None:
        if self.agent is not None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.agent, signal.SIGKILL)
            self.agent = None

    def _new_agent(self, arguments: str) -> int:
        def numbers() -> list[int]:
            lines = [line for _, line in list(self.agents.lines)]
            return [int(line.split()[1]) for line in lines if line.startswith("agent ")]

        before = len(numbers())
        print(arguments, file=self.agents.process.stdin, flush=True)
        wait_for(lambda: len(numbers()) > before, START_S)
        return numbers()[-1]


@contextlib.contextmanager
def rig(endpoint: str, map_name: str, device: Callable[[Path], Motor]) -> Iterator[Rig]:
    """Yield a car whose cable leads to a device of its own."""
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder) / "nigel"
        motor, eye = device(link), FixedEye(endpoint, map_name)
        made = Rig(endpoint, eye, motor, link)
        try:
            wait_for(link.is_symlink, START_S)
            yield made
        finally:
            made.end_agent()
            made.agents.end()
            eye.close()
            motor.end()
