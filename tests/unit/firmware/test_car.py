"""The firmware's headers, compiled for this machine and driven byte for byte in virtual time."""

import ctypes
import math
import random
import shutil
import struct
import subprocess
from pathlib import Path

import pytest

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
    TopicInfo,
    pack,
    pack_float,
    pack_topic_info,
)

STEER, DRIVE, LIGHT, TELEMETRY = 100, 101, 102, 125
OUTPUTS = ("pwm", "reverse", "brake", "servo_us", "tail", "low", "high", "rear", "left", "right")
WHEN_WRAPS = 1 << 32


@pytest.fixture(scope="session")
def library(root, tmp_path_factory):
    """The headers as a library that ends the process at undefined behaviour."""
    if shutil.which("g++") is None:
        pytest.skip("not installed: g++, which compiles the firmware's headers for this machine")
    path = tmp_path_factory.mktemp("car") / "car.so"
    command = [
        *("g++", "-std=c++11", "-O1", "-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-Werror"),
        *("-fsanitize=undefined", "-fno-sanitize-recover=all", "-shared", "-fPIC"),
        f"-I{root / 'vehicle_agent/firmware'}",
        str(Path(__file__).parent / "car.cpp"),
        *("-o", str(path)),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    library = ctypes.CDLL(str(path))
    library.car_new.argtypes = [ctypes.c_float]
    library.car_tell.argtypes = [ctypes.c_int32, ctypes.c_int32, ctypes.c_float, ctypes.c_uint32]
    library.ticks_as_told.argtypes = [ctypes.c_int32]
    library.ticks_as_told.restype = ctypes.c_float
    library.imu_get.restype = ctypes.c_uint8
    return library


class Car:
    """The one car of the library; its clock is the caller's [ms], which wraps as the board's."""

    def __init__(self, library, slew_per_s=0.0):
        self.library = library
        library.car_new(slew_per_s)

    def receive(self, data, now_ms):
        self.library.car_receive(bytes(data), len(data), ctypes.c_uint32(now_ms % WHEN_WRAPS))

    def command(self, topic, value, now_ms=0):
        self.receive(pack(Frame(topic, pack_float(value))), now_ms)

    def step(self, now_ms=0):
        out = (ctypes.c_int32 * len(OUTPUTS))()
        self.library.car_step(ctypes.c_uint32(now_ms % WHEN_WRAPS), out)
        return dict(zip(OUTPUTS, out, strict=True))

    def send(self, now_ms, most=4096):
        into = (ctypes.c_uint8 * most)()
        count = self.library.car_send(into, most, ctypes.c_uint32(now_ms % WHEN_WRAPS))
        return bytes(into[:count])


@pytest.fixture
def car(library):
    return Car(library)


def test_the_drive_mapping_is_the_published_one_at_every_command(car):
    for milli in range(-1000, 1001):
        (drive,) = struct.unpack("<f", pack_float(milli / 1000))
        car.command(DRIVE, drive)
        told, pwm = car.step(), int(255 * abs(drive))
        expected = (pwm, int(drive < 0 and pwm > 0), int(pwm == 0))
        assert (told["pwm"], told["reverse"], told["brake"]) == expected, drive


def test_the_servo_s_pulse_is_that_of_the_published_angle_and_less_than_a_degree_off_it(car):
    for milli in range(-1000, 1001):
        car.command(STEER, milli / 1000)
        deg = 97 + 30 * milli / 1000
        told_deg = (car.step()["servo_us"] - 544) * 180 / (2400 - 544)
        assert told_deg == pytest.approx(deg, abs=0.05)
        assert abs(told_deg - int(deg)) < 1.05


def test_a_command_holds_for_250_ms_and_not_one_more_whatever_the_clock_shows(library):
    for start_ms in (0, 1, 123_456, WHEN_WRAPS - 250, WHEN_WRAPS - 100, WHEN_WRAPS - 1):
        car = Car(library)
        car.command(STEER, -1.0, start_ms)
        car.command(DRIVE, 0.6, start_ms)
        assert car.step(start_ms + 249)["pwm"] == 153
        stopped = car.step(start_ms + 250)
        assert (stopped["pwm"], stopped["brake"]) == (0, 1)
        assert stopped["servo_us"] == 1235


def test_a_command_that_ran_out_does_not_come_back_when_the_clock_has_wrapped(car):
    car.command(DRIVE, 0.6, 1000)
    car.step(1300)
    assert car.step(1000 + WHEN_WRAPS + 10)["pwm"] == 0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 10.5, -11.0, 3e38])
