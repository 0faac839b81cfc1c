"""From the pins to the floor, and what is told of it; in virtual time."""

import math
from fnmatch import fnmatchcase
from itertools import pairwise

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.v2x.exchange import Incoming
from scm.v2x.key import key_of, prefix, selector
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from scm.v2x.rights import rights_of
from scm.vehicles.car import load_car
from vehicle_agent.bodies.simulated import Change
from vehicle_agent.emulate.part import EmulatorPart, place_of, station_of
from vehicle_agent.emulate.sketches import SKETCHES, Outputs
from vehicle_agent.emulate.wheels import Wheels, throttle_of, wheel_angle

CITY = load_map("driving_school")
TWO, FOUR = SKETCHES["2wd"], SKETCHES["4wd"]


def pins(u, steer=0.0, sketch=TWO):
    return sketch.drive(sketch.steer(sketch.at_setup, steer), u)


def drive(wheels, now_ns, seconds, state):
    for _ in range(int(seconds / 0.02)):
        now_ns += 20 * NS_PER_MS
        wheels.advance(state, now_ns)
    return now_ns


def placed(deadband=0.2):
    wheels = Wheels(TWO.at_setup, deadband=deadband)
    wheels.place(Pose2(0.0, 0.0, 0.0), 0)
    return wheels


@pytest.mark.parametrize(
    ("u", "left"),
    [(0.1, 0.0), (0.19, 0.0), (0.4, 0.2), (-0.4, -0.2), (1.0, 0.8), (-1.0, -0.8), (0.0, 0.0)],
)
def test_the_dead_band_takes_its_share(u, left):
    assert throttle_of(pins(u), 0.2) == pytest.approx(left, abs=0.005)


def test_a_wrapped_throttle_creeps():
    assert throttle_of(pins(1.2), 0.0) == pytest.approx(51 / 256)


@pytest.mark.parametrize("u", [1.0, 0.5, -0.5, -1.0])
def test_the_road_wheels_turn_30_degrees_at_full_command(u):
    assert wheel_angle(pins(0.0, u), TWO.at_setup) == pytest.approx(math.radians(30 * u), abs=0.01)
    mean = wheel_angle(pins(0.0, u, FOUR), FOUR.at_setup)
    assert mean == pytest.approx(math.radians(30 * u), abs=0.02)


def test_it_drives_as_fast_as_the_motor_is_driven_beyond_the_dead_band():
    wheels = placed()
    drive(wheels, 0, 2.0, pins(0.6))
    assert wheels.motion().speed == pytest.approx(0.112, abs=0.002)  # the table's speed at 0.4


@pytest.mark.parametrize("stop", [pins(0.0), TWO.at_setup, Outputs()])
def test_it_stops_when_braked_and_when_the_motor_is_off(stop):
    wheels = placed()
    now_ns = drive(wheels, 0, 1.0, pins(1.0))
    assert wheels.motion().speed > 0.2
    drive(wheels, now_ns, 0.5, stop)
    assert wheels.motion().speed == pytest.approx(0.0, abs=1e-3)


def test_positive_steering_is_left_and_a_servo_without_pulses_stays():
    wheels = placed()
    now_ns = drive(wheels, 0, 1.0, pins(1.0, 0.5))
    assert wheels.motion().yaw_rate > 0.2
    drive(wheels, now_ns, 0.5, Outputs())
    assert wheels.motion().steering == pytest.approx(math.radians(15.0), abs=0.01)


def test_each_pin_counts_for_as_long_as_it_was_so_however_seldom_the_car_is_moved():
    gone = {}
    for every_ms in (1, 1000):
        wheels, board = placed(), Board()
        board.outputs, board.past = pins(0.0), []
        for ms in range(every_ms, 2001, every_ms):
            if ms == 1000:
                board.past = [(700 * NS_PER_MS, pins(0.0)), (950 * NS_PER_MS, pins(1.0))]
            if every_ms == 1:
                board.past, board.outputs = [], pins(1.0 if 700 < ms <= 950 else 0.0)
            wheels.follow(board, ms * NS_PER_MS)
        gone[every_ms] = wheels.motion().pose.x
    assert gone[1] > 0.03
    assert gone[1000] == pytest.approx(gone[1], abs=1e-4)


def test_a_car_rolls_on_while_its_computer_stalls():
    wheels = placed()
    wheels.advance(pins(1.0), NS_PER_S)
    before = wheels.motion().pose.x
    wheels.advance(pins(1.0), 3 * NS_PER_S)
    assert wheels.motion().pose.x - before == pytest.approx(2.0 * wheels.motion().speed, rel=0.01)


class Board:
    """A board whose pins a test sets."""

    outputs, past = pins(1.0), ()


class Desk:
    """What a part needs of a device."""

    firmware = Board()
    closed = False

    def step(self, now_ns):
        del now_ns

    def close(self):
        self.closed = True


def part(spawn=CITY.spawns[0].name, **more):
    return EmulatorPart("n7", Desk(), Wheels(TWO.at_setup), spawn, **more)


def world():
    return Incoming(WorldDefinition(t_ns=1, map=CITY, seed=0), 0)


