"""The host's side of rosserial in virtual time, against a device that answers by the book."""

import itertools
import math
import random
import struct

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from tests.unit.nigel.fake_device import (
    BATTERY,
    DRIVE,
    LIGHT,
    NANO,
    OURS,
    STEER,
    TELEMETRY,
    Device,
    announced,
    asking_time,
)
from tests.unit.nigel.fuzzed_line import RECOVERY_NS, fuzz
from vehicle_agent.nigel.host import BOOT_NS, COMMAND_EVERY_NS, REST, Host, NigelCommand
from vehicle_agent.nigel.rosserial import (
    PUBLISHER_INFO,
    REQUEST_TOPICS,
    STOP_SENDING,
    TIME,
    Decoder,
    Frame,
    TopicInfo,
    pack,
    pack_float,
    pack_topic_info,
)

TURN_NS = 5 * NS_PER_MS
MEGA = (
    TopicInfo(100, "autodrive/nigel_1/steering_command", STEER.kind, STEER.md5, 512),
    TopicInfo(101, "/autodrive/n7/throttle_command", STEER.kind, STEER.md5, 512),
)


class Line:
    """A host and a device on one line, and the time."""

    def __init__(self, device=None, baud=57600):
        self.host, self.device = Host(baud), device
        self.now_ns = 10**18
        self.sent = []
        self._back = b""
        self.host.open(self.now_ns)

    def run(self, span_s, wish=REST, noise=lambda: b""):
        """Let time pass in steps of 5 ms; return what went to the device, with its time."""
        log = []
        for _ in range(round(span_s * NS_PER_S / TURN_NS)):
            self.now_ns += TURN_NS
            answers = self.host.receive(noise() + self._back, self.now_ns)
            frames = answers + self.host.frames_due(wish, self.now_ns)
            log += [(self.now_ns, frame) for frame in frames]
            heard = b"".join(frames)
            self._back = self.device.hear(heard, self.now_ns) if self.device else b""
        return log

    def ready(self):
        self.run(BOOT_NS / NS_PER_S + 0.2)
        assert self.host.phase == "ready"
        return self


def frames_of(log):
    return Decoder().feed(b"".join(frame for _, frame in log), 0)


def test_it_waits_for_the_boot_then_stops_the_device_and_asks_for_its_topics():
    line = Line(Device())
    assert line.run(2.09) == []
    assert frames_of(line.run(0.02))[:2] == [STOP_SENDING, REQUEST_TOPICS]


@pytest.mark.parametrize("topics", [NANO, MEGA, (DRIVE, STEER)], ids=["nano", "mega", "swapped"])
def test_it_learns_the_numbers_by_name_and_commands_at_50_hz(topics):
    device = Device(topics)
    line = Line(device).ready()
    device.said.clear()
    log = line.run(1.0, NigelCommand(0.25, -0.5))
    by_name = {name.rpartition("/")[2][:5]: value for name, value in device.values.items()}
    steer, drive = (by_name[key] for key in (("steer", "drive") if topics != MEGA
                                             else ("steer", "throt")))  # fmt: skip
    assert (steer, drive) == (-0.5, 0.25)
    times = [t for t, frame in log if frame[5] == 101]
    assert len(times) == 50
    assert {b - a for a, b in itertools.pairwise(times)} == {COMMAND_EVERY_NS}


@pytest.mark.parametrize(
    ("asked", "said"),
    [(3.0, 1.0), (-1.5, -1.0), (math.nan, 0.0), (math.inf, 0.0), (-math.inf, 0.0), (0.3, 0.3)],
)
def test_commands_are_finite_and_within_one(asked, said):
    device = Device()
    Line(device).ready().run(0.1, NigelCommand(asked, asked))
    assert device.values == pytest.approx({"steer_cmd": said, "drive_cmd": said})


def test_one_announcement_alone_is_not_believed():
    line = Line()
    line.run(2.2)
    line.host.receive(announced(STEER) + announced(DRIVE), line.now_ns)
    log = line.run(0.5, NigelCommand(1.0, 1.0))
    assert {frame.topic for frame in frames_of(log)} == {REQUEST_TOPICS.topic}
    line.host.receive(announced(STEER) + announced(DRIVE), line.now_ns)
    assert {100, 101} <= {frame.topic for frame in frames_of(line.run(0.1))}


def test_two_topics_never_share_a_number():
    line = Line(Device((STEER, TopicInfo(100, "drive_cmd", DRIVE.kind, DRIVE.md5, 280))))
    line.run(4.0, NigelCommand(1.0, 1.0))
    assert "number 100 is in use" in line.host.trouble
    assert {frame.topic for frame in line.device.said} <= {0, 10, 11}


def test_what_the_device_publishes_under_a_commands_name_is_no_command():
    line = Line()
    line.run(2.2)
    info = pack_topic_info(TopicInfo(125, "drive_cmd", DRIVE.kind, DRIVE.md5, 280))
    published = pack(Frame(PUBLISHER_INFO, info))
    line.host.receive((announced(STEER) + published) * 2, line.now_ns)
    line.run(0.1)
    assert line.host.phase == "requests"


def test_a_topic_of_another_type_is_refused_in_words():
    line = Line(Device((STEER, TopicInfo(101, "drive_cmd", "std_msgs/Int32", "x", 280))))
    line.run(4.0)
    assert line.host.phase == "requests"
    assert "topic drive_cmd: got std_msgs/Int32 x, expected std_msgs/Float32" in line.host.trouble