def test_no_number_and_an_absurd_one_are_no_command(car, bad):
    car.command(DRIVE, 0.6, 0)
    car.command(STEER, 0.5, 0)
    before = car.step(0)
    car.command(DRIVE, bad, 200)
    car.command(STEER, bad, 200)
    assert car.step(200) == before
    assert car.step(260)["pwm"] == 0


def test_the_slew_limit_moves_the_servo_no_faster_than_it_says(library):
    car = Car(library, slew_per_s=2.0)
    car.step(0)
    car.command(STEER, 1.0, 0)
    pulses = [car.step(ms)["servo_us"] for ms in range(0, 701, 100)]
    centre, end = 1544, 1853
    fifth = (end - centre) / 5
    expected = [centre + fifth * n for n in range(6)] + [end, end]
    assert pulses == pytest.approx(expected, abs=1.5)
    car.command(STEER, -1.0, 700)
    assert car.step(800)["servo_us"] == pytest.approx(end - fifth, abs=1.5)


def test_announcements_have_the_bytes_of_rosserial_however_slowly_the_port_takes_them(car):
    car.receive(pack(STOP_SENDING) + pack(REQUEST_TOPICS), 10)
    said = b"".join(car.send(10 + ms, most=7) for ms in range(100))
    floats = ("std_msgs/Float32MultiArray", "6a40e0ffa6a17a503ac3f8616991b1f6")
    infos = [
        (PUBLISHER_INFO, TopicInfo(TELEMETRY, "telemetry", *floats, 104)),
        (SUBSCRIBER_INFO, TopicInfo(STEER, "steer_cmd", FLOAT32, FLOAT32_MD5, 32)),
        (SUBSCRIBER_INFO, TopicInfo(DRIVE, "drive_cmd", FLOAT32, FLOAT32_MD5, 32)),
        (SUBSCRIBER_INFO, TopicInfo(LIGHT, "light_cmd", FLOAT32, FLOAT32_MD5, 32)),
    ]
    expected = [Frame(TIME, bytes(8)), *(Frame(t, pack_topic_info(i)) for t, i in infos)]
    assert said == b"".join(map(pack, expected))


def test_telemetry_is_told_every_20_ms_on_the_average_and_after_a_stop_no_more(car):
    car.receive(pack(REQUEST_TOPICS), 0)
    car.send(0)
    decoder, frames, now_ms = Decoder(), [], 0
    for _ in range(1000):
        now_ms += 3
        car.library.car_tell(-7, 9, 7.5, now_ms)
        frames += decoder.feed(car.send(now_ms), 0)
    told = [frame for frame in frames if frame.topic == TELEMETRY]
    assert len(told) == pytest.approx(150, abs=1)
    assert told[0].payload[:12] == struct.pack("<III", 0, 0, 8)
    values = struct.unpack("<8f", told[0].payload[12:])
    assert values[:7] == (-7, 9, 0.5, 1.0, -2.0, 7.5, 1.0)
    assert math.isnan(values[7])
    car.receive(pack(STOP_SENDING), now_ms)
    car.library.car_tell(-7, 9, 7.5, now_ms + 100)
    assert car.send(now_ms + 100) == b""


def test_a_host_is_asked_for_the_time_and_told_no_more_once_it_has_not_answered_for_11_s(car):
    car.receive(pack(REQUEST_TOPICS), 0)
    decoder, told_ms, asked_ms = Decoder(), [], []
    for now_ms in range(0, 15_000, 2):
        if now_ms == 2000:
            car.receive(pack(Frame(TIME, bytes(8))), now_ms)
        car.library.car_tell(0, 0, 7.5, now_ms)
        for frame in decoder.feed(car.send(now_ms), 0):
            if frame.topic in {TIME, TELEMETRY}:
                (asked_ms if frame.topic == TIME else told_ms).append(now_ms)
    assert asked_ms == pytest.approx([0, 2502, 5004, 7506, 10_008, 12_510], abs=4)
    assert told_ms[-1] == pytest.approx(13_000, abs=20)
    car.receive(pack(REQUEST_TOPICS), 16_000)
    assert {frame.topic for frame in decoder.feed(car.send(16_000), 0)} >= {TIME, PUBLISHER_INFO}


