"""A recording on the simulation's grid."""

from dataclasses import replace

import numpy as np
import pytest

from scm.errors import RecordingError
from scm.replay.drive import Drive, _commanded, has_odometer, is_led
from tests.unit.mismatch.made_drive import big_nigel, made_drive

ROWS = np.array([1.0, 1.1, 1.3]), np.array([0.4, 0.5, 0.6])


def before(command):
    return command.means(np.array([0.5, 0.6]), np.zeros(1))[0, 0]


def test_a_drive_that_begins_at_rest_was_not_commanded_before():
    assert before(_commanded(*ROWS, moving=False)) == 0.0


def test_what_drives_a_moving_car_before_its_first_row_is_that_row():
    command = _commanded(*ROWS, moving=True)
    assert before(command) == pytest.approx(0.4)
    assert command.means(np.array([1.1, 1.3]), np.zeros(1))[0, 0] == pytest.approx(0.5)


def test_a_car_that_is_given_a_throttle_is_not_led_by_its_speed():
    drive = Drive(made_drive(seconds=6.0), big_nigel())
    assert not is_led(drive)
    assert has_odometer(drive) == ("speed" in drive.names)


def test_steps_begin_where_commands_change():
    recording = made_drive(seconds=6.0)
    late = {
        name: replace(channel, t=channel.t + 0.0037) if name.startswith("pose.") else channel
        for name, channel in recording.channels.items()
    }
    drive = Drive(replace(recording, channels=late), big_nigel())
    steps = (drive.edges - recording.channels["command.steering"].t[0]) / 0.01
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    assert drive.edges[0] >= late["pose.x"].t[0]
    assert drive.edges[0] < late["pose.x"].t[0] + 0.01


def test_three_poses_are_too_few():
    recording = made_drive(seconds=6.0)
    few = {
        name: channel.at(slice(0, 3)) if name.startswith("pose.") else channel
        for name, channel in recording.channels.items()
    }
    with pytest.raises(RecordingError, match=r"pose\.x: expected 4 samples at least, got 3"):
        Drive(replace(recording, channels=few), big_nigel())
