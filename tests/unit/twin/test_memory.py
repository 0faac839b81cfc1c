"""The memory of a car: pieces become one recording again, and a folder that is read back."""

import numpy as np
import pytest

from scm.errors import RecordingError
from scm.recording.read import read_recordings
from scm.recording.span import part_of
from scm.twin.memory import MEMORY_S, CarMemory, write
from tests.unit.mismatch.made_drive import made_drive


@pytest.fixture(scope="module")
def drive():
    return made_drive(seconds=40.0)


def remembered(drive, *spans):
    """Return a memory of spans, each with two seconds before and one after."""
    memory = CarMemory()
    for first_s, last_s in spans:
        memory.add(part_of(drive, first_s - 2.0, last_s + 1.0), first_s, last_s)
    return memory


def test_pieces_are_one_recording_without_a_row_twice_or_lost(drive):
    memory = remembered(drive, (0.0, 10.0), (10.0, 20.0), (20.0, 30.0))
    found = memory.between(5.0, 25.0)
    for name, channel in drive.channels.items():
        rows = (channel.t >= 5.0) & (channel.t < 25.0)
        np.testing.assert_array_equal(found.channels[name].t, channel.t[rows])
        np.testing.assert_array_equal(found.channels[name].values, channel.values[rows])


def test_what_followed_the_newest_piece_is_there_until_the_next_comes(drive):
    memory = remembered(drive, (0.0, 10.0))
    assert memory.between(8.0, 11.0).channels["pose.x"].t[-1] > 10.9
    assert memory.last_s == 10.0


def test_gap_is_skipped_and_nothing_driven_is_refused_in_words(drive):
    memory = remembered(drive, (0.0, 10.0), (20.0, 30.0))
    assert memory.begin_after(3.0) == 3.0
    assert memory.begin_after(10.0) == 20.0
    assert memory.begin_after(30.0) == memory.last_s == 30.0
    with pytest.raises(RecordingError, match="nothing was driven from 12 to 18 s"):
        memory.between(12.0, 18.0)


def test_camera_is_the_one_that_saw_the_car_then_or_last(drive):
    memory = CarMemory()
    memory.add(drive, 0.0, 10.0, [(0.0, "west"), (7.0, "east")])
    memory.add(drive, 10.0, 20.0, [(9.0, "east"), (14.0, "west")])
    memory.add(drive, 20.0, 30.0)
    at = {3.0: "west", 7.0: "east", 9.9: "east", 10.0: "east", 13.9: "east", 14.0: "west"}
    assert {t_s: memory.camera_at(t_s) for t_s in at} == at
    assert memory.camera_at(25.0) == memory.camera_at(-1.0) == ""


def test_old_pieces_are_forgotten(drive):
    memory = CarMemory()
    for k in range(200):
        memory.add(drive, 10.0 * k, 10.0 * k + 10.0)
    assert len(memory._pieces) == pytest.approx(MEMORY_S / 10.0, abs=1)


def test_written_folder_is_read_back_as_it_was(drive, tmp_path):
    write(drive, tmp_path / "drive")
    (found,) = read_recordings(tmp_path / "drive")
    assert found.vehicle == drive.vehicle
    assert found.channels.keys() == drive.channels.keys()
    for name, channel in drive.channels.items():
        np.testing.assert_array_equal(found.channels[name].t, channel.t)
        np.testing.assert_array_equal(found.channels[name].values, channel.values)
        assert found.channels[name].std == channel.std
        assert found.channels[name].dimension == channel.dimension


def test_folder_that_cannot_be_written_is_named(drive, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="file/drive: cannot be written"):
        write(drive, tmp_path / "file" / "drive")
