"""Every key that a script may say, what it wishes, and what becomes of nonsense."""

import math

import pytest

from vehicle_agent.devkit.commands import Commands

SAID = {"V1 Throttle": "0.5", "V1 Steering": "-0.25"}


def read(more=None, cars=1, lights=0, sign="left", base=SAID):
    commands = Commands(cars, sign)
    commands.lights = lights
    wishes = commands.read({**base, **(more or {})})
    return wishes, sorted(commands.complaints)


def car(more=None, **how):
    return read(more, **how)[0].cars[0]


def test_throttle_and_steering_are_taken_plus_is_forward_and_left():
    wish = car()
    assert (wish.throttle, wish.steering) == (0.5, -0.25)
    assert read()[1] == []


def test_the_keys_of_the_oldest_scripts_are_understood():
    old = {"Throttle": "0.5", "Steering": "-0.25", "Headlights": "1", "Indicators": "3"}
    wishes, complaints = read({"Traffic Light 2": "3"}, lights=2, base=old)
    wish = wishes.cars[0]
    assert (wish.throttle, wish.steering) == (0.5, -0.25)
    assert (wish.headlights, wish.indicators) == ("low", "hazard")
    assert wishes.lights == (None, 3)
    assert complaints == []


def test_the_steering_sign_can_be_turned():
    assert car(sign="right").steering == 0.25


@pytest.mark.parametrize(
    ("value", "name"), [("0", "off"), ("1", "low"), ("2", "high"), (2, "high")]
)
def test_headlights(value, name):
    assert car({"V1 Headlights": value}).headlights == name


@pytest.mark.parametrize(
    ("value", "name"), [("0", "off"), ("1", "left"), ("2", "right"), ("3", "hazard")]
)
def test_indicators(value, name):
    assert car({"V1 Indicators": value}).indicators == name


def test_lights_that_are_not_said_stay_as_they_are():
    assert (car().headlights, car().indicators) == (None, None)


@pytest.mark.parametrize("value", ["0", "1", "2", "3"])
def test_a_traffic_light_is_a_number(value):
    wishes, complaints = read({"TL2 State": value}, lights=2)
    assert wishes.lights == (None, int(value))
    assert complaints == []


@pytest.mark.parametrize(("value", "wished"), [("1", True), ("True", True), ("0", False)])
def test_reset(value, wished):
    assert car({"V1 Reset": value}).reset is wished


@pytest.mark.parametrize("key", ["Brake", "Handbrake"])
def test_a_brake_is_no_throttle(key):
    assert car({f"V1 {key}": "0.3"}).throttle == 0.0
    assert car({f"V1 {key}": "0"}).throttle == 0.5
    assert read({f"V1 {key}": "0"})[1] == []


POSE = {"CoSim": "1", "PosX": "1.5", "PosY": "-2", "PosZ": "0", "RotX": "0", "RotY": "0"}
POSE = {f"V1 {key}": value for key, value in POSE.items()}


@pytest.mark.parametrize("yaw", [0.5, -2.5])
def test_cosim_is_a_pose_of_a_quaternion(yaw):
    more = {"V1 RotZ": str(math.sin(yaw / 2)), "V1 RotW": str(math.cos(yaw / 2))}
    assert car({**POSE, **more}).pose == pytest.approx((1.5, -2.0, yaw))


def test_cosim_zero_is_no_pose():
    assert car({**POSE, "V1 CoSim": "0", "V1 RotZ": "0", "V1 RotW": "1"}).pose is None


@pytest.mark.parametrize("more", [{"V1 RotZ": "0"}, {"V1 RotZ": "0", "V1 RotW": "0"}])
def test_a_pose_that_is_none_is_told(more):
    wishes, (complaint,) = read({**POSE, **more})
    assert wishes.cars[0].pose is None
    assert complaint.startswith("V1 ")


@pytest.mark.parametrize("value", ["nan", "inf", "fast", "None", None, [], {}, "1e999", 10**400])
def test_a_throttle_that_is_no_number_is_none_and_told_once(value):
    commands = Commands(1)
    for _ in range(3):
        assert commands.read({**SAID, "V1 Throttle": value}).cars[0].throttle == 0.0
    assert sorted(commands.complaints) == ["V1 Throttle"]


def test_a_steering_that_is_no_number_is_the_last_one():
    commands = Commands(1)
    commands.read(SAID)
    assert commands.read({**SAID, "V1 Steering": "left"}).cars[0].steering == -0.25


@pytest.mark.parametrize(("value", "cut"), [("7", 1.0), ("-1.001", -1.0)])
def test_beyond_one_is_cut_and_told(value, cut):
    assert car({"V1 Throttle": value}).throttle == cut
    assert read({"V1 Throttle": value})[1] == ["V1 Throttle"]


def test_a_car_of_which_nothing_is_said_gets_nothing():
    wishes, complaints = read(cars=2)
    assert (wishes.cars[1].throttle, wishes.cars[1].steering) == (0.0, 0.0)
    assert complaints == [
        "V2 Steering: missing, expected a number from -1 to 1",
        "V2 Throttle: missing, expected a number from -1 to 1",
    ]


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("V2 Throttle", "expected V1 to V1"),
        ("V1 Thruttle", "expected one of Throttle"),
        ("TL1 State", "expected V1"),
        ("Weather", "not supported"),
        ("Fog", "not supported"),
        ("", "unknown"),
    ],
)
def test_a_key_that_is_not_known_is_told_and_the_others_count(key, words):
    wishes, (complaint,) = read({key: "1"})
    assert words in complaint
    assert wishes.cars[0].throttle == 0.5


@pytest.mark.parametrize("data", [None, [], "text", 5, {}])
def test_a_reply_that_is_none_is_no_throttle(data):
    commands = Commands(1)
    assert commands.read(data).cars[0].throttle == 0.0
    assert commands.complaints


def test_no_flood_of_nonsense_is_kept():
    commands = Commands(1)
    for number in range(1000):
        commands.read({**SAID, f"V{number} x": "1"})
    assert len(commands.complaints) <= 100


@pytest.mark.parametrize("key", ["V1 Headlights", "V1 Indicators", "TL1 State"])
@pytest.mark.parametrize("value", ["4", "-1", "0.5", "on"])
def test_a_choice_beyond_the_known_ones_is_none_and_told(key, value):
    wishes, (complaint,) = read({key: value}, lights=1)
    assert complaint == key
    assert wishes.cars[0].throttle == 0.5
    assert wishes.lights == (None,)


@pytest.mark.parametrize("key", ["Throttle", "Brake", "Headlights", "Reset", "CoSim"])
def test_a_value_of_any_depth_is_none(key):
    deep = []
    for _ in range(2000):
        deep = [deep]
    wishes, complaints = read({f"V1 {key}": deep})
    assert wishes.cars[0].pose is None
    assert complaints == ([f"V1 {key}"] if key not in ("Reset", "CoSim") else [])


def test_a_long_key_is_cut():
    _, (complaint,) = read({"k" * 1_000_000: "1"})
    assert len(complaint) < 120


def test_a_missing_throttle_is_told_after_any_number_of_strange_keys():
    commands = Commands(1)
    for number in range(300):
        commands.read({**SAID, f"x{number}": "1"})
    commands.read({"V1 Steering": "0"})
    assert any(what.startswith("V1 Throttle: missing") for what in commands.complaints)
