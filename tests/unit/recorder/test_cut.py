"""A part of a run is a run of its own: what was said then, and what held already."""

import pytest

from scm.api.replay import cars_in, map_of
from scm.errors import RecordingError
from scm.recorder.cut import cut
from scm.recorder.mcap_file import read_run
from scm.recorder.run_index import read_index
from tests.unit.recorder.short_run import BEGIN_NS, write_run


def rows(path, ending=""):
    return [
        (round((one.t_ns - BEGIN_NS) * 1e-9, 3), one.body)
        for one in read_run(path)
        if one.key.endswith(ending)
    ]


@pytest.mark.parametrize("finish", [True, False], ids=["complete", "cut off"])
def test_a_part_holds_what_was_said_then_and_no_more(tmp_path, finish):
    whole = write_run(tmp_path / "whole.mcap")
    run = write_run(tmp_path / "run.mcap", finish=finish)
    part = cut(run, tmp_path / "part.mcap", 2.0, 4.0)
    assert rows(part.path, "v/n1/state") == [
        row for row in rows(whole, "v/n1/state") if 2.0 <= row[0] <= 4.0
    ]
    assert rows(part.path, "eye/overhead/frame") == rows(whole, "eye/overhead/frame")
    assert part.span_s == 2.0
    assert read_index(part.path).whole


def test_a_part_begins_with_the_map_and_the_events_that_whoever_joins_late_is_sent(tmp_path):
    run = write_run(tmp_path / "run.mcap")
    index = read_index(cut(run, tmp_path / "part.mcap", 2.0).path)
    assert map_of(index) == map_of(read_index(run))
    assert {car.vehicle for car in cars_in(index)} == {"n1", "n10"}
    assert [at for at, _ in rows(index.path, "event/info/world")] == [2.0]
    assert [at for at, _ in rows(index.path, "event/warning/world")] == [3.0]


@pytest.mark.parametrize(("from_s", "to_s"), [(5.0, 7.0), (-1.0, 2.0), (3.0, 2.0), (90.0, None)])
def test_a_span_outside_the_run_is_refused_and_leaves_no_file(tmp_path, from_s, to_s):
    run = write_run(tmp_path / "run.mcap")
    with pytest.raises(RecordingError, match=r"expected a part of its 5\.0 s"):
        cut(run, tmp_path / "part.mcap", from_s, to_s)
    assert not (tmp_path / "part.mcap").exists()


def test_a_recording_is_never_written_over(tmp_path):
    run = write_run(tmp_path / "run.mcap")
    with pytest.raises(RecordingError, match="never written over"):
        cut(run, run, 1.0, 2.0)
    assert len(rows(run, "v/n1/state")) == 101
