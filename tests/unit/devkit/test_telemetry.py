"""Every key of the simulator's packet: what it carries, and that it is always there."""

import base64
import gzip
import json
import math
import zlib

import cv2
import numpy as np
import pytest

from scm.records.signals import SignalGroup
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from vehicle_agent.devkit.telemetry import Telemetry, quaternion

KEYS = {
    "Throttle", "Steering", "Speed", "Encoder Ticks", "Encoder Angles", "Position",
    "Orientation Quaternion", "Orientation Euler Angles", "Angular Velocity",
    "Linear Acceleration", "LIDAR Scan Rate", "LIDAR Range Array", "LIDAR Intensity Array",
    "Front Camera Image", "Rear Camera Image",
}  # fmt: skip
G = 9.80665


def state(vehicle="n1", **more):
    told = {
        "vehicle": vehicle, "t_ns": 1, "seq": 1, "x_m": 1.25, "y_m": -0.5, "yaw_rad": -0.25,
        "speed_mps": -0.125, "yaw_rate_radps": 0.75, "steering_rad": 0.375, "throttle": -0.5,
        "accel_mps2": 0.0625, "source": "simulated",
    }  # fmt: skip
    return VehicleState(**told | more)


def sensors(**more):
    told = {
        "vehicle": "n1", "t_ns": 1, "encoder_left": 960, "encoder_right": -1920,
        "accel_mps2": (1.0, 2.0, G + 3.0), "gyro_radps": (0.1, 0.2, 0.3),
        "orientation_rad": (0.0, 0.0, -0.25), "throttle": 0.25, "steering_rad": -0.125,
    }  # fmt: skip
    return VehicleSensors(**told | more)


def scan(ranges, **more):
    told = {"vehicle": "n1", "t_ns": 1, "range_min_m": 0.15, "range_max_m": 12.0}
    payload = np.array(ranges, "<f4").tobytes()
    return LidarScan(**told, beams=len(ranges), payload=payload, **more)


def frame(camera, payload):
    return CameraFrame(
        vehicle="n1", camera=camera, t_ns=1, width_px=2, height_px=2, payload=payload
    )


def telemetry(
    *messages, names=("n1",), heads=(("crossing", "a"), ("crossing", "b")), version="0.3"
):
    made = Telemetry(names, version)
    made.show_lights(heads)
    for name in names:
        made.add_car(name, "nigel", load_car("nigel"))
        made.update(state(name))
    for message in messages:
        made.update(message)
    return made


def inflated(message):
    return zlib.decompressobj(-zlib.MAX_WBITS).decompress(message + b"\0\0\xff\xff").decode()


def packet(made):
    told = made.packet()
    text = told.text(7)
    assert inflated(told.deflated(7)) == text
    assert text.startswith("427")
    name, data = json.loads(text[3:])
    assert name == "Bridge"
    return data


def told(*messages):
    return {key[3:]: value for key, value in packet(telemetry(*messages)).items()}


def test_there_is_no_packet_before_the_lights_are_known():
    made = Telemetry(["n1"])
    made.add_car("n1", "nigel", load_car("nigel"))
    made.update(state("n1"))
    assert made.packet() is None
    made.show_lights([])
    assert made.packet() is not None


def test_every_key_is_in_the_first_packet_as_a_string():
    data = packet(telemetry())
    assert set(data) == {f"V1 {key}" for key in KEYS} | {"TL1 State", "TL2 State"}
    assert {type(value) for value in data.values()} == {str}


def test_the_oldest_packet_has_bare_keys_and_no_lights():
    assert set(packet(telemetry(version="0.1"))) == KEYS


def test_the_newest_packet_has_its_ranges_packed_one_a_line():
    heard = scan([0.5, math.inf, 12.0] + [1.0] * 357)
    newest, plain = (packet(telemetry(heard, version=v)) for v in ("newest", "0.3"))
    lines = gzip.decompress(base64.b64decode(newest["V1 LIDAR Range Array"])).decode()
    assert "\n" in lines
    ranges, known = np.fromstring(lines, sep="\n"), plain["V1 LIDAR Range Array"].split()
    assert ranges.tolist() == [float(one) for one in known]
    assert set(newest) == set(plain)


