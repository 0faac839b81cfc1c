"""A simulated car that becomes another one, which it does not report."""

import pytest

from scm.clock import NS_PER_S
from scm.errors import CarError
from scm.geometry import Pose2
from scm.vehicles.car import load_car
from vehicle_agent.__main__ import main
from vehicle_agent.bodies.simulated import Change, SimulatedBody, both

TRIM = 0.1
TICK_NS = NS_PER_S // 50


@pytest.fixture
def trimmed(tmp_path):
    """The file of a Nigel with trimmed steering."""
    text = load_car("nigel").path.read_text("utf-8")
    head, section, rest = text.replace("terms = [", 'terms = ["steer_trim",', 1).partition(
        "[steering]"
    )
    path = tmp_path / "trimmed.toml"
    path.write_text(f"{head}{section}\ntrim_rad = {{ value = {TRIM} }}{rest}", "utf-8")
    return path


def yaws(body, until_s):
    """Return the heading after each second of driving straight on."""
    body.place(Pose2(0.0, 0.0, 0.0), 0)
    body.command(0.5, 0.0)
    found = []
    for tick in range(1, round(until_s * 50) + 1):
        body.advance(tick * TICK_NS)
        if tick % 50 == 0:
            found.append(body.motion().pose.yaw)
    return found


def test_car_drives_straight_until_its_steering_is_trimmed(trimmed):
    one, two, three, four = yaws(SimulatedBody("nigel", 1, Change(str(trimmed), 2.0)), 4.0)
    assert max(abs(one), abs(two)) < 1e-6
    assert three - two > 0.05
    assert four - three > 0.05


def test_until_then_it_drives_as_its_file_says(trimmed):
    as_filed = yaws(SimulatedBody("nigel", 1), 2.0)
    assert yaws(SimulatedBody("nigel", 1, Change(str(trimmed), 10.0)), 2.0) == pytest.approx(
        as_filed, abs=1e-9
    )


def test_only_numbers_that_differ_change(trimmed):
    able, numbers = both(load_car("nigel"), load_car(trimmed))
    assert numbers == {"steering.trim_rad": TRIM}
    assert able.value("steering.trim_rad") == 0.0


def test_file_that_is_missing_is_named():
    with pytest.raises(CarError, match=r"nothing\.toml"):
        SimulatedBody("nigel", 1, Change("nothing.toml", 2.0))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--serial", "/dev/null"], "a car that is simulated changes so"),
        (["--after-s", "-1"], "--after-s: expected 0 or more, got -1"),
    ],
)
def test_change_of_a_real_car_or_before_the_begin_is_refused(arguments, words, capsys):
    joining = ["join", "--name", "n1", "--connect", "tcp/127.0.0.1:1", "--becomes", "nigel"]
    assert main([*joining, *arguments]) == 2
    assert words in capsys.readouterr().err
