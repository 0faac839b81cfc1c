"""A part of a recording holds what was recorded there, and nothing else."""

from pathlib import Path

import numpy as np
import pytest

from scm.errors import RecordingError
from scm.recording.read import Channel, Recording
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


def test_a_channel_that_has_nothing_there_is_left_out(recording):
    assert set(part_of(recording, None, 5.0).channels) == {"pose.x"}


def test_a_part_without_anything_is_refused(recording):
    with pytest.raises(RecordingError, match=r"from 50\.0 s"):
        part_of(recording, 50.0, None)
