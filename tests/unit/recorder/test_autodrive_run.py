"""A run of the city is written as AutoDRIVE's data recorder would have."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.__main__ import main
from scm.errors import RecordingError
from scm.maps.load import load_map
from scm.recorder.autodrive_run import read_tracks
from scm.recorder.mcap_file import RunFile
from scm.recording.autodrive import CAR, stamp_of
from scm.recording.read import read_recordings
from scm.records.signals import SignalGroup
from scm.v2x.exchange import RawSample
from scm.v2x.key import key_of
from scm.v2x.message import Message, encode
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

MS = 1_000_000
START_NS = 1_700_000_000_000_000_000
LIMIT, G, TILT = 0.5235988, 9.80665, 0.1
ROW = (*CAR, "cam0", "cam1", "lidar")
FULL = np.arange(360, dtype="<f4") + 1.0


def said(path: Path, *messages: Message) -> Path:
    """Write messages as a recorder would have heard them, each at its own time."""
    with RunFile(path, "city") as file:
        for one in sorted(messages, key=lambda one: one.t_ns):
            file.write(RawSample(key_of("city", one), *encode(one), t_ns=one.t_ns))
    return path


def state(ms: int, name: str = "n2", **other) -> VehicleState:
    told = {"x_m": ms / 1000, "y_m": 0.5, "yaw_rad": -0.1, "speed_mps": 1.0, "throttle": ms / 1000}
    fields = {"yaw_rate_radps": 0.0, "steering_rad": 0.07, "steering": -ms / 1000, "seq": ms}
    fields |= {"source": "simulated"} | told | other
    return VehicleState(vehicle=name, t_ns=START_NS + ms * MS, **fields)


def sensors(ms: int) -> VehicleSensors:
    felt = (-G * math.sin(TILT) + 0.3, 0.0, G * math.cos(TILT))
    return VehicleSensors(
        vehicle="n2", t_ns=START_NS + ms * MS, encoder_left=ms, encoder_right=87_654_321,
        accel_mps2=felt, gyro_radps=(0.0, 0.0, 0.25), orientation_rad=(0.0, TILT, 0.0),
    )  # fmt: skip


def scan(ms: int, ranges: np.ndarray, **other) -> LidarScan:
    return LidarScan(
        vehicle="n2", t_ns=START_NS + ms * MS, beams=len(ranges), range_min_m=0.1,
        range_max_m=12.0, payload=ranges.tobytes(), **other,
    )  # fmt: skip


def spat(ms: int, colour: str) -> Spat:
    since = {"since_ns": START_NS, "min_end_ns": START_NS}
    group = SignalGroup(group="south_east", colour=colour, **since)
    return Spat(
        junction="crossing", t_ns=START_NS + ms * MS, seq=ms, mode="plan", plan="calm",
        groups=(group,),
    )  # fmt: skip


def picture(ms: int, payload: bytes, camera: str = "front") -> CameraFrame:
    return CameraFrame(
        vehicle="n2", camera=camera, t_ns=START_NS + ms * MS, width_px=4, height_px=4,
        payload=payload,
    )  # fmt: skip


def states() -> list[VehicleState]:
    return [state(ms) for ms in range(0, 1001, 20)]


def exported(run: Path, *more: str) -> Path:
    out = run.parent / "theirs"
    assert main(["export", "autodrive", str(run), "--out", str(out), *more]) == 0
    return out


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open() as stream:
        return list(csv.DictReader(stream, ROW))


def test_a_run_becomes_rows_at_the_rate_asked_for(tmp_path: Path) -> None:
    world = WorldDefinition(t_ns=START_NS, seed=0, map=load_map("driving_school"))
    read = [sensors(ms) for ms in range(0, 1001, 20)]
    lights = [spat(0, "red"), spat(500, "green")]
    run = said(tmp_path / "a.mcap", world, *states(), *read, *lights, scan(100, FULL))
    out = exported(run, "--rate-hz", "10")
    rows = rows_of(out / "V1 Log.csv")
    assert [row["timestamp"] for row in rows] == [
        stamp_of(START_NS // MS + 100 * k) for k in range(11)
    ]
    at = {name: [float(row[name]) for row in rows[:-1]] for name in CAR[1:]}
    t = np.arange(10) / 10
    assert_allclose(at["posX"], t, atol=1e-9)
    assert_allclose(at["posZ"], 0.0325)
    assert_allclose(at["yaw"], math.tau - 0.1, atol=1e-6)
    assert_allclose(at["throttle"], t + 0.02, err_msg="in force is what leads to the next report")
    assert_allclose(at["steering"], -(t + 0.02) * LIMIT, atol=1e-7)
    assert at["leftTicks"] == list(range(0, 1000, 100))
    assert rows[3]["rightTicks"] == "87654321"
    assert_allclose(at["accX"], 0.3, atol=1e-6)
    assert_allclose(at["accZ"], 0.0, atol=1e-6)
    assert rows[0]["lidar"] == ""
    assert rows[1]["lidar"].split(" ")[:3] == ["1", "2", "3"]
    shown = [line.split(",")[1] for line in (out / "TL1 Log.csv").read_text().splitlines()]
    assert shown == ["1"] * 5 + ["3"] * 6
    assert not (out / "TL2 Log.csv").exists(), "nobody told what group south_west shows"


def test_flashing_red_is_red_and_off_by_turns(tmp_path: Path) -> None:
    world = WorldDefinition(t_ns=START_NS, seed=0, map=load_map("driving_school"))
    lights = [spat(ms, "flashing_red") for ms in range(0, 2000, 100)]
    run = read_tracks(said(tmp_path / "a.mcap", world, *states(), *lights))
    assert run.lights[0].states.values.tolist() == ([1.0] * 5 + [0.0] * 5) * 2


def test_what_was_exported_is_imported_with_its_poses(tmp_path: Path) -> None:
    other = [state(ms, "n10", y_m=9.0) for ms in range(0, 1001, 20)]
    out = exported(said(tmp_path / "a.mcap", *states(), *other))
    ours = tmp_path / "ours"
    assert main(["import", "autodrive", str(out), "--out", str(ours)]) == 0
    first, second = read_recordings(ours)
    assert len(first.channel("pose.x").t) == 31
    assert_allclose(first.channel("pose.x").values, first.channel("pose.x").t, atol=5e-4)
    assert_allclose(first.channel("pose.y").values, 0.5)
    assert_allclose(second.channel("pose.y").values, 9.0, err_msg="n10 comes after n2")


def test_pictures_are_files_named_after_their_first_row(tmp_path: Path) -> None:
    taken = [picture(90, b"one"), picture(390, b"two"), picture(390, b"back", "rear")]
    out = exported(said(tmp_path / "a.mcap", *states(), *taken), "--rate-hz", "10")
    rows = rows_of(out / "V1 Log.csv")
    assert [row["cam0"] for row in rows[:1]] == [""]
    assert (out / rows[1]["cam0"]).read_bytes() == b"one"
    assert rows[3]["cam0"] == rows[1]["cam0"]
    assert rows[1]["cam0"].endswith(f"Camera0_Frame_{rows[1]['timestamp']}.jpg")
    assert (out / rows[4]["cam0"]).read_bytes() == b"two"
    assert (out / rows[4]["cam1"]).read_bytes() == b"back"


@pytest.mark.parametrize(
    ("ranges", "bearing", "expected"),
    [
        (FULL, {}, {0: 1.0, 90: 91.0}),
        (FULL, {"bearing_first_rad": math.pi}, {180: 1.0, 0: 181.0}),
        (
            FULL[:181],
            {"bearing_first_rad": -math.pi / 2, "bearing_step_rad": math.pi / 180},
            {270: 1.0, 0: 91.0, 90: 181.0, 180: math.inf},
        ),
        (FULL[:180], {}, {0: 1.0, 90: 46.0}),
        (FULL, {"bearing_step_rad": -math.pi / 180}, {0: 1.0, 359: 2.0, 1: 360.0}),
        (FULL[:0], {}, {0: math.inf}),
    ],
)
def test_any_scanner_is_written_in_degrees_from_straight_ahead(
    tmp_path: Path, ranges: np.ndarray, bearing: dict[str, float], expected: dict[int, float]
) -> None:
    run = read_tracks(said(tmp_path / "a.mcap", *states(), scan(10, ranges, **bearing)))
    (scans,) = run.cars[0].scans
    assert {k: scans[k] for k in expected} == expected


def test_a_real_car_is_where_the_cameras_see_it(tmp_path: Path) -> None:
    zero = (0.0,) * 6
    tracks = [
        EyeTrack(
            vehicle="n2", tag_id=1, t_ns=START_NS + ms * MS, x_m=4.0, y_m=0.0, yaw_rad=0.0,
            speed_mps=0.0, lateral_speed_mps=0.0, yaw_rate_radps=0.0, covariance=(zero,) * 6,
            age_s=0.0, stale=False,
        )
        for ms in range(0, 1000, 50)
    ]  # fmt: skip
    real = [state(ms, source="odometry") for ms in range(0, 1000, 20)]
    run = read_tracks(said(tmp_path / "a.mcap", *real, *tracks))
    assert set(run.cars[0].columns["posX"].values) == {4.0}
    assert "n2: where the overhead cameras saw it" in run.remarks


def test_a_sparse_run_is_exported_from_its_snapshots(tmp_path: Path) -> None:
    car = SnapshotVehicle(
        vehicle="n2", kind="hosted", car="nigel", tag_id=1, x_m=1.0, y_m=2.0, yaw_rad=0.0,
        speed_mps=0.0, steering_rad=0.2,
    )  # fmt: skip
    world = [
        WorldSnapshot(t_ns=START_NS + ms * MS, tick=ms, vehicles=(car,))
        for ms in range(0, 500, 50)
    ]  # fmt: skip
    run = read_tracks(said(tmp_path / "a.mcap", *world))
    assert set(run.cars[0].columns["steering"].values) == {0.2}
    assert "n2: steering is the wheels' angle: no command was told" in run.remarks


def test_a_run_without_the_car_asked_for_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no car 'n9' reports where it is; it has n2"):
        read_tracks(said(tmp_path / "a.mcap", *states()), "n9")
