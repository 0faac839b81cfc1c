"""A live trial seals what happens, plays cities, goes on when interrupted, and opens labels."""

import json
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from scm.__main__ import main
from scm.clock import NS_PER_S
from scm.errors import RecordingError
from scm.twin.trial import run
from scm.twin.trial.city import (
    BEGIN_NS,
    FOUND_FILE,
    CarFound,
    CityFound,
    CityRequest,
    parts_of,
    played,
    scene_of,
)
from scm.twin.trial.poses_eye import PosesEye, View, sees
from scm.v2x.exchange import Incoming
from scm.v2x.messages.vehicle_state import VehicleState
from tests.reality.sensing import FAULTS, seen

SMALL = CityRequest(seed=5, cars=2, hours=0.5, search=False)


@pytest.fixture
def stub(monkeypatch):
    """Cities that find nothing at once; returns the numbers of those that were played."""
    numbers = []

    def play(request, folder, notify=None):
        numbers.append(request.number)
        folder.mkdir(parents=True)
        cars = {name: CarFound(driven=[(0.0, 0.0), (1800.0, 1800.0)]) for name in request.names}
        found = CityFound(begin_ns=0, lasted_s=1800.0, cars=cars)
        (folder / FOUND_FILE).write_bytes(msgspec.json.encode(found))
        return folder / FOUND_FILE

    monkeypatch.setattr(run, "play", play)
    return numbers


def test_trial_goes_on_where_it_was_interrupted(stub, tmp_path):
    trial = run.LiveTrial(SMALL, 3)
    rows = run.run(trial, tmp_path)
    assert stub == [0, 1, 2]
    (tmp_path / "found" / "case_001" / FOUND_FILE).unlink()
    with pytest.raises(RecordingError, match=r"case_001.*was not played to its end"):
        run.judged_again(tmp_path)
    (tmp_path / "found" / "case_001").rmdir()
    assert run.run(trial, tmp_path) == rows
    assert stub == [0, 1, 2, 1]
    assert run.judged_again(tmp_path) == rows
    assert json.loads((tmp_path / "result.json").read_text())["driven_h"] == 3.0
    with pytest.raises(RecordingError, match="holds another trial"):
        run.run(replace(trial, cities=2), tmp_path)


def test_label_that_was_changed_is_an_error(stub, tmp_path):
    run.run(run.LiveTrial(SMALL), tmp_path)
    path = tmp_path / "labels" / "case_000.json"
    held = json.loads(path.read_text())
    assert held["label"]["changes"]
    held["label"]["changes"] = []
    path.write_text(json.dumps(held))
    with pytest.raises(RecordingError, match="not what was sealed"):
        run.judged_again(tmp_path)


def test_scene_depends_on_seed_and_number_only():
    def drawn(**more):
        scene, _ = scene_of(replace(SMALL, **more))
        return [(one.kind, one.of, one.since, one.effects) for one in scene.events]

    assert drawn() == drawn(search=True) != drawn(number=1)
    assert drawn(healthy=True) == []


def test_city_of_the_reality_is_seen_by_the_cameras_alone(tmp_path):
    request = replace(SMALL, hours=40.0 / 3600.0)
    scene, _ = scene_of(request)
    parts = parts_of(request, scene)
    minutes = []
    found = played(request, parts, tmp_path, minutes.append)
    assert minutes == [10.0, 20.0, 30.0, 40.0]
    assert found.cars["n1"].driven[-1][1] > 10.0
    (eye,) = [part for part in parts if isinstance(part, PosesEye)]
    assert set(eye._reports) == {"n1", "n2"}
    assert not list(tmp_path.iterdir())


def state(t_ns, x_m):
    return VehicleState(
        vehicle="n1", t_ns=t_ns, seq=0, x_m=x_m, y_m=0.2, yaw_rad=0.0, speed_mps=0.2,
        yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.0, steering=0.0, source="simulated",
    )  # fmt: skip


def poses(camera_faults, tag_faults, x_m, since_s=0.0):
    """Return mean x by camera of a car that stands at a place for ten seconds."""
    views = [View("west", (-9.0, 0.0)), View("east", (0.0, 9.0))]
    shown = sees(
        lambda name, t_s: FAULTS | (camera_faults if name == "west" and t_s >= since_s else {}),
        lambda _name, _t_s: FAULTS | tag_faults, {"west": -1.0, "east": 1.0}, seen,
    )  # fmt: skip
    eye, found = PosesEye(views, shown, np.random.default_rng(1), BEGIN_NS), []
    for tick in range(500):
        now_ns = BEGIN_NS + tick * NS_PER_S // 50
        inbox = [Incoming(state(now_ns, x_m), now_ns)]
        found += [(pose.camera, pose.t_ns, pose.x_m) for pose in eye.step(now_ns, inbox)]
    return found


def test_each_camera_sees_its_part_of_the_floor_at_its_rate():
    found = poses({}, {}, -0.5)
    assert {camera for camera, _, _ in found} == {"west"}
    assert 280 < len(found) < 300
    assert np.mean([x for *_, x in found]) == pytest.approx(-0.5, abs=4e-4)
    assert np.std([x for *_, x in found]) == pytest.approx(0.002, rel=0.2)


def test_faults_of_a_camera_and_of_a_tag_are_in_its_poses():
    late = poses({"scale": 1.1}, {}, -0.5, 5.0)
    x = np.array([row[2] for row in late])
    after = np.array([row[1] - BEGIN_NS >= 5 * NS_PER_S for row in late])
    assert x[~after].mean() == pytest.approx(-0.5, abs=5e-4)
    assert x[after].mean() == pytest.approx(-0.45, abs=5e-4)
    assert np.mean([x for *_, x in poses({}, {"point_x": 0.01}, 0.5)]) == pytest.approx(
        0.51, abs=4e-4
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--hours", "0"], "--hours: expected more than 0"),
        (["--hours", "nan"], "--hours: expected more than 0"),
        (["--cars", "99"], "--cars: expected 1 to 10"),
        (["--cases", "0"], "--cases: expected at least 1"),
        (["--strength", "3", "2"], "--strength: expected two numbers above 0 that rise"),
        (["--budget-s", "0"], "--budget-s: expected more than 0"),
        (["--kind", "pair"], "--kind: expected mixed or none with --live"),
        (["--family", "drawn"], "--family: not with --live"),
    ],
)
def test_what_is_not_possible_is_refused_in_words(arguments, words, tmp_path, capsys):
    assert main(["trial", "--live", "--out", str(tmp_path / "out"), *arguments]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
