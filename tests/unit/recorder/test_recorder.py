"""A run is written as it is heard, survives being cut off, and can be mended."""

import json
from pathlib import Path

import pytest

from scm.errors import RecordingError
from scm.recorder.mcap_file import RunFile, read_run
from scm.recorder.part import RecorderPart
from scm.recorder.recover import recover
from scm.v2x.exchange import RawSample
from scm.v2x.key import key_of
from scm.v2x.message import encode
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.part_status import PartStatus

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
