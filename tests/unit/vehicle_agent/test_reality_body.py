"""A car of the independent reality as an agent's body: its numbers change, which nobody reports."""

import math

import numpy as np
import pytest

from scm.clock import NS_PER_S
from scm.errors import RunError
from scm.geometry import Pose2
from scm.vehicles.car import load_car
from tests.reality.motion import Moving
from tests.reality.numbers import nominal
from vehicle_agent.__main__ import main
from vehicle_agent.bodies import reality as of_reality
from vehicle_agent.bodies.reality import RealityBody, changing
from vehicle_agent.bodies.simulated import SimulatedBody

TICK_NS = NS_PER_S // 50
BEGIN_NS = 100 * NS_PER_S


def drive(body, until_s):
    """Return heading, encoder and gyro after each second of half throttle."""
    body.place(Pose2(0.0, 0.0, 0.0), BEGIN_NS)
    body.command(0.5, 0.0)
    found = []
    for tick in range(1, round(until_s * 50) + 1):
        now_ns = BEGIN_NS + tick * TICK_NS
        body.advance(now_ns)
        readings = body.sensors("n1", now_ns)
        if tick % 50 == 0:
            found.append((body.pose.yaw, readings[0].encoder_left, readings[0].gyro_radps[2]))
    return np.array(found)


def test_car_drives_straight_until_its_steering_is_trimmed():
    yaw = drive(changing("nigel", 1, "own", "steer_trim", strength=4.0, after_s=2.0), 4.0)[:, 0]
    assert np.abs(yaw[:2]).max() < 1e-6
    assert np.abs(np.diff(yaw[1:])).min() > 0.01


def test_what_comes_for_a_while_is_gone_again():
    body = changing("nigel", 1, "own", "steer_trim", "intermittent", 4.0, 1.0, 2.0)
    yaw = drive(body, 6.0)[:, 0]
    assert abs(yaw[2] - yaw[0]) > 0.01
    assert yaw[5] == pytest.approx(yaw[4], abs=1e-4)


def test_ramp_grows():
    yaw = drive(changing("nigel", 1, "own", "steer_trim", "ramp", 4.0, 0.0, 4.0), 4.0)[:, 0]
    turned = np.abs(np.diff(yaw))
    assert turned[2] > turned[1] > turned[0] > 0.0


def test_faults_of_sensors_do_not_throw_counts_back():
    given = nominal("nigel")
    lost = of_reality.reality("sensing").FAULTS
    faults = [lost, lost | {"lost_counts": 0.5, "gyro_bias": 1.0}]
    body = RealityBody(
        "nigel", Moving, lambda *_: given, np.random.default_rng(0),
        lambda now_ns, _: faults[now_ns > BEGIN_NS + 2 * NS_PER_S],
    )  # fmt: skip
    counts, gyro = drive(body, 4.0)[:, 1:].T
    per_s = np.diff(counts)
    assert per_s[2] == pytest.approx(0.5 * per_s[0], rel=0.2)
    assert gyro[3] - gyro[1] == pytest.approx(1.0, abs=0.1)


def test_it_drives_on_after_the_commands_that_it_had_room_for(monkeypatch):
    monkeypatch.setattr(of_reality, "MORE_COMMANDS", 60)
    x = []
    body = changing("nigel", 1, "own")
    body.place(Pose2(0.0, 0.0, 0.0), BEGIN_NS)
    body.command(0.5, 0.0)
    for second in range(1, 6):
        body.advance(BEGIN_NS + second * NS_PER_S)
        x.append(body.pose.x)
    assert min(np.diff(x)) > 0.1


def test_lateral_speed_is_that_of_the_rear_axle_which_hardly_slips():
    body = changing("nigel", 1, "own")
    body.place(Pose2(0.0, 0.0, 0.0), BEGIN_NS)
    body.command(0.5, 1.0)
    body.advance(BEGIN_NS + 3 * NS_PER_S)
    motion = body.motion()
    assert abs(motion.yaw_rate) > 0.3
    assert abs(motion.lateral_speed) < 0.003


def test_commands_of_20_hz_and_of_an_agent_move_a_car_alike():
    given = nominal("nigel")
    ends = []
    for command_ns in (NS_PER_S // 20, TICK_NS):
        body = RealityBody(
            "nigel", Moving, lambda *_: given, np.random.default_rng(0), command_ns=command_ns
        )
        drive(body, 2.0)
        ends.append(body.pose.x)
    assert ends[0] == pytest.approx(ends[1], abs=2e-4)


def test_it_drives_as_our_own_car_whose_wheels_have_a_motor_each(tmp_path):
    head, section, rest = load_car("nigel").path.read_text("utf-8").partition("[drive]")
    path = tmp_path / "nigel.toml"
    comment, _, rest = rest.partition("\n")
    path.write_text(f"{head}{section}{comment}\naxle_lock = {{ value = 1.0 }}\n{rest}", "utf-8")
    given, ends = nominal("nigel"), []
    theirs = RealityBody("nigel", Moving, lambda *_: given, np.random.default_rng(0))
    for body in (theirs, SimulatedBody(str(path), 0)):
        body.place(Pose2(0.0, 0.0, 0.0), BEGIN_NS)
        for tick in range(1, 301):
            body.command(0.7, 0.5 if tick < 150 else -0.5)
            body.advance(BEGIN_NS + tick * TICK_NS)
        ends.append(body.motion().pose)
    assert math.hypot(ends[0].x - ends[1].x, ends[0].y - ends[1].y) < 0.003
    assert ends[0].yaw == pytest.approx(ends[1].yaw, abs=0.003)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--body", "reality", "--engine", "bullet"], "expected one of own, mujoco"),
        (["--body", "reality", "--conceal", "wind"], "own cars can have drive_delay"),
        (["--body", "reality", "--car", "nothing"], "got 'nothing'"),
        (["--body", "reality", "--lasts-s", "nan"], "--lasts-s: expected 0 or more, got nan"),
        (["--body", "reality", "--becomes", "nigel"], "whose cars change by --conceal"),
        (["--body", "reality", "--serial", "/dev/null"], "no real one (--serial)"),
        (["--conceal", "steer_trim"], "only a car of --body reality"),
    ],
)
def test_what_is_not_possible_is_refused_in_words(arguments, words, capsys):
    joining = ["join", "--name", "n1", "--connect", "tcp/127.0.0.1:1"]
    assert main([*joining, *arguments]) == 2
    assert words in capsys.readouterr().err


def test_without_a_clone_it_says_so(monkeypatch):
    monkeypatch.setattr(of_reality, "REALITY", "no_such_clone.reality")
    with pytest.raises(RunError, match="run this in a clone of it"):
        changing("nigel", 1, "own")