def test_every_car_and_light_has_its_number():
    data = packet(telemetry(names=("n7", "n1"), heads=()))
    assert set(data) == {f"V{number} {key}" for key in KEYS for number in (1, 2)}
    made = telemetry(state("n1", speed_mps=0.5), state("n7", speed_mps=1.0), names=("n7", "n1"))
    assert [packet(made)[f"V{n} Speed"] for n in (1, 2)] == ["1.0000", "0.5000"]


def test_there_is_no_packet_before_all_cars_are_known():
    made = Telemetry(["n1", "n2"])
    made.add_car("n1", "nigel", load_car("nigel"))
    made.update(state("n1"))
    assert made.packet() is None
    assert made.unknown == ["n2"]


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("Throttle", "0.2500"),
        ("Steering", "-0.1250"),
        ("Speed", "-0.1250"),
        ("Encoder Ticks", "960 -1920"),
        ("Encoder Angles", "3.1416 -6.2832"),
        ("Position", "1.2500 -0.5000 0.0325"),
        ("Orientation Quaternion", "0.0000 0.0000 -0.1247 0.9922"),
        ("Orientation Euler Angles", "0.0000 0.0000 6.0332"),
        ("Angular Velocity", "0.1000 0.2000 0.3000"),
        ("Linear Acceleration", "1.0000 2.0000 3.0000"),
        ("LIDAR Scan Rate", "7.0000"),
    ],
)
def test_a_key_carries_what_the_sensors_say(key, value):
    assert told(sensors())[key] == value


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("Throttle", "-0.5000"),
        ("Steering", "0.3750"),
        ("Encoder Ticks", "0 0"),
        ("Orientation Euler Angles", "0.0000 0.0000 6.0332"),
        ("Angular Velocity", "0.0000 0.0000 0.7500"),
        ("Linear Acceleration", "0.0625 0.0000 0.0000"),
    ],
)
def test_a_car_without_sensors_tells_what_it_believes(key, value):
    assert told()[key] == value


def test_gravity_is_taken_out_of_a_car_that_leans():
    roll, pitch = 0.2, -0.1
    up = (
        -G * math.sin(pitch),
        G * math.cos(pitch) * math.sin(roll),
        G * math.cos(pitch) * math.cos(roll),
    )
    data = told(sensors(accel_mps2=up, orientation_rad=(roll, pitch, 1.0)))
    assert [float(word) for word in data["Linear Acceleration"].split()] == [0.0, 0.0, 0.0]


def test_the_quaternion_turns_about_z_then_y_then_x():
    half = math.sqrt(0.5)
    assert quaternion((math.pi / 2, 0.0, 0.0)) == pytest.approx((half, 0.0, 0.0, half))
    assert quaternion((0.0, 0.0, math.pi / 2)) == pytest.approx((0.0, 0.0, half, half))
    # Roll first, pitch then, yaw last: three turns in a row are one turn by the quaternion.
    angles = (0.3, -0.4, 1.1)
    x, y, z, w = quaternion(angles)
    turned = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    roll, pitch, yaw = (cv2.Rodrigues(np.eye(3)[k] * angles[k])[0] for k in range(3))
    np.testing.assert_allclose(turned, yaw @ pitch @ roll, atol=1e-12)


def test_what_is_no_number_is_zero():
    assert told(sensors(throttle=math.nan))["Throttle"] == "0.0000"


def test_ranges_are_360_counter_clockwise_from_ahead():
    ranges = [1.0 + 0.001 * degree for degree in range(360)]
    ranges[90] = math.inf
    words = told(scan(ranges))["LIDAR Range Array"].split(" ")
    assert (words[0], words[1], words[90], words[359]) == ("1.0000", "1.0010", "inf", "1.3590")
    assert len(words) == 360


def test_without_a_scan_all_ranges_are_inf():
    assert set(told()["LIDAR Range Array"].split(" ")) == {"inf"}


@pytest.mark.parametrize("turns", [1, -1])
def test_a_scanner_of_part_of_a_circle_tells_its_own_beams_from_the_right(turns):
    ranges = [5.0, math.inf, *range(7, 1086)]
    step, first = turns * math.radians(0.25), -turns * 0.75 * math.pi
    made = scan(ranges[::turns], bearing_first_rad=first, bearing_step_rad=step)
    words = told(made)["LIDAR Range Array"].split(" ")
    assert words == ["5.0000", "inf", *(f"{one:.4f}" for one in range(7, 1086))]
    assert len(told(made)["LIDAR Intensity Array"].split(" ")) == len(ranges)


