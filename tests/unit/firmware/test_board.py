"""Nigel's firmware on a simulated Arduino Nano: its bytes and pins, in the board's own time."""

import math
import os
import random
import re
import signal
import struct
import subprocess
import time
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import pytest
import serial

from vehicle_agent.nigel.rosserial import (
    FLOAT32,
    FLOAT32_MD5,
    PUBLISHER_INFO,
    REQUEST_TOPICS,
    STOP_SENDING,
    SUBSCRIBER_INFO,
    TIME,
    Decoder,
    Frame,
    pack,
    pack_float,
    pack_time,
    unpack_topic_info,
)

STEER, DRIVE, LIGHT, TELEMETRY = 100, 101, 102, 125
CENTRE_US, US_PER_DEG = 544 + 97 * 1856 / 180, 1856 / 180
BOOT_MS = 5
"""The simulated board has no bootloader: it listens at once."""

NEEDED = {
    "avr-g++": Path("/usr/bin/avr-g++"),
    "avr-libc": Path("/usr/lib/avr/include/avr/io.h"),
    "arduino-core-avr": Path("/usr/share/arduino/hardware/arduino/avr/cores/arduino/Arduino.h"),
    "libsimavr-dev": Path("/usr/include/simavr/sim_avr.h"),
    "gcc": Path("/usr/bin/gcc"),
    "make": Path("/usr/bin/make"),
}


@dataclass
class Board:
    """A board that stands still until it is told to run; `now_us` is its own time."""

    process: subprocess.Popen
    pins: dict[str, float] = field(default_factory=dict)
    events: list[tuple[int, str, float]] = field(default_factory=list)
    frames: list[tuple[int, Frame]] = field(default_factory=list)
    now_us: int = 0
    stack: int = 0
    _decoder: Decoder = field(default_factory=Decoder)

    def order(self, command: str) -> None:
        """Give one command and read all that the board reports until it is done."""
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        for line in self.process.stdout:
            at, name, value = line.split()
            self.now_us = int(at)
            if name == "tx":
                found = self._decoder.feed(bytes.fromhex(value), self.now_us * 1000)
                self.frames += [(self.now_us, frame) for frame in found]
            elif name == "ok":
                self.stack = int(value)
                return
            else:
                self.pins[name] = float(value)
                self.events.append((self.now_us, name, float(value)))
        pytest.fail("the board ended")

    def run(self, ms: float) -> None:
        self.order(f"run {ms}")

    def send(self, *data: bytes) -> None:
        self.order(f"rx {b''.join(data).hex()}")

    def command(self, topic: int, value: float, ms: float = 25) -> None:
        """Send one command and let the board go on; a servo's register takes it at once."""
        self.send(pack(Frame(topic, pack_float(value))))
        self.run(ms)

    def join(self) -> None:
        """Be a host: ask for the topics and answer the question for the time."""
        self.send(pack(STOP_SENDING), pack(REQUEST_TOPICS))
        self.send(pack(Frame(TIME, pack_time(1_000_000_000))))
        self.run(150)

    def seen(self, name: str, since_us: int = 0) -> list[tuple[int, float]]:
        """Return when and to what a pin changed."""
        return [(at, value) for at, what, value in self.events if what == name and at > since_us]

    def reports(self, since_us: int = 0) -> list[tuple[int, tuple[float, ...]]]:
        """Return the telemetry, with the time at which each message was whole."""
        return [
            (at, struct.unpack("<8f", frame.payload[12:]))
            for at, frame in self.frames
            if frame.topic == TELEMETRY and at > since_us
        ]