def test_the_age_of_the_last_command_is_told(car):
    car.receive(pack(REQUEST_TOPICS), 0)
    car.send(0)
    car.command(DRIVE, 0.1, 100)
    car.library.car_tell(0, 0, 0.0, 175)
    (frame,) = Decoder().feed(car.send(175), 0)
    assert struct.unpack("<f", frame.payload[-4:]) == (75,)


def test_lamps_burn_as_asked_and_what_asks_for_none_of_them_changes_nothing(car):
    def burning(now_ms=0):
        told = car.step(now_ms)
        return tuple(told[name] for name in ("tail", "low", "high", "rear", "left", "right"))

    assert burning() == (255, 0, 0, 0, 0, 0)
    car.command(DRIVE, 0.06)
    assert burning() == (0, 0, 0, 0, 0, 0)
    car.command(LIGHT, 1 + 4)
    for refused in (16, -1, -0.5, math.nan, math.inf, 1e9):
        car.command(LIGHT, refused)
        assert burning() == (15, 1, 0, 0, 1, 0), refused
    car.command(LIGHT, 2 + 8)
    car.command(DRIVE, -0.04)
    assert burning() == (255, 1, 1, 1, 0, 1)
    assert [burning(ms)[5] for ms in (499, 500, 999, 1000)] == [1, 0, 0, 1]


def found_by(library, stream):
    most = 4096
    found = (ctypes.c_uint16 * (2 * most))()
    count = library.decode(bytes(stream), len(stream), found, most)
    return [(found[2 * at], found[2 * at + 1]) for at in range(count)]


def test_frames_are_found_in_any_noise_just_as_the_host_finds_them(library):
    draw = random.Random(11)
    stream = bytearray()
    for _ in range(1500):
        stream += draw.randbytes(draw.randrange(6)) + b"\xff" * draw.randrange(3)
        stream += pack(Frame(draw.randrange(130), draw.randbytes(draw.choice((0, 4, 8, 32)))))
        if draw.random() < 0.2:
            del stream[-draw.randrange(1, 8) :]
    stream += bytes(64)
    ours = found_by(library, stream)
    theirs = [(frame.topic, len(frame.payload)) for frame in Decoder().feed(bytes(stream), 0)]
    assert ours == [frame for frame in theirs if frame[1] <= 32]
    assert len(ours) > 1000


def test_a_million_bytes_of_noise_move_nothing(car):
    draw = random.Random(12)
    still = {"pwm": 0, "reverse": 0, "brake": 1, "servo_us": 1544}
    for now_ms in range(0, 1000, 2):
        noise = bytearray(draw.randbytes(2000))
        for _ in range(40):
            at = draw.randrange(1980)
            start = draw.choice((b"\xff\xfe\x04\x00\xfb", b"\xff\xfe\x04", b"\xff\xff\xfe"))
            noise[at : at + len(start)] = start
        car.receive(noise, now_ms)
        told = car.step(now_ms)
        moved = {name: told[name] for name in still}
        assert moved == still


