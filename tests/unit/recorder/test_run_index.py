"""Seeking in a run: complete, growing, cut off, damaged, or no run at all."""

import os

import pytest

from scm.clock import NS_PER_S
from scm.errors import RecordingError
from scm.recorder import run_index
from scm.recorder.run_index import read_index
from tests.unit.recorder.short_run import BEGIN_NS, write_run


def is_snapshot(key):
    return key.endswith("world/snapshot")


def times_s(index, from_s, to_s):
    begin_ns, end_ns = (BEGIN_NS + round(at * NS_PER_S) for at in (from_s, to_s))
    found = index.read(begin_ns, end_ns, is_snapshot)
    return [round((one.t_ns - BEGIN_NS) / NS_PER_S, 3) for one in found]


@pytest.mark.parametrize("finish", [True, False], ids=["complete", "cut off"])
def test_a_seek_gives_what_was_heard_between_two_times(tmp_path, finish):
    index = read_index(write_run(tmp_path / "run.mcap", finish=finish))
    assert (index.whole, index.begin_ns, index.end_ns) == (
        finish,
        BEGIN_NS,
        BEGIN_NS + 5 * NS_PER_S,
    )
    assert times_s(index, 2.0, 2.2) == [2.0, 2.05, 2.1, 2.15, 2.2]


def test_both_ways_of_finding_chunks_agree(tmp_path):
    complete = read_index(write_run(tmp_path / "a.mcap"))
    walked = read_index(write_run(tmp_path / "b.mcap", finish=False))
    assert walked.chunks == complete.chunks
    assert walked.topics == complete.topics


def test_a_seek_unpacks_only_the_chunks_that_it_shows(tmp_path, monkeypatch):
    index = read_index(write_run(tmp_path / "run.mcap"))
    unpacked, real = [], run_index._unpacked
    monkeypatch.setattr(
        run_index, "_unpacked", lambda *given: unpacked.append(given) or real(*given)
    )
    times_s(index, 2.0, 2.2)
    assert 1 <= len(unpacked) <= 2 < len(index.chunks)


@pytest.mark.parametrize("finish", [True, False], ids=["complete", "cut off"])
def test_a_chunk_is_not_unpacked_where_its_messages_of_a_key_are_of_another_time(
    tmp_path, monkeypatch, finish
):
    index = read_index(write_run(tmp_path / "run.mcap", finish=finish))
    unpacked, real = [], run_index._unpacked
    monkeypatch.setattr(
        run_index, "_unpacked", lambda *given: unpacked.append(given) or real(*given)
    )
    begin_ns, end_ns = (BEGIN_NS + round(at * NS_PER_S) for at in (2.8, 2.95))
    warned = "event/warning/world"  # at 3 s, in the chunk of 2.8 to 3.0 s
    (holding,) = (one for one in index.chunks if one.begin_ns <= end_ns <= one.end_ns)
    assert any(index.topics[number].endswith(warned) for number in holding.channels)
    assert list(index.read(begin_ns, end_ns, lambda key: key.endswith(warned))) == []
    assert unpacked == []


def test_a_chunk_whose_list_of_messages_is_damaged_is_left_out_and_told(tmp_path):
    path = write_run(tmp_path / "run.mcap")
    whole = path.read_bytes()
    index = read_index(path)
    chunk = index.chunks[8]
    number = next(number for number, key in index.topics.items() if is_snapshot(key))
    first = chunk.channels[number] + 6  # behind its channel and its length
    for at, wrong in (
        (first + 8, b"\xff" * 8),  # a message far behind the chunk
        (first + 8, b"\x01" + bytes(7)),  # one in the midst of another
        (first - 4, b"\x07\x00\x00\x00"),  # a list of half an entry
        (first, (BEGIN_NS + NS_PER_S).to_bytes(8, "little")),  # one of another time
    ):
        path.write_bytes(whole[:at] + wrong + whole[at + len(wrong) :])
        damage = []
        found = list(read_index(path).read(0, index.end_ns, is_snapshot, damage))
        assert 90 <= len(found) < 101, wrong
        assert f"byte {chunk.start} is damaged" in damage[0]


def test_a_file_that_grew_is_read_on_from_where_it_ended(tmp_path):
    whole = write_run(tmp_path / "whole.mcap", finish=False).read_bytes()
    path = tmp_path / "run.mcap"
    path.write_bytes(whole[: len(whole) // 2])
    half = read_index(path)
    path.write_bytes(whole)
    grown = read_index(path, half)
    assert len(half.chunks) < len(grown.chunks)
    assert times_s(grown, 0.0, 9.0) == times_s(read_index(path), 0.0, 9.0)
    assert times_s(grown, 0.0, 9.0)[-1] == 5.0
    assert read_index(path, grown) is grown


def test_a_file_that_was_torn_anywhere_is_read_as_far_as_it_goes(tmp_path):
    whole = write_run(tmp_path / "whole.mcap").read_bytes()
    path = tmp_path / "run.mcap"
    last = 0
    for size in range(8, len(whole), 997):
        path.write_bytes(whole[:size])
        found = times_s(read_index(path), 0.0, 9.0)
        assert found == sorted(found)
        assert len(found) >= last
        last = len(found)
    assert last > 90


def test_a_damaged_chunk_is_left_out_and_told(tmp_path):
    path = write_run(tmp_path / "run.mcap")
    index = read_index(path)
    chunk = index.chunks[8]
    content = bytearray(path.read_bytes())
    for at in range(chunk.start + 60, chunk.start + chunk.length, 3):
        content[at] ^= 0x5A
    path.write_bytes(content)
    damage = []
    found = list(read_index(path).read(0, index.end_ns, is_snapshot, damage))
    assert 90 <= len(found) < 101
    assert f"byte {chunk.start} is damaged" in damage[0]


def test_a_chunk_that_claims_more_than_memory_is_refused(tmp_path):
    path = write_run(tmp_path / "run.mcap")
    index = read_index(path)
    content = bytearray(path.read_bytes())
    content[index.chunks[3].start + 16 : index.chunks[3].start + 24] = b"\xff" * 7 + b"\x00"
    path.write_bytes(content)
    damage = []
    assert len(list(read_index(path).read(0, index.end_ns, is_snapshot, damage))) < 101
    assert "none of ours" in damage[0]


@pytest.mark.parametrize("content", [b"", b"no mcap at all", os.urandom(4000)])
def test_what_is_no_recording_is_refused_in_words(tmp_path, content):
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"run\.mcap: no recording"):
        read_index(path)


def test_the_newest_message_before_a_time_is_found(tmp_path):
    index = read_index(write_run(tmp_path / "run.mcap"))
    found = index.newest(BEGIN_NS + round(2.51 * NS_PER_S), is_snapshot)
    assert found.t_ns == BEGIN_NS + round(2.5 * NS_PER_S)
    assert index.newest(BEGIN_NS - 1, is_snapshot) is None