@pytest.fixture(scope="session")
def built(root, tmp_path_factory):
    """The firmware and the board, built by the Makefile; with what it said of their size."""
    missing = [name for name, path in NEEDED.items() if not path.exists()]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)} (Debian packages; see docs/firmware.md)")
    build = tmp_path_factory.mktemp("firmware")
    done = subprocess.run(
        ["make", "-C", str(root / "vehicle_agent/firmware"), f"BUILD={build}", "all", "board"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return build, done.stdout


@pytest.fixture
def board(built):
    build, _ = built
    command = [str(build / "board"), str(build / "firmware.hex")]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        board = Board(process)
        board.order("battery 2500")
        board.run(BOOT_MS)
        yield board
        process.stdin.close()
        process.wait(10)


def test_it_fits_and_leaves_the_stack_many_times_what_it_takes(built, board):
    flash, ram, left = map(int, re.search(r"flash (\d+) .*RAM (\d+) .*: (\d+)", built[1]).groups())
    board.join()
    board.command(DRIVE, 0.5, ms=100)
    assert flash < 30720 / 2
    assert ram + left == 2048
    assert 0 < board.stack < left / 4


def test_the_topics_of_the_published_firmware_are_announced_and_ours_beside_them(board):
    board.join()
    frames = [frame for _, frame in board.frames]
    assert frames[0] == Frame(TIME, bytes(8))
    reported = {
        (info.number, info.name, info.kind, info.md5)
        for info in (
            unpack_topic_info(frame.payload)
            for frame in frames
            if frame.topic in {PUBLISHER_INFO, SUBSCRIBER_INFO}
        )
    }
    assert reported == {
        (STEER, "steer_cmd", FLOAT32, FLOAT32_MD5),
        (DRIVE, "drive_cmd", FLOAT32, FLOAT32_MD5),
        (LIGHT, "light_cmd", FLOAT32, FLOAT32_MD5),
        (TELEMETRY, "telemetry", "std_msgs/Float32MultiArray", "6a40e0ffa6a17a503ac3f8616991b1f6"),
    }


@pytest.mark.parametrize(
    ("drive", "pwm", "is_reverse"),
    [(0.4, 102, 0), (1.0, 255, 0), (7.0, 255, 0), (-0.4, 102, 1), (-1.0, 255, 1), (-9.0, 255, 1)],
)
def test_a_drive_command_turns_the_motor_as_the_published_mapping_says_and_no_faster(
    board, drive, pwm, is_reverse
):
    assert board.pins["brake"] == 1
    board.command(DRIVE, drive)
    reported = {name: board.pins.get(name, 0) for name in ("pwm", "dir", "brake")}
    assert reported == {"pwm": pwm, "dir": is_reverse, "brake": 0}
    board.command(DRIVE, 0.0)
    assert (board.pins["pwm"], board.pins["brake"]) == (0, 1)


@pytest.mark.parametrize(
    ("steer", "deg"), [(0.5, 112), (-0.5, 82), (1.0, 127), (-1.0, 67), (3.0, 127), (-3.0, 67)]
)
def test_a_steering_command_gives_the_published_servo_angle_within_a_tenth_of_a_degree(
    board, steer, deg
):
    assert board.pins["servo_us"] == pytest.approx(CENTRE_US, abs=US_PER_DEG / 10)
    board.command(STEER, steer)
    assert board.pins["servo_us"] == pytest.approx(544 + deg * US_PER_DEG, abs=US_PER_DEG / 10)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_refused_and_keeps_no_motor_running(board, bad):
    board.command(DRIVE, 0.4)
    board.command(STEER, 0.5)
    since_us, servo_us = board.now_us, board.pins["servo_us"]
    for _ in range(12):
        board.command(STEER, bad)
        board.command(DRIVE, bad)
    assert [value for _, value in board.seen("pwm", since_us)] == [0]
    assert board.pins["servo_us"] == servo_us


@pytest.mark.parametrize("phase_ms", [0, 3.3, 11.7])
def test_silence_stops_the_motor_within_300_ms_and_leaves_the_servo(board, phase_ms):
    board.command(STEER, 0.5, ms=phase_ms)
    for _ in range(10):
        board.command(DRIVE, 0.6, ms=100)
    assert [value for _, value in board.seen("pwm")] == [153]
    (received_us, _), servo_us = board.seen("received")[-1], board.pins["servo_us"]
    board.run(400)
    (stopped_us, duty) = board.seen("pwm")[-1]
    assert duty == 0
    assert 245 <= (stopped_us - received_us) / 1000 <= 300
    assert board.pins["brake"] == 1
    assert board.pins["servo_us"] == servo_us


def test_steering_alone_keeps_no_motor_running_and_a_new_command_starts_it_again(board):
    board.command(DRIVE, 0.6)
    for _ in range(12):
        board.command(STEER, 0.1)
    assert board.pins["pwm"] == 0
    board.command(DRIVE, 0.6)
    assert board.pins["pwm"] == 153


def test_garbage_moves_nothing(board):
    draw = random.Random(5)
    wrong = []
    for _ in range(400):
        frame = bytearray(pack(Frame(draw.choice((STEER, DRIVE)), pack_float(draw.uniform(-1, 1)))))
        frame[draw.randrange(len(frame))] ^= 1 << draw.randrange(8)
        wrong += [bytes(frame), draw.randbytes(draw.randrange(20)), b"\xff\xfe\x04\x00\xfb"]
    for topic, length in ((DRIVE, 3), (DRIVE, 5), (DRIVE, 0), (STEER, 8), (103, 4), (125, 4)):
        wrong.append(pack(Frame(topic, draw.randbytes(length))))
    since_us = board.now_us
    for at in range(0, len(wrong), 50):
        board.send(*wrong[at : at + 50])
        board.run(0.21 * sum(map(len, wrong[at : at + 50])))
    moved = [event for event in board.events if event[0] > since_us and event[1] != "received"]
    assert moved == []
    board.run(30)
    board.command(DRIVE, 0.4)
    assert board.pins["pwm"] == 102


@pytest.mark.parametrize("pause_ms", [0, 30])
def test_a_frame_cut_at_any_byte_loses_none_that_follows(board, pause_ms):
    whole = pack(Frame(DRIVE, pack_float(0.9)))
    for cut in range(1, len(whole)):
        board.command(DRIVE, 0.0)
        since_us = board.now_us
        board.send(whole[:cut])
        board.run(pause_ms)
        board.command(DRIVE, 0.4)
        assert [value for _, value in board.seen("pwm", since_us)] == [102], f"cut at byte {cut}"


def test_telemetry_comes_at_50_hz_with_what_the_sensors_say(board):
    board.order("imu on")
    board.order("reading 1638 -3277 16384 0 0 1310")
    board.run(1100)
    board.join()
    since_us = board.now_us
    for at in range(40):
        board.command(DRIVE, 0.4, ms=50)
        if at % 10 == 9:
            board.send(pack(Frame(TIME, pack_time(at))))
    reported = board.reports(since_us)
    took_s = (reported[-1][0] - reported[0][0]) * 1e-6
    assert len(reported) / took_s == pytest.approx(50, rel=0.02)
    apart_ms = [(b[0] - a[0]) / 1000 for a, b in pairwise(reported)]
    assert max(apart_ms) < 35  # a question for the time may lie between two
    left, right, gyro, accel_x, accel_y, battery, version, age_ms = reported[-1][1]
    assert (left, right, version) == (0, 0, 1)
    assert gyro == pytest.approx(math.radians(1310 / 131.072), rel=1e-4)
    assert (accel_x, accel_y) == pytest.approx(
        (1638 / 16384 * 9.80665, -3277 / 16384 * 9.80665), rel=1e-4
    )
    assert battery == pytest.approx(7.5, abs=0.02)
    assert 0 <= age_ms <= 60


def test_nobody_is_told_who_did_not_ask(board):
    board.command(DRIVE, 0.4, ms=200)
    assert board.frames == []
    board.join()
    assert board.reports() != []


def turn(board, channels, steps, ms=0.2):
    """Turn a wheel by quarter periods of its two channels; negative ones backwards."""
    order = [(0, 0), (1, 0), (1, 1), (0, 1)]
    for step in range(1, abs(steps) + 1):
        levels = order[(step if steps > 0 else -step) % 4]
        for pin, level in zip(channels, levels, strict=True):
            board.order(f"pin {pin} {level}")
        board.run(ms)


def test_both_encoders_count_each_edge_of_their_channel_a_up_and_down(board):
    for pin in (2, 3, 4, 5):
        board.order(f"pin {pin} 0")
    board.run(5)
    board.join()
    start = board.reports()[-1][1][:2]
    turn(board, (2, 4), 400)
    turn(board, (3, 5), -400)
    board.run(50)
    assert board.reports()[-1][1][:2] == (start[0] + 200, start[1] + 200)
    turn(board, (2, 4), -40)
    board.run(50)
    assert board.reports()[-1][1][:2] == (start[0] + 180, start[1] + 200)


@pytest.mark.parametrize("how", ["off", "stuck"])
def test_an_imu_that_does_not_answer_gives_nan_holds_nothing_up_and_is_found_again(board, how):
    board.order("imu on")
    board.order("reading 0 0 16384 0 0 1310")
    board.run(1100)
    board.join()
    assert not math.isnan(board.reports()[-1][1][2])
    board.order(f"imu {how}")
    since_us = board.now_us
    for _ in range(30):
        board.command(DRIVE, 0.4, ms=50)
    reported = board.reports(since_us)
    assert all(math.isnan(value) for value in reported[-1][1][2:5])
    assert len(reported) == pytest.approx(75, abs=2)
    assert [value for _, value in board.seen("pwm", since_us)] == [102]
    board.order("imu on")
    board.order("reading 0 0 16384 0 0 1310")
    board.run(1100)
    assert board.reports()[-1][1][2] == pytest.approx(math.radians(1310 / 131.072), rel=1e-4)


def test_a_processor_that_hangs_is_reset_and_its_motor_stops_within_300_ms(board):
    board.command(DRIVE, 0.6)
    board.order("hang")
    since_us = board.now_us
    board.run(600)
    stops = board.seen("pwm", since_us)
    assert [duty for _, duty in stops] == [0]
    assert (stops[0][0] - since_us) / 1000 <= 300
    assert board.pins["brake"] == 1
    board.command(DRIVE, 0.6)
    assert board.pins["pwm"] == 153


def test_lamps_follow_the_host_and_the_drive_command(board):
    def burning():
        names = ("low_beam", "high_beam", "reverse", "tail")
        return tuple(int(board.pins.get(name, 0)) for name in names)

    assert burning() == (0, 0, 0, 255)
    board.command(DRIVE, 0.4)
    assert burning() == (0, 0, 0, 0)
    board.command(LIGHT, 1)
    assert burning() == (1, 0, 0, 15)
    board.command(LIGHT, 2)
    assert burning() == (1, 1, 0, 15)
    board.command(DRIVE, -0.4)
    assert burning() == (1, 1, 1, 15)
    for refused in (16, -1, math.nan):
        board.command(LIGHT, refused, ms=5)
    assert burning() == (1, 1, 1, 15)
    since_us = board.now_us
    board.command(LIGHT, 4 + 8, ms=3000)
    left, right = board.seen("left", since_us), board.seen("right", since_us)
    assert [value for _, value in left] == [value for _, value in right]
    apart_ms = [(b[0] - a[0]) / 1000 for a, b in pairwise(left[1:])]
    assert apart_ms == pytest.approx([500] * len(apart_ms), abs=2)
    assert len(apart_ms) >= 3


def wait_for(what, done, seconds=60.0):
    """Poll until `done` gives something; fail with `what` at the deadline."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := done():
            return found
        time.sleep(0.01)
    return pytest.fail(f"not within {seconds} s: {what}")


def test_a_host_drives_it_over_a_pseudo_terminal_and_its_death_stops_the_motor(built, tmp_path):
    build, _ = built
    link, log = tmp_path / "nigel", tmp_path / "log"
    command = [str(build / "board"), str(build / "firmware.hex"), "--pty", str(link)]

    def says(text):
        return text in log.read_text()

    with log.open("w") as out:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=out)
    try:
        wait_for("the link", lambda: says("ready"))
        decoder, frames = Decoder(), []
        with serial.Serial(str(link), 57600, timeout=0) as port:
            port.write(pack(REQUEST_TOPICS))

            def announced():
                port.write(pack(Frame(DRIVE, pack_float(0.4))))
                frames.extend(decoder.feed(port.read(4096), time.monotonic_ns()))
                return {SUBSCRIBER_INFO, TELEMETRY} <= {frame.topic for frame in frames}

            wait_for("topics and telemetry", announced)
            wait_for("the motor", lambda: says(" pwm 102"))
        wait_for("the stop", lambda: says(" pwm 0"))
    finally:
        os.kill(process.pid, signal.SIGTERM)
        process.wait(10)
        process.stdin.close()
    assert not link.is_symlink()
