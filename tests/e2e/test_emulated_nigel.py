"""The emulated Nigel as a process: bytes on a serial port move what the Eye of a city sees.

No agent is there: the car shows a tag of its own, and the test is its host.
"""

import math
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import serial

from scm.parent_watch import with_parent
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.router import Router, free_endpoint
from tests.e2e.city_process import wait_for
from vehicle_agent.nigel.rosserial import REQUEST_TOPICS, Decoder, Frame, pack, pack_float

START_S = 90.0  # a cold start compiles the physics
BOOTED_S = 2.2
TAG = 9


class Stage:
    """A router in this process, world, Eye and emulated car as children, and an ear on the bus."""

    def __init__(self, endpoint: str, folder: Path) -> None:
        self.link = folder / "nigel"
        self.bus = ZenohBus("city", "test", endpoint)
        self.eye, self.truth = Mailbox(5000), Mailbox(5000)
        self.bus.subscribe(EyePose, {"vehicle": f"tag-{TAG}"}, self.eye)
        self.bus.subscribe(EmulatedPose, {"vehicle": "n7"}, self.truth)
        parts = [
            ["scm", part, "driving_school", "--connect", endpoint] for part in ("world", "eye")
        ]
        car = ["vehicle_agent", "emulate", "--link", str(self.link), "--connect", endpoint,
               "--name", "n7", "--tag", str(TAG), "--spawn", "a"]  # fmt: skip
        self.children = [self._start(command, subprocess.DEVNULL) for command in parts]
        self.children.append(self._start(car, subprocess.PIPE))
        self.lines: list[str] = []
        threading.Thread(target=self._read, daemon=True).start()

    def _start(self, command: list[str], out: int) -> subprocess.Popen[str]:
        call = with_parent([sys.executable, "-m", *command])
        return subprocess.Popen(call, stdout=out, stderr=subprocess.STDOUT, text=True)

    def _read(self) -> None:
        self.lines += (line.rstrip() for line in self.children[-1].stdout)

    def newest(self, box: Mailbox):
        """Return the newest that came since the last look."""
        items = box.drain()
        return items[-1].message if items else None

    def close(self) -> None:
        for child in self.children:
            child.send_signal(signal.SIGINT)
        for child in self.children:
            child.wait(timeout=10.0)
        self.bus.close()


@pytest.fixture
def stage(tmp_path):
    with Router(free_endpoint()) as router:
        made = Stage(router.listen, tmp_path)
        try:
            yield made
        finally:
            made.close()
    assert not made.link.is_symlink()
    made.children[-1].stdout.close()


def say(port, throttle, steering, seconds):
    """Command at 50 Hz."""
    until = time.monotonic() + seconds
    frames = pack(Frame(100, pack_float(steering))) + pack(Frame(101, pack_float(throttle)))
    while time.monotonic() < until:
        port.write(frames)
        time.sleep(0.02)


def gap(a, b):
    return math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)


def seen_and_true(stage):
    """Return the newest sighting and the truth nearest to it in time."""
    stage.eye.drain()
    seen = wait_for(lambda: stage.newest(stage.eye), 5.0, "the Eye sees the car")
    told = [item.message for item in stage.truth.drain()]
    return seen, min(told, key=lambda one: abs(one.t_ns - seen.t_ns))


def test_bytes_on_the_port_move_what_the_eye_sees(stage):
    start = wait_for(lambda: stage.newest(stage.eye), START_S, "the Eye sees the car")
    with serial.Serial(str(stage.link), 57600, timeout=0.5) as port:
        time.sleep(BOOTED_S)
        port.write(pack(REQUEST_TOPICS))
        assert [frame.topic for frame in Decoder().feed(port.read(220), 0)] == [10, 1, 1]
        say(port, 0.8, 0.3, 2.0)
        seen, true = seen_and_true(stage)
        assert 0.15 < gap(seen, start) < 0.4
        assert gap(seen, true) < 0.01
    time.sleep(0.5)  # nobody holds the port any more, and the car drives on
    later, _ = seen_and_true(stage)
    assert gap(later, seen) > 0.05
    with serial.Serial(str(stage.link), 57600):
        time.sleep(0.5)  # opening it resets the board
        stopped, _ = seen_and_true(stage)
        time.sleep(0.5)
        assert gap(seen_and_true(stage)[0], stopped) < 0.005
    said = [re.sub(r".* (host_\w+) .*", r"\1", line) for line in stage.lines if "host_" in line]
    assert said[:3] == ["host_opens_resets", "host_closes", "host_opens_resets"]
