"""`vehicle-agent calibrate` from its command line to its car file, without a bus."""

from contextlib import nullcontext

import pytest

from scm import live, registry
from scm.v2x import bus_zenoh
from scm.vehicles.car import load_car
from tests.unit.calibrate.rig import START, Eye, Hidden, HiddenBody, drive
from vehicle_agent.__main__ import main
from vehicle_agent.body import BodyKind, Wiring
from vehicle_agent.commands import calibrate

ARGUMENTS = ("calibrate", "--name", "n7", "--connect", "tcp/127.0.0.1:1")
FLOOR = ("--floor", "2", "1.5", "0", "0")


@pytest.fixture
def bodies(monkeypatch):
    """Let a car with hidden numbers be the body, under an Eye, in virtual time."""
    made, name_of_body = [], ""

    def load(package, name, *more):
        nonlocal name_of_body
        if package != "vehicle_agent.bodies":
            return loaded(package, name, *more)
        name_of_body = name
        return BodyKind(kind="real", open=opened)

    def opened(car, seed, wiring):
        made.append(HiddenBody(Hidden(), START))
        made[-1].wired = name_of_body, wiring
        return made[-1]

    def run(part, _bus, _clock, _stop):
        drive(part, made[0], Eye(Hidden()), part.guard._limits)
        part.finish(0)

    loaded = registry.load
    monkeypatch.setattr(registry, "load", load)
    monkeypatch.setattr(live, "run", run)
    monkeypatch.setattr(bus_zenoh, "ZenohBus", lambda *_, **__: nullcontext())
    return made


def test_it_drives_writes_the_drive_and_the_car_and_says_what_it_found(bodies, tmp_path, capsys):
    assert main([*ARGUMENTS, *FLOOR, "--out", str(tmp_path), "--eye-delay-ms", "60"]) == 0
    car = load_car(tmp_path / "car.toml")
    assert car.value("drive.deadband") == pytest.approx(0.15, abs=0.004)
    assert car.value("steering.trim_rad") == pytest.approx(0.03, abs=0.002)
    assert car.value("drive.delay_s") == pytest.approx(0.05, abs=0.004)
    assert (tmp_path / "drive" / "recording.yaml").is_file()
    said = capsys.readouterr().out
    assert "  drive.deadband" in said
    assert "the guard held the car up: pose 1" in said
    assert bodies[0].wired == ("simulated", Wiring(raw=True))
    assert bodies[0].is_closed


@pytest.mark.parametrize("cause", [RuntimeError, KeyboardInterrupt])
def test_a_real_car_is_let_go_of_however_the_drive_ends(bodies, monkeypatch, cause):
    def fails(*_):
        raise cause

    monkeypatch.setattr(live, "run", fails)
    with pytest.raises(cause):
        main([*ARGUMENTS, *FLOOR, "--serial", "/dev/ttyUSB7", "--baud", "115200"])
    assert bodies[0].wired == ("nigel", Wiring(port="/dev/ttyUSB7", baud=115200, raw=True))
    assert bodies[0].is_closed


def test_the_limits_are_the_cars_own(bodies):
    from vehicle_agent.__main__ import build_parser

    more = ("--speed-limit", "0.5", "--top-speed", "0.4", "--car", "f1tenth")
    limits = calibrate._limits(build_parser().parse_args([*ARGUMENTS, *FLOOR, *more]))
    assert (limits.throttle, limits.top_speed_mps) == (0.5, 0.4)
    assert (limits.front_m, limits.rear_m, limits.width_m) == pytest.approx((0.42, 0.08, 0.27))
    assert limits.harmless == frozenset()
    assert limits.curvature_per_m == pytest.approx(0.5774 / 0.324, rel=1e-3)
    assert limits.fence == ((0.0, 0.0), (2.0, 0.0), (2.0, 1.5), (0.0, 1.5))


def test_a_tag_that_belongs_to_nobody_may_be_meant(bodies):
    from vehicle_agent.__main__ import build_parser

    for name, harmless in (("n7", set()), ("tag-7", {"unknown"})):
        arguments = build_parser().parse_args([*ARGUMENTS, *FLOOR, "--name", name])
        assert calibrate._limits(arguments).harmless == harmless


def test_a_floor_of_no_size_is_refused(bodies, tmp_path, capsys):
    assert main([*ARGUMENTS, "--floor", "0", "0", "0", "1", "--out", str(tmp_path)]) == 2
    assert "expected a convex polygon" in capsys.readouterr().err
