"""The emulated Nigel as a process: bytes on a serial port move what the Eye of a city sees.

No agent is there: the car shows a tag of its own, and the test is its host.
"""

import math
import re
import signal
import subprocess
import threading
import time
from typing import Any

import pytest
import serial

from scm.v2x.bus import Mailbox
from scm.v2x.messages.eye_pose import EyePose
from tests.e2e.city_process import START_S, wait_for
from tests.e2e.emulated_stage import EmulatedStage
from vehicle_agent.nigel.rosserial import REQUEST_TOPICS, Decoder, Frame, pack, pack_float

TAG = 9


class Stage(EmulatedStage):
    """World, Eye and the car, what the Eye sees of it and what the emulator prints."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more)
        self.eye = Mailbox(5000)
        self.bus.subscribe(EyePose, {"vehicle": f"tag-{TAG}"}, self.eye)
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        self.lines += (line.rstrip() for line in self.car.stdout)

    def close(self) -> None:
        self.car.kill()
        self._reader.join(5.0)
        super().close()

    def newest(self, box: Mailbox):
        """Return the newest that came since the last look."""
        items = box.drain()
        return items[-1].message if items else None


@pytest.fixture
def stage(tmp_path):
    with Stage.open(tmp_path, "--name", "n7", "--tag", str(TAG), "--spawn", "a") as made:
        yield made
        made.car.send_signal(signal.SIGINT)
        made.car.wait(timeout=10.0)
        assert not made.link.is_symlink()


def say(port, throttle, steering, seconds):
    """Command at 50 Hz."""
    until = time.monotonic() + seconds
    frames = pack(Frame(100, pack_float(steering))) + pack(Frame(101, pack_float(throttle)))
    while time.monotonic() < until:
        port.write(frames)
        time.sleep(0.02)


def answer(port):
    """Ask for the topics until the board, which boots first, tells them."""
    decoder, frames = Decoder(), []

    def heard():
        port.write(pack(REQUEST_TOPICS))
        frames.extend(decoder.feed(port.read(220), 0))
        return len(frames) >= 3

    wait_for(heard, 90.0, "the board tells its topics")
    return frames


def gap(a, b):
    return math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)


def seen_and_true(stage):
    """Return the newest sighting and the truth nearest to it in time."""
    stage.eye.drain()
    seen = wait_for(lambda: stage.newest(stage.eye), 120.0, "the Eye sees the car")
    told = [item.message for item in stage.truth.drain()]
    return seen, min(told, key=lambda one: abs(one.t_ns - seen.t_ns))


def test_bytes_on_the_port_move_what_the_eye_sees(stage):
    start = wait_for(lambda: stage.newest(stage.eye), START_S, "the Eye sees the car")
    with serial.Serial(str(stage.link), 57600, timeout=0.5) as port:
        assert [frame.topic for frame in answer(port)[:3]] == [10, 1, 1]
        say(port, 0.8, 0.3, 2.0)
        seen, true = seen_and_true(stage)
        assert 0.15 < gap(seen, start) < 0.4
        assert gap(seen, true) < 0.01
    drives_on = lambda: gap(seen_and_true(stage)[0], seen) > 0.05  # noqa: E731
    wait_for(drives_on, 120.0, "the car drives on though nobody holds the port any more")

    def stands():
        now, true = seen_and_true(stage)
        return now if abs(true.speed_mps) < 0.005 else None

    with serial.Serial(str(stage.link), 57600):
        stopped = wait_for(stands, 120.0, "the car stands: opening the port resets its board")
        time.sleep(0.5)
        assert gap(seen_and_true(stage)[0], stopped) < 0.005
    said = [re.sub(r".* (host_\w+) .*", r"\1", line) for line in stage.lines if "host_" in line]
    assert said[:3] == ["host_opens_resets", "host_closes", "host_opens_resets"]
