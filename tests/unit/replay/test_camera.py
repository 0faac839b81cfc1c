"""A window starts at the speed that is known best: the odometer's where the poses are poor."""

from dataclasses import replace

import numpy as np
import pytest

from scm.recording.read import Channel
from scm.replay.camera import Camera
from scm.replay.drive import Drive
from tests.unit.mismatch.made_drive import big_nigel, made_drive


def with_odometer(recording, scale=1.0, noise=0.005, name="speed"):
    """The same drive with a speed that the car measures itself, off by a scale."""
    true = Drive(recording, big_nigel())
    t = true.edges[::2]
    speed = Camera(true, {}).motion(t).speed
    values = scale * speed + noise * np.random.default_rng(2).standard_normal(len(t))
    channel = Channel(t, values, None, (0.0, 0.0), "speed")
    return replace(recording, channels={**recording.channels, name: channel})


def with_poor_poses(recording, hz=12.0, std=0.03):
    """The same drive seen by beacons: few positions, and bad ones."""
    rng, channels = np.random.default_rng(3), dict(recording.channels)
    t = np.arange(recording.channel("pose.x").t[0], recording.channel("pose.x").t[-1], 1.0 / hz)
    for name in ("pose.x", "pose.y"):
        whole = channels[name]
        values = np.interp(t, whole.t, whole.values) + std * rng.standard_normal(len(t))
        channels[name] = replace(whole, t=t, values=values, std=std)
    return replace(recording, channels=channels)


def errors(recording, truth):
    drive = Drive(recording, big_nigel())
    t = drive.edges[50:-50]
    true = Camera(Drive(truth, big_nigel()), {}).motion(t).speed
    return Camera(drive, {}).motion(t).speed - true


@pytest.mark.parametrize("name", ["speed", "velocity.x"])
@pytest.mark.parametrize("scale", [1.0, 1.06, 0.94])
def test_windows_of_poor_poses_start_at_the_odometers_speed(name, scale):
    truth = made_drive(seconds=20.0)
    by_poses = errors(with_poor_poses(truth), truth)
    odometer = with_odometer(truth, scale, name=name)
    by_odometer = errors(with_poor_poses(odometer), truth)
    assert np.sqrt(np.mean(by_odometer**2)) < 0.4 * np.sqrt(np.mean(by_poses**2))
    assert abs(np.mean(by_odometer)) < 0.02  # its scale is that of the poses


def test_windows_of_good_poses_start_as_they_did_without_an_odometer():
    truth = made_drive(seconds=20.0)
    assert np.array_equal(errors(with_odometer(truth, 1.05), truth), errors(truth, truth))


def test_an_odometer_of_another_unit_is_not_believed():
    truth = made_drive(seconds=20.0)
    drive = Drive(with_poor_poses(with_odometer(truth, 3.6)), big_nigel())
    assert drive.odometer is None


def test_a_pause_of_the_odometer_leaves_the_poses_rate():
    truth = made_drive(seconds=20.0)
    recording = with_poor_poses(with_odometer(truth))
    speed = recording.channel("speed")
    keep = (speed.t < 8.0) | (speed.t > 10.0)
    recording.channels["speed"] = replace(speed, t=speed.t[keep], values=speed.values[keep])
    drive = Drive(recording, big_nigel())
    _, std = drive.odometer.at(np.array([5.0, 9.0, 12.0]))
    assert list(np.isinf(std)) == [False, True, False]