def test_time_is_told_to_who_asks_for_it_but_never_floods_the_line():
    line = Line(Device()).ready()
    now_ns = 2 * 10**18 + 5
    (answer,) = line.host.receive(asking_time(), now_ns)
    assert answer == pack(Frame(TIME, struct.pack("<II", 2 * 10**9, 5)))
    assert len(line.host.receive(asking_time() * 100, now_ns + NS_PER_S)) == 1


def test_a_device_that_resets_is_asked_again_and_obeys_meanwhile():
    line = Line(Device()).ready()
    line.run(1.0)
    line.device.said.clear()
    line.run(6.0, NigelCommand(0.5))
    assert line.device.said.count(REQUEST_TOPICS) == 1
    assert line.device.values["drive_cmd"] == 0.5


def test_after_three_silences_only_zeros_go_out_until_it_speaks():
    line = Line(Device()).ready()
    deaf, line.device = line.device, None
    log = line.run(14.0, NigelCommand(0.5, 0.5))
    assert frames_of(log)[-1].payload == pack_float(0.5)
    log = line.run(3.0, NigelCommand(0.5, 0.5))
    late = [frame for frame in frames_of(log[-40:]) if frame.topic >= 100]
    assert {frame.payload for frame in late} == {pack_float(0.0)}
    assert line.host.trouble == "the Arduino has been silent for 15 s"
    line.device = deaf
    line.run(1.0, NigelCommand(0.5, 0.5))
    assert deaf.values["drive_cmd"] == 0.5


def test_a_port_that_opens_again_is_learned_again():
    line = Line(Device()).ready()
    line.host.close()
    assert line.run(0.1, NigelCommand(1.0)) == []
    line.host.open(line.now_ns)
    assert line.run(2.0, NigelCommand(1.0)) == []
    line.ready()


def test_rest_is_zeros_at_once_whatever_was_said():
    line = Line(Device()).ready()
    line.run(0.1, NigelCommand(0.5, 0.5, lamps=1))
    assert [Frame(DRIVE.number, pack_float(0.0)), Frame(STEER.number, pack_float(0.0))] == [
        frame for data in line.host.rest() for frame in Decoder().feed(data, 0)
    ]
    line.host.close()
    assert line.host.rest() == []


def test_while_it_asks_it_says_so():
    line = Line()
    line.run(2.2)
    assert line.host.trouble == "requests the topics of the Arduino"


def test_bytes_without_a_frame_look_like_the_wrong_baud_rate():
    noise = random.Random(1)
    line = Line()
    line.run(6.0, noise=lambda: noise.randbytes(3))
    assert "the baud rate looks wrong (it is 57600; try --baud 115200)" in line.host.trouble


def test_no_bytes_at_all_say_so():
    line = Line(baud=115200)
    line.run(6.0)
    assert line.host.trouble.startswith("no answer: wrong baud rate (it is 115200; try --baud 57")


def test_a_device_without_our_topics_is_told_of():
    line = Line(Device((LIGHT,)))
    line.run(6.0)
    assert line.host.trouble.endswith("has no steering and throttle topics")


def floats(*values):
    """Return a Float32MultiArray with one dimension."""
    layout = struct.pack("<II", 1, 1) + b"v" + struct.pack("<III", len(values), 1, 0)
    return layout + struct.pack(f"<I{len(values)}f", len(values), *values)


def test_our_own_firmware_tells_of_itself_and_has_lamps():
    line = Line(Device(OURS)).ready()
    line.run(0.1, NigelCommand(lamps=5))
    assert line.device.values["light_cmd"] == 5.0
    values = (1920.0, -3.0, 0.25, 1.0, -2.0, 11.5, 2.0, 20.0)
    told = pack(Frame(TELEMETRY.number, floats(*values)))
    line.host.receive(told + pack(Frame(BATTERY.number, pack_float(11.5))), line.now_ns)
    reading = line.host.telemetry
    assert (reading.left, reading.right, reading.gyro_radps) == (1920, -3, 0.25)
    assert (reading.accel_mps2, reading.command_age_ms, reading.has_imu) == ((1, -2), 20, True)
    assert (line.host.readings, line.host.battery_v) == (1, 11.5)
    line.host.receive(pack(Frame(TELEMETRY.number, floats(*values[:5]))), line.now_ns)
    line.host.receive(pack(Frame(TELEMETRY.number, floats(math.nan, *values[1:]))), line.now_ns)
    line.host.receive(pack(Frame(TELEMETRY.number, floats(*values)[:-1])), line.now_ns)
    assert line.host.readings == 1


def test_telemetry_that_falls_silent_shows_a_reset():
    line = Line(Device(OURS)).ready()
    line.run(0.5)
    line.device.said.clear()
    line.run(1.1)
    assert line.device.said.count(REQUEST_TOPICS) == 1


def test_rubbish_never_makes_a_wrong_command_and_is_over_in_100_ms():
    found = fuzz(200_000, seed=4)
    assert found.rounds > 50
    assert found.wrong == 0
    assert found.slowest_ns <= RECOVERY_NS


def test_throttle_that_falls_to_zero_waits_for_no_turn():
    line = Line(Device()).ready()
    line.run(1.0, NigelCommand(0.5, 0.1))
    (sent_ns, _), *_ = line.run(COMMAND_EVERY_NS / NS_PER_S, NigelCommand(0.5, 0.1))
    line.run((sent_ns + COMMAND_EVERY_NS - line.now_ns) / NS_PER_S, NigelCommand(0.5, 0.1))
    drive, *_ = frames_of(line.run(TURN_NS / NS_PER_S, NigelCommand(0.0, 0.1)))
    assert drive == Frame(DRIVE.number, pack_float(0.0))
    assert line.run(2 * TURN_NS / NS_PER_S, NigelCommand(0.0, 0.1)) == []