def test_a_command_with_any_one_bit_flipped_is_no_command(car):
    whole = pack(Frame(DRIVE, pack_float(0.4)))
    for bit in range(8 * len(whole)):
        flipped = bytearray(whole)
        flipped[bit // 8] ^= 1 << bit % 8
        car.receive(flipped, 100 * bit)
        assert car.step(100 * bit)["pwm"] == 0, bit


def test_of_damaged_frames_that_pass_the_check_few_move_the_car(library):
    draw, moved = random.Random(1), 0
    for _ in range(20_000):
        car = Car(library)
        car.receive(b"\xff\xfe\x04\x00\xfb\x65\x00" + draw.randbytes(5), 0)
        moved += car.step()["brake"] == 0
    assert moved <= 5  # one in 256 passes, and 41 would have moved it by absurd values


def test_what_was_cut_off_is_forgotten_after_20_ms(car):
    whole = pack(Frame(DRIVE, pack_float(0.4)))
    car.receive(whole[:6], 0)
    car.receive(whole[6:], 21)
    assert car.step(21)["pwm"] == 0
    car.receive(whole[:6], 30)
    car.receive(whole[6:], 50)
    assert car.step(50)["pwm"] == 102


def test_ticks_wrap_so_that_each_one_is_told_exactly(library):
    for ticks in (0, 1, -1, 8_388_607, -8_388_608):
        assert library.ticks_as_told(ticks) == ticks
    assert library.ticks_as_told(8_388_608) == -8_388_608
    assert library.ticks_as_told(-8_388_609) == 8_388_607
    assert library.ticks_as_told(2**31 - 1) == -1
    assert library.ticks_as_told(-(2**31)) == 0


def test_a_wheel_that_turns_forward_counts_up_at_each_edge_of_channel_a(library):
    forward = [(1, 0), (0, 1)]
    assert [library.one_step(a, b, 1) for a, b in forward] == [1, 1]
    assert [library.one_step(a, b, -1) for a, b in forward] == [-1, -1]
    assert [library.one_step(a, 1 - b, 1) for a, b in forward] == [-1, -1]


def set_readings(library, accel_x, accel_y, gyro_z):
    for where, value in ((0x3B, accel_x), (0x3D, accel_y), (0x47, gyro_z)):
        high, low = struct.pack(">h", value)
        library.imu_set(where, high)
        library.imu_set(where + 1, low)


def take(library):
    out = (ctypes.c_float * 3)()
    library.imu_take(out)
    return tuple(out)


def test_the_imu_is_woken_and_the_mean_of_its_samples_told_in_si_units(library):
    library.imu_new(1)
    library.imu_set(0x75, 0x71)
    library.imu_step(0)
    woken = [library.imu_get(where) for where in (0x6B, 0x1A, 0x19, 0x1B, 0x1C, 0x1D)]
    assert woken == [1, 3, 4, 0, 0, 3]
    set_readings(library, 16384, -8192, 1310)
    library.imu_step(10)
    set_readings(library, 16384, -8192, 1312)
    library.imu_step(20)
    expected = (math.radians(1311 / 131.072), 9.80665, -4.903325)
    assert take(library) == pytest.approx(expected, rel=1e-5)
    library.imu_step(25)
    assert take(library) == pytest.approx(expected, rel=1e-5)
    set_readings(library, 0, 0, 100)
    library.imu_step(30)
    assert take(library) == pytest.approx((math.radians(100 / 131.072), 0, 0), rel=1e-5)


def test_an_imu_that_is_not_there_is_asked_once_a_second_and_gives_nan(library):
    library.imu_new(0)
    for now_ms in range(0, 500, 10):
        library.imu_step(now_ms)
    assert all(map(math.isnan, take(library)))
    library.imu_answers(1)
    library.imu_set(0x75, 0x71)
    library.imu_step(999)
    assert library.imu_reads() == 0
    library.imu_step(1000)
    set_readings(library, 1, 1, 1)
    library.imu_step(1010)
    assert not any(map(math.isnan, take(library)))


def test_an_imu_that_lost_its_power_for_a_moment_is_woken_again(library):
    library.imu_new(1)
    library.imu_set(0x75, 0x71)
    library.imu_step(0)
    set_readings(library, 1, 2, 3)
    library.imu_step(10)
    set_readings(library, 0, 0, 0)
    library.imu_set(0x6B, 0x40)
    library.imu_step(20)
    assert all(map(math.isnan, take(library)))
    library.imu_step(1020)
    assert library.imu_get(0x6B) == 1


def test_another_chip_at_the_imu_s_address_is_left_alone(library):
    library.imu_new(1)
    library.imu_set(0x75, 0x68 ^ 0x40)
    library.imu_step(0)
    assert library.imu_get(0x1A) == 0
    assert all(map(math.isnan, take(library)))
