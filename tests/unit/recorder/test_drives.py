"""A run of the city is a recording of the cars that were commanded in it."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer
from numpy.testing import assert_allclose

from scm.__main__ import main
from scm.errors import RecordingError
from scm.fleet import LockstepLink
from scm.maps.load import load_map
from scm.mismatch.pipeline import diagnose
from scm.recorder.drives import read_drives, recordings_of
from scm.recorder.mcap_file import RunFile, read_run
from scm.recorder.part import RecorderPart
from scm.recorder.play import play, write_recording
from scm.replay.free_run import free_run
from scm.runtime.lockstep import Lockstep
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import RawSample
from scm.v2x.key import key_of
from scm.v2x.message import Message, encode
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart

MS = 1_000_000
START_NS = 1_700_000_000_000_000_000
ROWS = [(0.05 * k, 0.6 if 4 < k < 60 else 0.0, 0.3 if k > 20 else 0.0) for k in range(80)]


def city_run(path: Path, *driven: str, sparse: bool = False) -> Path:
    """Record a city of two cars that circulate until a script drives some of them, one by one."""
    world = WorldPart(load_map("parking_school"), hosted=(("n1", "nigel"), ("n2", "nigel")))
    with Lockstep([world, RecorderPart(path, sparse=sparse)]) as city:
        city.run_for(1.0)
        for name in driven:
            way = -1.0 if name == "n2" else 1.0  # ahead of n2 is a wall
            play(LockstepLink(city), name, [(t, way * u, steering) for t, u, steering in ROWS])
            city.run_for(0.5)
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return city_run(tmp_path_factory.mktemp("run") / "today.mcap", "n1", "n2")


def said(path: Path, *messages: Message) -> Path:
    """Write messages as a recorder would have heard them, each at its own time."""
    with RunFile(path, "city") as file:
        for one in sorted(messages, key=lambda one: one.t_ns):
            file.write(RawSample(key_of("city", one), *encode(one), t_ns=one.t_ns))
    return path


def hand_driven(path: Path, own_s: float, by_hand_s: float) -> Path:
    """Record two cars that drive themselves; the first is driven by hand in between."""
    city_map = load_map("driving_school")
    world = WorldPart(city_map, hosted=(("n1", "nigel"), ("n2", "nigel")))
    with Lockstep([world, TrafficPart(city_map), RecorderPart(path)]) as city:
        city.run_for(0.5 * own_s)
        turns = [0.1 * k for k in range(round(10 * by_hand_s))]
        rows = [(t, 0.25, 0.2 * math.sin(2.0 * t)) for t in turns]
        link = LockstepLink(city)
        play(link, "n1", [*rows, (by_hand_s, 0.0, 0.0)])
        link.request(RouteRequest(vehicle="n1"))
        city.run_for(0.5 * own_s)
    return path


def told(
    ms: int, throttle: float = 0.5, epoch: int = 3, seq: int | None = None, vehicle: str = "n1"
) -> DriveCommand:
    return DriveCommand(
        vehicle=vehicle, t_ns=START_NS + ms * MS, epoch=epoch, seq=ms if seq is None else seq,
        throttle=throttle, steering=0.2,
    )  # fmt: skip


def reported(ms: int, **other) -> VehicleState:
    fields = {
        "epoch": 3,
        "seq": ms,
        "source": "simulated",
        "x_m": ms / 1000,
        "y_m": 0.0,
        "yaw_rad": 0.1,
    }
    motion = {"speed_mps": 1.0, "yaw_rate_radps": 0.0, "steering_rad": 0.0, "throttle": 0.5}
    whole = {"vehicle": "n1"} | fields | motion | other
    return VehicleState(t_ns=START_NS + ms * MS, **whole)


def seen(ms: int, camera: str = "top", x_m: float = 0.0) -> EyePose:
    covariance = (4e-6, 0.0, 0.0, 0.0, 9e-6, 0.0, 0.0, 0.0, 1e-4)
    return EyePose(
        camera=camera, vehicle="n1", tag_id=1, t_ns=START_NS + ms * MS, x_m=x_m, y_m=0.0,
        yaw_rad=0.0, covariance=covariance,
    )  # fmt: skip


def test_the_same_car_replays_a_run_of_the_city(run: Path) -> None:
    drives = read_drives(run)
    assert [(drive.name, drive.vehicle) for drive in drives] == [("n1", "nigel"), ("n2", "nigel")]
    for drive, start_s in zip(drives, (2.0, 7.5), strict=True):
        free = free_run(drive, load_car("nigel"), horizon_s=1.0)
        assert len(free.start_s) == 4
        assert free.position_error()[:, -1].max() < 0.006
        x = drive.channel("pose.x")
        assert np.ptp(x.values) > 0.1
        assert x.t[0] == pytest.approx(start_s, abs=0.1), "before that the car stood"
        assert x.t[-1] == pytest.approx(start_s + 4.0, abs=0.1), "and so it did later"
        assert {"encoder.left", "encoder.right", "imu.gyro_z"} <= set(drive.channels)


def test_a_few_seconds_by_hand_do_not_hide_how_a_car_drove_itself(tmp_path: Path) -> None:
    path = hand_driven(tmp_path / "a.mcap", own_s=15.0, by_hand_s=4.0)
    by_hand, other = read_drives(path)
    assert (by_hand.name, other.name) == ("n1", "n2"), "nobody commanded n2"
    nigel = load_car("nigel")
    for drive in (by_hand, other):
        free = free_run(drive, nigel, horizon_s=3.0)
        assert len(free.start_s) == 6
        errors = free.position_error()[:, -1]
        assert errors[0] < 0.015, "a smoother knows speeds less well where poses begin"
        assert errors[1:].max() < 0.005, "also where the owner changes"


def test_replay_of_a_run_goes_on_where_one_car_cannot_be_driven_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    states = [reported(20 * k, seq=k, steering=0.1) for k in range(400)]
    unseen = [reported(20 * k, seq=k, vehicle="n2", source="odometry") for k in range(400)]
    sent = [told(ms, vehicle="n2") for ms in range(0, 8000, 100)]
    old = [reported(20 * k, seq=k, vehicle=name) for k in range(400) for name in ("n3", "n4")]
    path = said(tmp_path / "a.mcap", *states, *unseen, *sent, *old)
    assert main(["replay", str(path)]) == 0
    printed = capsys.readouterr()
    assert "n1, car nigel: 2 windows of 3 s" in printed.out
    assert "n2: no pose while it obeyed commands" in printed.err
    assert "n3, n4: not commanded over the bus, and no report tells the steering" in printed.err


def test_a_stretch_too_short_for_a_window_does_not_stop_the_longer_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    states = [
        reported(20 * k, seq=k, steering=0.1, mode="stop" if 400 < k < 700 else "drive")
        for k in range(820)
    ]
    assert main(["replay", str(said(tmp_path / "a.mcap", *states))]) == 0
    printed = capsys.readouterr().out
    assert "n1, car nigel: 2 windows of 3 s" in printed
    assert "poses left out: 299 while its guard stopped it" in printed


def test_each_of_two_owners_of_an_older_car_is_replayed_by_its_own_commands(tmp_path: Path) -> None:
    states = [reported(ms, epoch=3 if ms < 2000 else 4) for ms in range(0, 4000, 20)]
    first = [told(ms) for ms in range(0, 1000, 100)]
    second = [told(ms, -0.5, epoch=4) for ms in range(2500, 3500, 100)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, *first, *second))
    ms = np.round(drive.channel("pose.x").t * 1000)
    assert list(ms) == [*range(0, 1201, 20), *range(2500, 3701, 20)]
    throttle = drive.channel("command.throttle")
    assert set(throttle.values[throttle.t < 2.0]) == {0.5, 0.0}
    assert set(throttle.values[throttle.t > 2.0]) == {-0.5, 0.0}


def test_commands_come_from_the_bus_where_the_reports_do_not_tell_them(tmp_path: Path) -> None:
    states = [
        reported(20 * k, seq=k, steering=0.1 if k < 100 else None, throttle=0.3) for k in range(200)
    ]
    sent = [told(ms) for ms in range(2500, 4000, 100)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, *sent))
    ms = np.round(drive.channel("pose.x").t * 1000)
    assert list(ms) == [*range(1000, 2000, 20), *range(2500, 4000, 20)]
    steering = drive.channel("command.steering")
    assert set(steering.values[steering.t < 1.98]) == {0.1}
    assert set(steering.values[steering.t > 2.0]) == {0.2}


def test_what_a_run_tells_in_vain_is_counted(tmp_path: Path) -> None:
    states = [reported(20 * k, seq=k, steering=0.1) for k in range(200)]
    states[100:110] = [reported(20 * k, seq=k, steering=0.1, mode="stop") for k in range(100, 110)]
    hit = CityEvent(
        severity="warning", source="world", name="contact", text="", vehicle="n1",
        t_ns=START_NS + 3000 * MS,
    )  # fmt: skip
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, hit))
    left = len(drive.channel("pose.x").t)
    assert list(map(str, drive.left_out)) == [
        f"a.mcap: n1: {200 - left} of 200 poses left out: 55 until a second after a hit and 0.3 m "
        "away, 50 in the first second after it was placed, 10 while its guard stopped it",
    ]


def test_a_car_that_nobody_drives_does_not_count_once_it_stands(tmp_path: Path) -> None:
    states = [
        reported(20 * k, seq=k, steering=0.1, mode="idle", x_m=0.002 * min(k, 100))
        for k in range(300)
    ]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states))
    assert drive.channel("pose.x").t[[0, -1]].tolist() == [1.0, 2.98]
    assert "150 while it stood and nobody drove it" in drive.left_out[0].why


def test_poses_of_a_car_that_another_file_describes_are_left_out(tmp_path: Path) -> None:
    states = [
        reported(20 * k, seq=k, steering=0.1, car="f1tenth" if k < 100 else "nigel")
        for k in range(300)
    ]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states))
    assert drive.channel("pose.x").t[0] == 3.0
    assert list(map(str, drive.left_out)) == [
        "a.mcap: n1: 150 of 300 poses left out: 100 of a car that was a f1tenth, 50 in the first "
        "second after it was placed",
    ]


def test_a_sparse_run_is_replayed_from_its_snapshots(tmp_path: Path) -> None:
    (drive,) = read_drives(city_run(tmp_path / "sparse.mcap", "n1", sparse=True))
    free = free_run(drive, load_car("nigel"), horizon_s=1.0)
    assert free.position_error()[:, -1].max() < 0.005
    assert "imu.gyro_z" not in drive.channels


def test_replay_takes_a_run_and_one_of_its_cars(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(run), "--vehicle", "n2", "--horizon-s", "1"]) == 0
    printed = capsys.readouterr().out
    assert "n2, car nigel: 4 windows of 1 s" in printed
    assert "n1" not in printed


def test_mismatch_takes_a_run_of_several_cars_each_by_itself(run: Path, tmp_path: Path) -> None:
    assert main(["mismatch", str(run), "--out", str(tmp_path)]) == 0
    for car in ("n1", "n2"):
        assert (tmp_path / car / "report.html").is_file()
        assert f'href="{car}/report.html"' in (tmp_path / "report.html").read_text("utf-8")


def test_mismatch_goes_on_where_one_car_of_a_run_left_before_the_span(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    states = [reported(20 * k, seq=k, steering=0.1) for k in range(400)]
    states += [reported(20 * k, seq=k, steering=0.1, vehicle="n2") for k in range(200)]
    path = said(tmp_path / "a.mcap", *states)
    assert main(["mismatch", str(path), "--from-s", "5", "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out/report.html").is_file()
    assert "from 5 s: nothing of n2 was recorded there" in capsys.readouterr().err


def test_mismatch_takes_one_car_of_a_run(run: Path) -> None:
    with pytest.raises(RecordingError, match="cars can be driven again: n1, n2; say which with"):
        diagnose([run])
    found = diagnose([run], vehicle="n1", budget_s=0.0)
    assert found.car.name == "nigel"
    assert found.evidence.recordings == ("n1 of today",)


def test_a_drive_told_since_is_of_the_same_car_and_whole(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        "scm.mismatch.pipeline.diagnose_car", lambda recordings, *_, **__: recordings
    )
    with Lockstep([WorldPart(load_map("parking_school"), hosted=(("n9", "nigel"),))]) as city:
        city.run_for(0.1)
        played = play(
            LockstepLink(city), "n9", [(0.0, 0.0, 0.0), (0.2, 0.05, 0.0), (1.5, 0.0, 0.0)]
        )
    write_recording(played, "nigel", tmp_path / "told")
    told, part = [tmp_path / "told"], (2.0, 3.0)
    before, since = diagnose([run], vehicle="n1", span_s=part, played=told)
    assert np.ptp(before.channel("pose.x").t) <= 1.0
    assert np.ptp(since.channel("pose.x").t) == pytest.approx(1.5, abs=0.1)
    assert main(["mismatch", str(run), "--told", *map(str, told), "--out", str(tmp_path)]) == 2
    assert "told: a drive of one of n1, n2; say of which with --vehicle" in capsys.readouterr().err


def test_cars_that_drive_themselves_are_driven_again_from_what_they_report(tmp_path: Path) -> None:
    path, city_map = tmp_path / "self.mcap", load_map("driving_school")
    parts = [WorldPart(city_map, hosted=(("n1", "nigel"),)), TrafficPart(city_map)]
    with Lockstep([*parts, RecorderPart(path), AgentPart("n7")]) as city:
        city.run_for(8.0)
    hosted, remote = read_drives(path)
    assert (hosted.name, remote.name) == ("n1", "n7")
    for drive in (hosted, remote):
        assert np.ptp(drive.channel("command.steering").values) > 0.1
        free = free_run(drive, load_car("nigel"), horizon_s=3.0)
        assert len(free.start_s) == 2
        errors = free.position_error()[:, -1]
        assert errors[0] < 0.015, "a smoother knows speeds less well where poses begin"
        assert errors[1] < 0.0005, "20 ms too late would be 3 mm"


def test_a_car_whose_reports_do_not_tell_the_steering_is_refused(tmp_path: Path, run: Path) -> None:
    old = said(tmp_path / "old.mcap", *(reported(ms) for ms in range(0, 1000, 20)))
    with pytest.raises(RecordingError, match=r"none of its cars \(n1\) was commanded over the bus"):
        read_drives(old)
    with pytest.raises(RecordingError, match="n1 was not commanded over the bus, and no report"):
        read_drives(old, "n1")
    with pytest.raises(RecordingError, match=r"no car 'n11' \(did you mean 'n1'\?\)"):
        read_drives(run, "n11")


def test_commands_are_those_that_the_car_reports_from_the_report_before_on(tmp_path: Path) -> None:
    states = [reported(ms, seq=ms // 20, steering=0.4 - ms / 5000) for ms in range(0, 1000, 20)]
    del states[40]
    path = said(tmp_path / "a.mcap", *states, *(told(ms) for ms in range(100, 1000, 100)))
    (drive,) = read_drives(path)
    steering = drive.channel("command.steering")
    assert_allclose(steering.t, [s / 1000 for s in range(0, 980, 20) if s != 780], atol=1e-9)
    assert_allclose(steering.values, 0.4 - (steering.t + 0.02) / 5)
    assert drive.channel("pose.x").t[0] == 0.1, "before that nobody commanded it"


def test_commands_of_a_car_that_reports_seldom_begin_half_way_through_the_unknown(
    tmp_path: Path,
) -> None:
    states = [reported(60 * k, seq=k, steering=k / 100) for k in range(50)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states))
    steering = drive.channel("command.steering")
    assert_allclose(steering.t[:3], [0.02, 0.08, 0.14])
    assert_allclose(steering.values[:3], [0.01, 0.02, 0.03])


def test_a_car_that_is_placed_anew_does_not_count_until_its_servo_is_known(tmp_path: Path) -> None:
    states = [reported(ms, seq=ms // 20 % 100, steering=0.1) for ms in range(0, 4000, 20)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states))
    ms = np.round(drive.channel("pose.x").t * 1000)
    assert list(ms) == [*range(1000, 2000, 20), *range(3000, 4000, 20)]


def test_poses_count_only_while_the_car_obeys(tmp_path: Path) -> None:
    states = [reported(ms) for ms in range(0, 1000, 20)]
    states[12] = reported(240, mode="stop")
    states[20] = reported(400, epoch=4)
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, told(100), told(200), told(900)))
    ms = np.round(drive.channel("pose.x").t * 1000)
    assert list(ms) == [t for t in range(100, 501, 20) if t not in (240, 400)] + [
        900, 920, 940, 960, 980,
    ]  # fmt: skip


def test_poses_about_a_hit_do_not_count(tmp_path: Path) -> None:
    commands = [told(ms) for ms in range(0, 2000, 100)]
    hit = {"severity": "warning", "source": "world", "name": "contact", "text": "n1 hit wall"}
    events = [
        CityEvent(t_ns=START_NS + ms * MS, vehicle=who, **(hit | other))
        for ms, who, other in [(400, "n1", {}), (1600, "n2", {}), (1700, "n1", {"name": "parked"})]
    ]
    states = [reported(ms) for ms in range(0, 2000, 20)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, *commands, *events))
    ms = np.round(drive.channel("pose.x").t * 1000)
    assert list(ms) == [*range(0, 300, 20), *range(1420, 2000, 20)]


def test_a_car_that_leans_on_what_it_hit_does_not_count_until_it_is_away(tmp_path: Path) -> None:
    commands = [told(ms) for ms in range(0, 3000, 100)]
    hit = CityEvent(
        severity="warning", source="world", name="contact", text="", vehicle="n1",
        t_ns=START_NS + 200 * MS,
    )  # fmt: skip
    states = [reported(ms, x_m=max(0, ms - 2000) / 1000) for ms in range(0, 3000, 20)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, *commands, hit))
    assert list(np.round(drive.channel("pose.x").t * 1000)) == [
        *range(0, 100, 20), *range(2340, 3000, 20),
    ]  # fmt: skip


def test_a_late_command_lets_go_of_the_throttle_as_the_guard_does(tmp_path: Path) -> None:
    states = [reported(ms) for ms in range(0, 1000, 20)]
    late = [told(0), told(100), told(300), told(900)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, *late))
    throttle, steering = drive.channel("command.throttle"), drive.channel("command.steering")
    rows = [(0, 0.5), (100, 0.5), (250, 0), (300, 0.5), (450, 0), (600, 0), (900, 0.5)]
    rows += [(1050, 0), (1200, 0)]
    assert_allclose(np.round(throttle.t * 1000), [ms for ms, _ in rows])
    assert_allclose(throttle.values, [value for _, value in rows])
    assert_allclose(steering.values, 0.2)


def test_commands_that_the_car_refuses_do_not_count(tmp_path: Path) -> None:
    states = [reported(ms) for ms in range(0, 400, 20)]
    strange = [told(140, -1.0, epoch=2), told(150, -1.0, seq=60), told(160, 7.0)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, told(100), *strange))
    assert_allclose(drive.channel("command.throttle").values, [0.5, 1.0, 0.0, 0.0])


def test_a_real_car_is_where_one_camera_sees_it_though_another_does_too(tmp_path: Path) -> None:
    states = [reported(ms, source="odometry") for ms in range(0, 1000, 20)]
    commands = [told(ms) for ms in range(0, 1000, 100)]
    poses = [seen(ms, x_m=1.0) for ms in range(0, 1000, 100)] + [seen(50, "side", x_m=2.0)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, *commands, *poses))
    assert_allclose(drive.channel("pose.x").values, [1.0] * 10)
    stds = [drive.channel(f"pose.{name}").std for name in ("x", "y", "yaw")]
    assert_allclose(stds, [0.002, 0.003, 0.01])


def test_another_camera_takes_over_where_the_first_has_lost_the_car(tmp_path: Path) -> None:
    states = [reported(ms, source="odometry") for ms in range(0, 3000, 20)]
    commands = [told(ms) for ms in range(0, 3000, 100)]
    west = [*range(0, 1000, 100), *range(1200, 1500, 100)]  # two frames lost: still its car
    poses = [seen(ms, "west", x_m=1.0) for ms in west]
    poses += [seen(ms + 30, "east", x_m=2.0) for ms in range(800, 3000, 100)]
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, *commands, *reversed(poses)))
    x = drive.channel("pose.x")
    assert_allclose(x.values, [1.0] * len(west) + [2.0] * (len(x.t) - len(west)))
    assert_allclose(x.t[len(west) - 1 : len(west) + 1], [1.4, 1.73], atol=0.011)
    assert x.t[-1] == pytest.approx(2.93, abs=0.011)


def test_a_real_car_that_no_camera_saw_is_refused(tmp_path: Path) -> None:
    states = [reported(ms, source="odometry") for ms in range(0, 400, 20)]
    with pytest.raises(RecordingError, match="n1: no pose while it obeyed commands"):
        read_drives(said(tmp_path / "a.mcap", *states, told(100)))


def test_a_car_that_never_reports_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="n1: neither it nor the world reports which car"):
        read_drives(said(tmp_path / "a.mcap", *(told(ms) for ms in range(0, 400, 20))))


def test_times_count_from_the_first_message_of_the_car_to_the_nanosecond(tmp_path: Path) -> None:
    states = [reported(ms) for ms in range(0, 400, 20)]
    read = VehicleSensors(
        vehicle="n1", t_ns=START_NS + 100 * MS + 7, encoder_left=5, encoder_right=6,
        accel_mps2=(0.0, 0.0, 9.8), gyro_radps=(0.0, 0.0, 0.5),
    )  # fmt: skip
    (drive,) = read_drives(said(tmp_path / "a.mcap", *states, told(40), told(100), read))
    assert round(drive.channel("imu.gyro_z").t[0] * 1e9) == 100 * MS + 7


def test_what_strangers_say_on_the_bus_is_passed_over(tmp_path: Path) -> None:
    states = [reported(ms) for ms in range(0, 400, 20)]
    path = tmp_path / "a.mcap"
    with RunFile(path, "city") as file:
        for one in (*states[:8], told(100), *states[8:]):
            file.write(RawSample(key_of("city", one), *encode(one), t_ns=one.t_ns))
        key = key_of("city", told(200))
        file.write(RawSample(key, b"\xff not json", None, t_ns=START_NS + 200 * MS))
        file.write(RawSample(key, b'{"vehicle": 3}', None, t_ns=START_NS + 210 * MS))
    (drive,) = read_drives(path)
    assert len(drive.channel("pose.x").t) == 15


def test_a_file_that_is_no_whole_run_is_refused(tmp_path: Path, run: Path) -> None:
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(run.read_bytes()[100:])
    with pytest.raises(RecordingError, match="no run of a city"):
        read_drives(torn)
    with (tmp_path / "ros.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="test")
        channel = writer.register_channel("/odom", "json", 0)
        writer.add_message(channel, 1, json.dumps({}).encode(), 1)
        writer.finish()
    with pytest.raises(RecordingError, match=r"no run of a city: it holds /odom; a ROS 2 bag is"):
        read_drives(tmp_path / "ros.mcap")


def test_a_described_recording_is_read_as_ever_and_may_be_of_several_cars(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,x\n0,1\n1,2\n")
    table = "  - {file: a.csv, vehicle: CAR, time: {column: t}, channels: {speed: {column: x, "
    table += "unit: m/s}}}\n"
    tables = table.replace("CAR", "nigel") + table.replace("CAR", "f1tenth")
    (tmp_path / "recording.yaml").write_text(f"recording: 1\ntables:\n{tables}")
    assert [one.vehicle for one in recordings_of(tmp_path)] == ["nigel", "f1tenth"]
    assert [one.vehicle for one in recordings_of(tmp_path, None, "f1tenth")] == ["f1tenth"]
    with pytest.raises(RecordingError, match=r"no car 'nigl' \(did you mean 'nigel'\?\)"):
        recordings_of(tmp_path, None, "nigl")


@pytest.mark.parametrize("cut", ["no end", "within a chunk", "still growing"])
def test_a_run_without_its_end_is_read_as_far_as_it_is_whole(tmp_path: Path, cut: str) -> None:
    path = tmp_path / "live.mcap"
    with RunFile(path, "city") as file:
        for k in range(400):
            at = reported(20 * k, seq=k, x_m=k / 100, throttle=0.5, steering=0.1)
            file.write(RawSample(key_of("city", at), *encode(at), t_ns=at.t_ns))
            if k % 25 == 24:
                file.flush()
        content = path.read_bytes()
        if cut == "still growing":
            expect_live(path, 7.0)
    path.write_bytes(content[: len(content) // 2 if cut == "within a chunk" else None])
    expect_live(path, 3.0 if cut == "within a chunk" else 7.0)
    with pytest.raises(RecordingError, match=r"it has no end: .*scm recover"):
        list(read_run(path))


def expect_live(path: Path, longest_s: float) -> None:
    (recording,) = read_drives(path)
    assert longest_s < recording.channel("pose.x").t[-1] < longest_s + 1.5
    assert any("still being written" in str(one) for one in recording.left_out)
