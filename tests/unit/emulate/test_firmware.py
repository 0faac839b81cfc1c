"""The emulated device in virtual time: bytes in, bytes and pins out."""

import random
from itertools import pairwise

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from vehicle_agent.emulate.firmware import BOOT_NS, Firmware
from vehicle_agent.emulate.sketches import SKETCHES, Outputs, servo_pulse
from vehicle_agent.nigel.rosserial import (
    FLOAT32,
    FLOAT32_MD5,
    REQUEST_TOPICS,
    STOP_SENDING,
    TIME,
    Frame,
    TopicInfo,
    pack,
    pack_float,
    pack_time,
    pack_topic_info,
)

STEER_HALF = bytes.fromhex("ff fe 04 00 fb 64 00 00 00 00 3f 5c")
DRIVE_04 = bytes.fromhex("ff fe 04 00 fb 65 00 cd cc cc 3e f7")
TIME_REQUEST = bytes.fromhex("ff fe 08 00 f7 0a 00 00 00 00 00 00 00 00 00 f5")
REST = SKETCHES["2wd"].at_setup
HALF_LEFT = SKETCHES["2wd"].steer(REST, 0.5)


class Bench:
    """A device and a clock."""

    def __init__(self, kind="2wd", *, booted=True):
        self.now_ns = 5 * NS_PER_S
        self.board = Firmware(SKETCHES[kind], self.now_ns)
        if booted:
            self.run(2100)

    def run(self, ms, data=b""):
        """Send, and return what has come after so many milliseconds."""
        out = bytearray(self.board.step(self.now_ns, data))
        for _ in range(ms):
            self.now_ns += NS_PER_MS
            out += self.board.step(self.now_ns)
        return bytes(out)

    @property
    def pins(self):
        return self.board.outputs


def drive(u):
    return pack(Frame(101, pack_float(u)))


def test_the_known_bytes_move_servo_and_motor():
    bench = Bench()
    assert bench.pins == REST
    bench.run(10, STEER_HALF + DRIVE_04)
    assert (bench.pins.servos_us, bench.pins.pwm) == ((1698,), 102)
    assert (bench.pins.reverse, bench.pins.brake) == (0, 0)


def test_a_command_is_held_for_ever():
    bench = Bench()
    bench.run(10, DRIVE_04)
    held = bench.pins
    bench.run(60_000)
    assert bench.pins == held


@pytest.mark.parametrize("kind", ["2wd", "4wd"])
def test_topics_are_told_after_the_time_is_asked_for(kind):
    bench, sketch = Bench(kind), SKETCHES[kind]
    told = bench.run(200, pack(STOP_SENDING) + pack(REQUEST_TOPICS))
    infos = [
        TopicInfo(100 + at, name, FLOAT32, FLOAT32_MD5, sketch.buffer)
        for at, name in enumerate(sketch.topics)
    ]
    assert told == TIME_REQUEST + b"".join(pack(Frame(1, pack_topic_info(info))) for info in infos)
    assert bench.board.configured


def test_bytes_leave_at_the_pace_of_the_line():
    bench = Bench()
    told = bench.run(10, pack(REQUEST_TOPICS))
    # 8 bytes to it take 1.4 ms and its loop up to 1 ms, so 7.6 to 8.6 ms are left: 5.76 bytes each.
    assert 43 <= len(told) <= 50


def test_a_host_is_asked_for_the_time_each_2500_ms():
    bench = Bench()
    bench.run(100, pack(REQUEST_TOPICS))
    asked = [ms for ms in range(10_000) if bench.run(1, b"").endswith(TIME_REQUEST[-1:])]
    gaps = [b - a for a, b in pairwise(asked)]
    assert len(asked) in (3, 4)
    assert gaps == [2501] * len(gaps)


def test_without_a_time_reply_it_forgets_the_host_after_11_s_and_still_obeys():
    bench = Bench()
    bench.run(1, pack(REQUEST_TOPICS))
    bench.run(10_990)
    assert bench.board.configured
    bench.run(20)
    assert not bench.board.configured
    assert bench.run(5_000) == b""
    bench.run(10, DRIVE_04)
    assert bench.pins.pwm == 102


def test_time_replies_keep_it_configured():
    bench = Bench()
    bench.run(10, pack(REQUEST_TOPICS))
    for _ in range(4):
        bench.run(6_000, pack(Frame(TIME, pack_time(bench.now_ns))))
    assert bench.board.configured


