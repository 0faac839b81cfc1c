"""`vehicle-agent calibrate` from its command line to its car file, without a bus."""

import re
from contextlib import nullcontext

import pytest

from scm import registry
from scm.runtime import live
from scm.v2x import bus_zenoh
from scm.v2x.exchange import Incoming
from scm.vehicles.car import load_car
from tests.unit.calibrate.rig import START, T0, Eye, Hidden, HiddenBody, drive
from tests.unit.test_real_guard import track
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
    more = ("--name", "tag-7", "--out", str(tmp_path), "--eye-delay-ms", "60")
    assert main([*ARGUMENTS, *FLOOR, *more, "--short"]) == 0
    car = load_car(tmp_path / "car.toml")
    assert car.value("ips.tag_id") == 7
    assert car.value("drive.deadband") == pytest.approx(0.15, abs=0.004)
    assert car.value("steering.trim_rad") == pytest.approx(0.03, abs=0.002)
    assert car.value("drive.delay_s") == pytest.approx(0.05, abs=0.004)
    assert (tmp_path / "drive" / "recording.yaml").is_file()
    said = capsys.readouterr().out
    assert "  drive.deadband" in said
    assert "the guard limited the car: pose 1" in said
    assert [line for line in said.splitlines() if line.endswith("% driven")] == [
        f"{percent} % driven" for percent in range(0, 101, 10)
    ]
    before, after = map(float, re.findall(r"by ([\d.]+) mm with th", said))
    assert after < 3.5 < 10.0 < before
    assert (tmp_path / "fit.svg").read_text(encoding="utf-8").count("<circle") > 20
    assert bodies[0].wired == ("simulated", Wiring(raw=True))
    assert bodies[0].is_closed


def test_an_agent_asks_for_the_tag_of_its_own_file_unless_it_is_told_another(tmp_path):
    from vehicle_agent.__main__ import build_parser
    from vehicle_agent.commands import join

    nigel = load_car("nigel").path.read_text()
    (tmp_path / "car.toml").write_text(nigel.replace("[ips]", "[ips]\ntag_id = { value = 7 }"))
    (tmp_path / "other.toml").write_text(nigel)
    own, other = (("--calibration", str(tmp_path / name)) for name in ("car.toml", "other.toml"))
    of = ("join", "--name", "n7", "--connect", "tcp/127.0.0.1:1")
    for commanded, tag_id in (((), None), (own, 7), ((*own, "--tag", "3"), 3), (other, None)):
        assert join._tag_of(build_parser().parse_args([*of, *commanded])) == tag_id


@pytest.mark.parametrize("cause", [RuntimeError, KeyboardInterrupt])
def test_a_real_car_is_let_go_of_and_what_it_drove_is_kept_however_the_drive_ends(
    bodies, monkeypatch, tmp_path, cause
):
    def fails(part, _bus, _clock, _stop):
        part.step(T0, [Incoming(track(T0, 1.0, 0.7), T0)])
        raise cause

    monkeypatch.setattr(live, "run", fails)
    more = ("--serial", "/dev/ttyUSB7", "--baud", "115200", "--out", str(tmp_path))
    with pytest.raises(cause):
        main([*ARGUMENTS, *FLOOR, *more])
    assert bodies[0].wired == ("nigel", Wiring(port="/dev/ttyUSB7", baud=115200, raw=True))
    assert bodies[0].is_closed
    assert (tmp_path / "drive" / "pose.csv").read_text().splitlines()[1].startswith("0.000000,1.0")


def test_a_drive_that_was_cut_off_is_kept_and_its_fit_refused(
    bodies, monkeypatch, tmp_path, capsys
):
    def run(part, _bus, _clock, _stop):
        part.step(T0, [Incoming(track(T0, 1.0, 0.7), T0)])

    monkeypatch.setattr(live, "run", run)
    assert main([*ARGUMENTS, *FLOOR, "--out", str(tmp_path)]) == 2
    assert "got a drive of 0.0 s, expected at least 20 s" in capsys.readouterr().err
    assert (tmp_path / "drive" / "recording.yaml").is_file()


def test_each_reason_to_wait_is_said_once_and_with_advice(capsys):
    on_progress = calibrate._Console()
    driven = [f"{percent} % driven" for percent in (3, 8, 12)]
    why = ["the Arduino starts", "slew, stop", "outside the floor"]
    for doing in ["waits (pose)", "waits (pose)", *driven, *(f"waits ({each})" for each in why)]:
        on_progress(doing)
    said = capsys.readouterr().out.splitlines()
    assert said == [
        "waits (pose): the Eye reports no pose of that name; a car that has not joined is called "
        "tag-ID",
        "0 % driven",
        "10 % driven",
        "waits (the Arduino starts)",
        "waits (slew, stop): the city is stopped",
        "waits (outside the floor): put it inside the rectangle of --floor, bumpers and all",
    ]


@pytest.mark.parametrize(
    ("floor", "said"), [("0 0 1.1 1.1", "1.10 m by 1.10 m"), ("0 0 0.9 3", "3.00 m by 0.90 m")]
)
def test_a_floor_without_room_to_turn_is_refused(bodies, tmp_path, capsys, floor, said):
    assert main([*ARGUMENTS, "--floor", *floor.split(), "--out", str(tmp_path)]) == 2
    expected = f"--floor: got {said}, expected at least 1.20 m by 0.99 m: room for this car to turn"
    assert expected in capsys.readouterr().err
    assert not bodies


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
