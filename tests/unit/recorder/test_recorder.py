"""A run is written as it is heard, survives being cut off, and can be mended."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from scm.errors import MessageError, RecordingError
from scm.recorder.mcap_file import RunFile, read_run
from scm.recorder.part import RecorderPart
from scm.recorder.recover import recover
from scm.runtime.lockstep import Lockstep
from scm.v2x.exchange import RawSample
from scm.v2x.key import key_of
from scm.v2x.message import encode
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import WorldSnapshot

MS = 1_000_000


def killed_after(folder: Path, end: int) -> Path:
    """Record a message every 10 ms up to `end` ms; return the file as a kill would leave it."""
    part = RecorderPart(folder / "run.mcap")
    for number in range(0, end, 10):
        part.step(number * MS, [sample(number)])
    (folder / "cut.mcap").write_bytes((folder / "run.mcap").read_bytes())
    part.finish(end * MS)
    return folder / "cut.mcap"


def sample(number: int) -> RawSample:
    message = PartStatus(station="eye", t_ns=number * MS, detail=f"message {number}")
    return RawSample(key_of("city", message), *encode(message), t_ns=number * MS)


def test_a_run_is_read_back_as_it_was_heard(tmp_path: Path) -> None:
    with RunFile(tmp_path / "run.mcap", "city") as file:
        for number in range(100):
            file.write(sample(number))
    run = list(read_run(tmp_path / "run.mcap"))
    assert [message.t_ns for message in run] == [number * MS for number in range(100)]
    assert run[7].key == "scm/@v1/city/part/eye/status"
    assert json.loads(run[7].body)["detail"] == "message 7"


def test_bulk_is_readable_as_json(tmp_path: Path) -> None:
    scan = LidarScan(
        vehicle="n1", t_ns=5, beams=1, range_min_m=0.1, range_max_m=12.0, payload=b"\x01\x02"
    )
    with RunFile(tmp_path / "run.mcap", "city") as file:
        file.write(RawSample(key_of("city", scan), *encode(scan), t_ns=5))
    (message,) = read_run(tmp_path / "run.mcap")
    assert json.loads(message.body)["payload"] == "AQI="


def test_what_was_flushed_survives_a_kill(tmp_path: Path) -> None:
    result = recover(killed_after(tmp_path, 2000))
    assert not result.whole
    last_ns = list(read_run(result.path))[-1].t_ns
    assert 1990 * MS - last_ns <= 500 * MS


def test_a_file_torn_in_the_middle_of_a_record_is_mended_up_to_there(tmp_path: Path) -> None:
    whole = killed_after(tmp_path, 2000).read_bytes()
    for keep in range(len(whole) // 2, len(whole), 97):
        (tmp_path / "torn.mcap").write_bytes(whole[:keep])
        result = recover(tmp_path / "torn.mcap")
        assert 0 < result.messages <= 200
        assert len(list(read_run(result.path))) == result.messages


def test_a_whole_file_is_copied_whole(tmp_path: Path) -> None:
    with RunFile(tmp_path / "run.mcap", "city") as file:
        for number in range(10):
            file.write(sample(number))
    result = recover(tmp_path / "run.mcap", tmp_path / "copy.mcap")
    assert result.whole
    assert result.messages == 10
    assert list(read_run(result.path)) == list(read_run(tmp_path / "run.mcap"))


def test_a_cut_off_file_is_refused_with_the_way_out(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="scm recover"):
        list(read_run(killed_after(tmp_path, 500)))


def test_a_file_that_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "no.mcap").write_bytes(b"not a recording at all")
    with pytest.raises(RecordingError, match="no whole message"):
        recover(tmp_path / "no.mcap")
    assert not (tmp_path / "no.recovered.mcap").exists()


def test_the_recorder_says_how_it_is_doing_once_a_second(tmp_path: Path) -> None:
    part = RecorderPart(tmp_path / "run.mcap")
    said = [part.step(number * MS, [sample(number)]) for number in range(0, 3000, 50)]
    part.finish(3000 * MS)
    statuses = [message for messages in said for message in messages]
    assert len(statuses) == 3
    assert "41 messages in run.mcap" in statuses[-1].detail


@pytest.mark.parametrize(
    ("body", "attachment", "kept"),
    [
        (b"\xff no json", None, {"unreadable": "/yBubyBqc29u"}),
        (b"[" * 20_000, None, None),
        (b"\x01\x02", b"no json", {"unreadable": "bm8ganNvbg==", "payload": "AQI="}),
        (b"\x01\x02", b"[1]", {"unreadable": "WzFd", "payload": "AQI="}),
        (b"\x01\x02", b'{"\xe1\xe1":1}', {"unreadable": "eyLh4SI6MX0=", "payload": "AQI="}),
        (b"\x01\x02", b"", {"unreadable": "", "payload": "AQI="}),
    ],
)
def test_bytes_that_are_no_message_neither_stop_the_recorder_nor_spoil_its_file(
    tmp_path: Path, body: bytes, attachment: bytes | None, kept: dict[str, str] | None
) -> None:
    part = RecorderPart(tmp_path / "run.mcap")
    foreign = RawSample("somebody/else", b"{}", None, t_ns=2)
    part.step(1, [RawSample(sample(0).key, body, attachment, t_ns=1), foreign, sample(1)])
    part.finish(2)
    run = list(read_run(tmp_path / "run.mcap"))
    assert len(run) == 3
    assert kept is None or json.loads(run[0].body if run[0].t_ns == 1 else run[1].body) == kept


def test_a_large_message_is_kept(tmp_path: Path) -> None:
    with RunFile(tmp_path / "run.mcap", "city") as file:
        file.write(RawSample(sample(0).key, b"x" * 20_000_000, b"{}", t_ns=1))
    (message,) = read_run(tmp_path / "run.mcap")
    assert len(message.body) > 26_000_000


def test_any_mcap_reader_finds_the_schema_of_a_message(tmp_path: Path) -> None:
    with RunFile(tmp_path / "run.mcap", "city") as file:
        file.write(sample(0))
        file.write(RawSample("somebody/else", b"{}", None, t_ns=1))
    with (tmp_path / "run.mcap").open("rb") as stream:
        found = [(schema, channel) for schema, channel, _ in make_reader(stream).iter_messages()]
    (schema, channel), (nothing, _) = found
    assert schema is not None
    assert nothing is None
    assert (schema.name, schema.encoding, channel.message_encoding) == (
        "scm.PartStatus",
        "jsonschema",
        "json",
    )
    assert "detail" in json.dumps(json.loads(schema.data))


def frame(camera: str, t_ns: int) -> RawSample:
    picture = EyeFrame(camera=camera, t_ns=t_ns, width_px=1, height_px=1, payload=b"jpeg")
    return RawSample(key_of("city", picture), *encode(picture), t_ns=t_ns)


@pytest.mark.parametrize(("frames_hz", "kept"), [(1.0, 10), (2.0, 20), (0.0, 0), (1000.0, 50)])
def test_pictures_are_thinned_out_and_all_else_is_kept(
    tmp_path: Path, frames_hz: float, kept: int
) -> None:
    part = RecorderPart(tmp_path / "run.mcap", frames_hz=frames_hz)
    for number in range(50):
        t_ns = 1000 * MS + number * 200 * MS + (number * 7919 % 13 - 6) * MS
        part.step(t_ns, [frame("north", t_ns), frame("south", t_ns), sample(number)])
    part.finish(11_000 * MS)
    keys = [message.key.rpartition("@v1/city/")[2] for message in read_run(part.file.path)]
    assert keys.count("part/eye/status") == 50
    assert keys.count("eye/north/frame") == pytest.approx(kept, abs=1)
    assert keys.count("eye/south/frame") == pytest.approx(kept, abs=1)


def test_cars_whose_cameras_are_meant_need_names_and_a_rate(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"cameras_hz: got 0\.0"):
        RecorderPart(tmp_path / "run.mcap", cameras_of=["n1"])
    with pytest.raises(MessageError, match=r"cameras_of: got 'n1/\*'"):
        RecorderPart(tmp_path / "run.mcap", cameras_hz=1.0, cameras_of=["n1/*"])
    assert not (tmp_path / "run.mcap").exists()


@pytest.mark.parametrize("frames_hz", [-1.0, float("nan"), float("inf")])
def test_an_impossible_rate_of_pictures_is_refused(tmp_path: Path, frames_hz: float) -> None:
    with pytest.raises(RecordingError, match="frames_hz"):
        RecorderPart(tmp_path / "run.mcap", frames_hz=frames_hz)


def test_a_recording_is_never_written_over(tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(b"precious")
    with pytest.raises(RecordingError, match="never written over"):
        RunFile(tmp_path / "run.mcap", "city")
    assert (tmp_path / "run.mcap").read_bytes() == b"precious"


@pytest.mark.parametrize("path", ["file/run.mcap", "/proc/nowhere/run.mcap"])
def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path, path: str) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(RecordingError, match="cannot be written"):
        RunFile(tmp_path / path, "city")


def test_a_disk_that_fills_up_ends_the_run_with_a_sentence(tmp_path: Path) -> None:
    file = RunFile(tmp_path / "run.mcap", "city")
    with Path("/dev/full").open("wb") as full:
        os.dup2(full.fileno(), file._stream.fileno())
    file.write(RawSample(sample(0).key, os.urandom(100_000), b"{}", t_ns=1))
    with pytest.raises(RecordingError, match="No space left"):
        file.flush()
    with pytest.raises(RecordingError, match="No space left"):
        file.close()
    assert file._stream.closed


def test_damage_anywhere_is_told_or_mended_but_never_a_crash(tmp_path: Path) -> None:
    whole = killed_after(tmp_path, 1000).read_bytes()
    random = np.random.default_rng(7)
    outcomes = set()
    for _ in range(200):
        damaged = bytearray(whole)
        for place in random.integers(0, len(whole), 3):
            damaged[place] = random.integers(256)
        (tmp_path / "damaged.mcap").write_bytes(damaged)
        with pytest.raises(RecordingError, match="scm recover"):
            list(read_run(tmp_path / "damaged.mcap"))
        try:
            result = recover(tmp_path / "damaged.mcap")
        except RecordingError:
            outcomes.add("nothing left")
            continue
        outcomes.add("mended")
        assert len(list(read_run(result.path))) == result.messages
    assert outcomes == {"mended", "nothing left"}


def test_a_run_that_is_not_there_is_not_called_damaged(tmp_path: Path) -> None:
    with pytest.raises(
        RecordingError, match=r"missing\.mcap: cannot be read: No such file"
    ) as told:
        list(read_run(tmp_path / "missing.mcap"))
    assert "scm recover" not in str(told.value)


def test_a_recovery_that_cannot_begin_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read: No such file"):
        recover(tmp_path / "missing.mcap")
    assert not list(tmp_path.iterdir())
    with pytest.raises(RecordingError, match="cannot be written"):
        recover(killed_after(tmp_path, 500), tmp_path / "nowhere" / "run.mcap")


@pytest.mark.parametrize("sparse", [False, True])
def test_a_sparse_recording_asks_for_snapshots_and_not_for_each_car(
    tmp_path: Path, sparse: bool
) -> None:
    part = RecorderPart(tmp_path / "run.mcap", sparse=sparse)
    with Lockstep([part]) as city:
        assert city.bus.is_wanted(WorldSnapshot, {})
        for kind in (VehicleState, LidarScan, CamRx):
            assert city.bus.is_wanted(kind, {}) is not sparse
        city.publish(WorldSnapshot(t_ns=1, tick=1, vehicles=()))
        city.run_for(0.2)
    assert "scm/@v1/city/world/snapshot" in {item.key for item in read_run(tmp_path / "run.mcap")}