def test_it_tells_where_it_is_fifty_times_a_second_once_it_knows_the_floor():
    emulator, told = part(tag_id=4), []
    for ms in range(0, 1000, 5):
        told += emulator.step(ms * NS_PER_MS, [])
    assert told == []
    for ms in range(1000, 2000, 5):
        told += emulator.step(ms * NS_PER_MS, [world()] if ms == 1000 else [])
    assert {type(message) for message in told} == {EmulatedPose}
    assert len(told) in (50, 51)
    start = place_of(CITY, "")
    gone = math.hypot(told[-1].x_m - start.x, told[-1].y_m - start.y)
    assert 0.15 < gone < 0.25
    assert (told[0].vehicle, told[0].tag_id, told[0].car) == ("n7", 4, "nigel")


def test_a_city_that_begins_anew_does_not_carry_the_car_away():
    emulator, told = part(), []
    for ms in range(0, 1000, 5):
        told += emulator.step(ms * NS_PER_MS, [world()] if ms in (0, 500) else [])
    steps = [math.hypot(b.x_m - a.x_m, b.y_m - a.y_m) for a, b in pairwise(told)]
    assert max(steps) < 0.01


def test_it_is_put_down_at_a_named_place_or_refuses():
    first, second = CITY.spawns[0], CITY.spawns[1]
    assert place_of(CITY, "") == place_of(CITY, first.name) != place_of(CITY, second.name)
    with pytest.raises(MapError, match="no spawn 'nowhere'"):
        place_of(CITY, "nowhere")


def car_at(place, vehicle="n1", speed_mps=0.0):
    pose = place_of(CITY, place.name)
    return SnapshotVehicle(
        vehicle=vehicle, kind="hosted", car="nigel", tag_id=1, x_m=pose.x, y_m=pose.y,
        yaw_rad=pose.yaw, speed_mps=speed_mps, steering_rad=0.0,
    )  # fmt: skip


def put_down(*cars, emulated=()):
    """Have an emulator look for a place for half a second; return its first word, if any."""
    emulator, told = part(""), []
    seen = WorldSnapshot(t_ns=1, tick=1, vehicles=cars)
    for ms in range(0, 500, 5):
        received_bytes = [world(), Incoming(seen, 0), *(Incoming(one, 0) for one in emulated)]
        told += emulator.step(ms * NS_PER_MS, received_bytes)
    return told[0] if told else None


def is_at(told, place):
    pose = place_of(CITY, place.name)
    return math.hypot(told.x_m - pose.x, told.y_m - pose.y) < 0.01


def test_without_a_named_place_it_is_put_down_where_no_car_stands():
    first, second, third = CITY.spawns[:3]
    assert is_at(put_down(), first)
    assert is_at(put_down(car_at(first)), second)
    pose = place_of(CITY, second.name)
    other = EmulatedPose(
        vehicle="n8", t_ns=0, x_m=pose.x, y_m=pose.y, yaw_rad=pose.yaw, speed_mps=0.0
    )
    assert is_at(put_down(car_at(first), emulated=[other]), third)
    assert is_at(put_down(car_at(first, "n7")), first)  # its own agent's idea of it


def test_where_no_place_is_free_it_waits_and_says_so_once(caplog):
    assert put_down(*(car_at(place, place.name) for place in CITY.spawns)) is None
    assert caplog.text.count("no_free_place") == 1


def test_it_does_not_listen_to_other_cars_once_it_stands():
    emulator = part()
    emulator.step(0, [world()])
    assert [subscriptions.kind for subscriptions in emulator.subscriptions] == [WorldDefinition]


def test_it_takes_the_cable_away_at_the_end():
    emulator = part()
    emulator.finish(0)
    assert emulator._device.closed


def test_a_guarded_city_lets_it_say_the_truth_and_no_vehicle_hear_it():
    key = key_of("city", EmulatedPose(vehicle="n7", t_ns=0, x_m=0, y_m=0, yaw_rad=0, speed_mps=0))
    key = key.removeprefix(prefix("city"))
    rights = rights_of("emulator", station_of("n7"))
    assert any(fnmatchcase(key, pattern) for pattern in rights.publishes)
    received_bytes = [selector("city", wish.kind, wish.where) for wish in part().subscriptions]
    assert [prefix("city") + pattern for pattern in rights.subscribes] == received_bytes
    assert not any(fnmatchcase(key, pattern) for pattern in rights_of("vehicle", "n7").subscribes)
    assert any(fnmatchcase(key, pattern) for pattern in rights_of("part", "eye").subscribes)


def test_it_becomes_a_car_with_a_weaker_motor(tmp_path):
    text = load_car("nigel").path.read_text("utf-8")
    weak = tmp_path / "weak.toml"
    text = text.replace("terms = [", 'terms = ["drive_gain",', 1)
    head, _, rest = text.partition("[drive]")
    rest = rest.partition("\n")[2]
    weak.write_text(f"{head}[drive]\ngain = {{ value = 0.5 }}\n{rest}", "utf-8")
    wheels = Wheels(TWO.at_setup, change=Change(str(weak), 3.0))
    wheels.place(Pose2(0.0, 0.0, 0.0), 0)
    now_ns = drive(wheels, 0, 2.9, pins(0.7))
    before_mps = wheels.motion().speed
    drive(wheels, now_ns, 3.0, pins(0.7))
    assert wheels.motion().speed < 0.7 * before_mps