def test_before_its_first_scan_an_f1tenth_has_as_many_beams_as_after():
    made = Telemetry(("n1",))
    made.show_lights(())
    made.add_car("n1", "f1tenth", load_car("f1tenth"))
    made.update(state("n1"))
    beams = load_car("f1tenth").value("lidar.beams")
    assert packet(made)["V1 LIDAR Range Array"].split(" ") == ["inf"] * round(beams)


@pytest.mark.parametrize("ranges", [[], [1.0]])
def test_a_scan_of_hardly_any_beams_is_told(ranges):
    made = scan(ranges, bearing_step_rad=math.radians(0.25))
    assert told(made)["LIDAR Range Array"]


def test_intensities_are_the_simulators_constant():
    assert set(told()["LIDAR Intensity Array"].split(" ")) == {"47.0000"}
    assert len(told()["LIDAR Intensity Array"].split(" ")) == 360


def test_pictures_are_the_newest_jpeg():
    data = told(frame("front", b"old"), frame("front", b"new"), frame("rear", b"back"))
    assert base64.b64decode(data["Front Camera Image"]) == b"new"
    assert base64.b64decode(data["Rear Camera Image"]) == b"back"


@pytest.mark.parametrize("key", ["Front Camera Image", "Rear Camera Image"])
def test_before_the_first_picture_there_is_a_small_black_one_of_full_size_in_colour(key):
    jpeg = base64.b64decode(told()[key])
    assert len(jpeg) < 8000
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_UNCHANGED)
    assert image.shape == (720, 1280, 3)
    assert not image.any()


def test_what_a_new_script_sees_is_not_the_last_ones_picture():
    made = telemetry(frame("front", b"old"), scan([1.0] * 360))
    packet(made)
    made.forget_views()
    data = packet(made)
    assert base64.b64decode(data["V1 Front Camera Image"]) != b"old"
    assert set(data["V1 LIDAR Range Array"].split(" ")) == {"inf"}


def test_news_is_in_the_next_packet():
    made = telemetry()
    packet(made)
    made.update(state(speed_mps=0.25))
    assert packet(made)["V1 Speed"] == "0.2500"
    made.update(sensors(encoder_left=5))
    assert packet(made)["V1 Encoder Ticks"] == "5 -1920"


def spat(a, b="dark", t_ns=0):
    groups = [
        SignalGroup(group=name, colour=colour, since_ns=0, min_end_ns=0)
        for name, colour in (("a", a), ("b", b))
    ]
    return Spat(junction="crossing", t_ns=t_ns, seq=1, mode="plan", plan="p", groups=tuple(groups))


@pytest.mark.parametrize(
    ("colour", "number"), [("dark", "0"), ("red", "1"), ("yellow", "2"), ("green", "3")]
)
def test_a_light_shows_its_groups_colour(colour, number):
    data = packet(telemetry(spat("red", colour)))
    assert (data["TL1 State"], data["TL2 State"]) == ("1", number)


def test_a_flashing_light_is_red_for_half_of_each_second():
    shown = [
        packet(telemetry(spat("flashing_red", t_ns=t_ns)))["TL1 State"]
        for t_ns in (0, 499_999_999, 500_000_000, 1_000_000_000)
    ]
    assert shown == ["1", "1", "0", "1"]


def test_a_light_that_nobody_told_of_is_off():
    assert packet(telemetry())["TL1 State"] == "0"


def test_deflated_a_packet_is_hardly_larger_than_its_pictures_and_numbers_are_few():
    noise = np.random.default_rng(1).integers(0, 256, 20_000, np.uint8).tobytes()
    without, with_one = telemetry(), telemetry(frame("front", noise), scan([1.5] * 360))
    assert len(without.packet().deflated(1)) < 2500 < 15_000 < len(without.packet().text(1))
    assert len(with_one.packet().deflated(1)) < 1.03 * len(noise) + 2500
    assert len(with_one.packet().text(1)) > 1.3 * len(noise) + 10_000


def test_what_did_not_change_is_not_deflated_anew():
    made = telemetry(frame("front", b"jpeg"))
    before = [piece.deflated for piece in made.packet()._pieces]
    made.update(state(speed_mps=0.25))
    after = [piece.deflated for piece in made.packet()._pieces]
    assert [a is b for a, b in zip(after, before, strict=True)] == [False, *[True] * 4]
