"""A part of a recording holds what was recorded there, and nothing else."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scm.errors import RecordingError
from scm.recording.read import Channel, Recording
from scm.recording.scans import Scans
from scm.recording.span import part_of


@pytest.fixture
def recording():
    def channel(first, last):
        t = np.arange(first, last)
        return Channel(t, 10.0 * t, None, (0.0, 0.0), "")

    channels = {"pose.x": channel(100.0, 120.0), "battery.voltage": channel(110.0, 113.0)}
    return Recording(Path("drive.yaml"), "nigel", channels)


def test_times_count_from_the_first_row_and_stay_as_recorded(recording):
    part = part_of(recording, 4.0, 12.0)
    assert part.channel("pose.x").t.tolist() == [*range(104, 113)]
    assert part.channel("pose.x").values[0] == 1040.0
    assert part.channel("battery.voltage").t.tolist() == [110, 111, 112]


def test_an_open_end_is_the_recordings_own(recording):
    assert part_of(recording, None, None) is recording
    assert part_of(recording, 18.0, None).channel("pose.x").t.tolist() == [118, 119]
    assert len(part_of(recording, None, 2.0).channel("pose.x").t) == 3


def test_the_scans_of_other_times_are_left_out(recording):
    one = np.ones(20)
    scans = Scans(
        t=np.arange(100.0, 120.0), ranges=np.arange(40.0).reshape(20, 2), angle_min=one,
        angle_increment=one, time_increment=one, range_min=one, range_max=one,
    )  # fmt: skip
    part = part_of(replace(recording, scans=scans), 4.0, 6.0).scans
    assert part.t.tolist() == [104, 105, 106]
    assert part.ranges.tolist() == [[8, 9], [10, 11], [12, 13]]
    assert part.range_max.shape == (3,)


def test_a_channel_that_has_nothing_there_is_left_out(recording):
    assert set(part_of(recording, None, 5.0).channels) == {"pose.x"}


def test_a_part_without_anything_is_refused(recording):
    said = r"from 50 s: nothing was .* driven again; there is from 0\.0 s to 19\.0 s"
    with pytest.raises(RecordingError, match=said):
        part_of(recording, 50.0, None)


def test_of_a_run_times_count_from_its_begin_not_from_when_its_car_was_driven(recording):
    run = replace(recording, begin_s=90.0, name="n1")
    assert part_of(run, 14.0, 15.0).channel("pose.x").t.tolist() == [104, 105]
    said = r"from 0 s to 9 s: nothing of n1 was .*; there is from 10\.0 s to 29\.0 s"
    with pytest.raises(RecordingError, match=said):
        part_of(run, None, 9.0)


def with_stamp(recording, row, at_s):
    """Return the recording with one stamp of its poses changed."""
    pose = recording.channel("pose.x")
    t = pose.t.copy()
    t[row] = at_s
    return replace(recording, channels={**recording.channels, "pose.x": replace(pose, t=t)})


@pytest.mark.parametrize("row", [0, 5])
def test_a_stray_stamp_at_zero_is_no_begin(recording, row):
    later = {n: replace(c, t=c.t + 1.7e9) for n, c in recording.channels.items()}
    stray = with_stamp(replace(recording, channels=later), row, 0.0)
    begin = 1.7e9 + (101.0 if row == 0 else 100.0)
    part = part_of(stray, 4.0, 8.0).channel("pose.x").t
    assert part.tolist() == [t for t in stray.channel("pose.x").t if begin + 4 <= t <= begin + 8]
    assert len(part)


def test_a_stray_stamp_a_day_ahead_is_no_end(recording):
    stray = with_stamp(recording, 7, 86_500.0)
    with pytest.raises(RecordingError, match=r"there is from 0\.0 s to 19\.0 s"):
        part_of(stray, 30.0, 40.0)