def test_tx_stop_makes_it_silent():
    bench = Bench()
    bench.run(200, pack(REQUEST_TOPICS))
    assert bench.run(3_000, pack(STOP_SENDING)) == b""


def test_it_is_deaf_and_at_rest_for_two_seconds_after_a_reset():
    bench = Bench()
    bench.run(10, STEER_HALF + DRIVE_04)
    bench.board.reset(bench.now_ns)
    assert bench.pins == Outputs()
    assert bench.run(1_990, DRIVE_04 + pack(REQUEST_TOPICS)) == b""
    assert bench.pins == Outputs()
    bench.run(100)
    assert bench.pins == REST
    assert BOOT_NS == 2 * NS_PER_S


@pytest.mark.parametrize("at", [2, 4, 7, 11])
def test_a_wrong_byte_anywhere_loses_the_frame(at):
    bench = Bench()
    bad = bytearray(STEER_HALF)
    bad[at] ^= 0x10
    bench.run(30, bytes(bad))
    assert bench.pins == REST
    bench.run(30, STEER_HALF)
    assert bench.pins == HALF_LEFT


@pytest.mark.parametrize("at", range(1, 12))
def test_a_cut_frame_takes_the_next_with_it_for_20_ms_only(at):
    bench = Bench()
    bench.run(30, STEER_HALF[:at])
    bench.run(10, STEER_HALF)
    assert bench.pins == HALF_LEFT


def test_a_frame_must_be_whole_20_ms_after_its_first_byte():
    bench = Bench()
    bench.run(18, STEER_HALF[:6])
    bench.run(10, STEER_HALF[6:])
    assert bench.pins == HALF_LEFT
    bench = Bench()
    bench.run(23, STEER_HALF[:6])
    bench.run(10, STEER_HALF[6:])
    assert bench.pins == REST


def test_an_ff_before_a_frame_loses_it_and_asks_for_the_time_while_unconfigured():
    bench = Bench()
    assert bench.run(30, b"\xff" + STEER_HALF) == TIME_REQUEST
    assert bench.pins == REST
    bench.run(100, pack(REQUEST_TOPICS))
    assert bench.run(30, b"\xff" + STEER_HALF) == b""


def test_a_message_without_bytes_repeats_the_ones_before():
    bench = Bench()
    bench.run(10, DRIVE_04)
    bench.run(10, pack(Frame(100)))
    assert bench.pins.servos_us == (servo_pulse(97 + 12),)  # the drive command's 0.4


def test_topics_that_nobody_subscribed_to_do_nothing():
    bench = Bench()
    for topic in (1, 6, 7, 99, 102, 124, 125, 126):
        bench.run(20, pack(Frame(topic, bytes(4))))
    bench.run(10, DRIVE_04)
    assert bench.pins.pwm == 102
    assert not bench.board.is_lost


def test_a_topic_behind_all_tables_loses_the_program_until_a_reset():
    bench = Bench()
    bench.run(10, DRIVE_04)
    bench.run(10, pack(Frame(127, bytes(4))) + drive(0.0))
    bench.run(20, drive(0.0))
    assert bench.board.is_lost
    assert bench.pins.pwm == 102
    bench.board.reset(bench.now_ns)
    bench.run(2_100)
    assert (bench.board.is_lost, bench.pins) == (False, REST)


def test_frames_too_long_for_20_ms_are_never_heard():
    bench = Bench()
    bench.run(200, pack(Frame(100, pack_float(0.5) + bytes(1000))))
    assert bench.pins == REST
    bench.run(30)
    bench.run(10, STEER_HALF)
    assert bench.pins == HALF_LEFT


def test_what_comes_while_it_announces_its_topics_is_partly_lost():
    bench = Bench()
    commands = b"".join(drive(0.01 * n) for n in range(1, 21))
    bench.run(200, pack(REQUEST_TOPICS) + commands)
    assert bench.board.lost_bytes > 0


def test_noise_neither_breaks_nor_drives_it():
    """Both checks and a topic of ours would have to come by chance: 1 in 10^12 a byte."""
    draw = random.Random(4)
    bench = Bench()
    for _ in range(40):
        bench.board.step(bench.now_ns, draw.randbytes(2_500))
        bench.now_ns += 600 * NS_PER_MS
    bench.run(100)
    assert (bench.pins, bench.board.is_lost) == (REST, False)
    bench.run(10, STEER_HALF)
    assert bench.pins == HALF_LEFT
