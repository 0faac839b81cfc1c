"""Velocities from poses are those of the rear axle, and gaps are told, not bridged."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.errors import RecordingError
from scm.recording.motion import Poses
from scm.recording.read import Channel, Recording

RADIUS_M, SPEED_MPS = 0.5, 0.25
POINT = (0.115, 0.01)


def circle(t: np.ndarray, point: tuple[float, float] = POINT) -> Recording:
    """A car on a circle to the left, its rear axle at constant speed; the pose is of `point`."""
    angle = SPEED_MPS / RADIUS_M * t
    yaw = angle + np.pi / 2
    x = RADIUS_M * np.cos(angle) + np.cos(yaw) * point[0] - np.sin(yaw) * point[1]
    y = RADIUS_M * np.sin(angle) + np.sin(yaw) * point[0] + np.cos(yaw) * point[1]
    wrapped = np.arctan2(np.sin(yaw), np.cos(yaw))
    values = {"pose.x": x, "pose.y": y, "pose.yaw": wrapped}
    channels = {name: Channel(t, value, None, point, "length") for name, value in values.items()}
    return Recording(Path("circle"), "nigel", channels)


def test_a_circle_gives_its_speed_and_yaw_rate_at_the_rear_axle() -> None:
    motion = Poses(circle(np.arange(0.0, 20.0, 0.01))).motion(np.array([5.0, 10.0, 15.0]))
    # the quadratic fit over 0.2 s leaves (omega * 0.1)^2 / 10 of the speed: 2.5e-4
    assert_allclose(motion.speed, SPEED_MPS, rtol=3e-4)
    assert_allclose(motion.lateral_speed, 0.0, atol=3e-4)
    assert_allclose(motion.yaw_rate, SPEED_MPS / RADIUS_M, rtol=1e-6)
    assert_allclose(np.hypot(motion.x, motion.y), RADIUS_M, rtol=1e-4)


def test_slow_poses_are_still_differentiated() -> None:
    motion = Poses(circle(np.arange(0.0, 20.0, 0.1))).motion(np.array([5.03]))
    assert motion.valid.all()
    assert_allclose(motion.speed, SPEED_MPS, rtol=3e-3)


def test_a_gap_is_not_bridged() -> None:
    t = np.arange(0.0, 20.0, 0.01)
    poses = Poses(circle(t[(t < 8.0) | (t > 8.5)]))
    assert not poses.motion(np.array([8.25])).valid.any()
    assert not poses.unbroken(7.0, 9.0)
    assert poses.unbroken(9.0, 12.0)


def test_a_jump_of_the_tracker_breaks_the_window() -> None:
    t = np.arange(0.0, 20.0, 0.01)
    recording = circle(t)
    recording.channel("pose.x").values[1000] += 2.0
    poses = Poses(recording)
    assert not poses.unbroken(9.0, 11.0)
    assert poses.unbroken(1.0, 9.0)


def test_times_that_jump_back_are_refused() -> None:
    t = np.arange(0.0, 20.0, 0.01)
    t[1000:] -= 5.0
    with pytest.raises(
        RecordingError, match=r"pose\.x: time jumps back by 4\.990 s, from 9\.990 s to 5\.000 s"
    ):
        Poses(circle(t))


def without(channel: Channel, rows: slice) -> Channel:
    return replace(channel, t=np.delete(channel.t, rows), values=np.delete(channel.values, rows))


def test_a_cell_missing_in_one_column_costs_that_pose_only() -> None:
    recording = circle(np.arange(0.0, 20.0, 0.01))
    recording.channels["pose.y"] = without(recording.channel("pose.y"), slice(1000, 1001))
    recording.channels["pose.yaw"] = without(recording.channel("pose.yaw"), slice(1500, 1501))
    poses = Poses(recording)
    assert len(poses.t) == 1998
    assert_allclose(poses.motion(np.array([10.0])).speed, SPEED_MPS, rtol=1e-3)


def at_rates(x_hz: float, y_hz: float, yaw_hz: float) -> Recording:
    """A circle of which each pose channel has a table of its own, with stamps of its own."""
    begins = {"pose.x": (0.0, x_hz), "pose.y": (0.001, y_hz), "pose.yaw": (0.003, yaw_hz)}
    channels = {
        name: circle(np.arange(begin, 20.0, 1.0 / hz)).channel(name)
        for name, (begin, hz) in begins.items()
    }
    return Recording(Path("circle"), "nigel", channels)


@pytest.mark.parametrize("rates", [(12, 12, 90), (90, 90, 12), (12, 30, 90), (50, 50, 50)])
def test_a_pose_counts_at_the_stamps_of_its_slowest_channel(rates: tuple[int, int, int]) -> None:
    poses = Poses(at_rates(*rates))
    motion = poses.motion(np.array([5.0, 10.0, 15.0]))
    assert len(poses.t) == pytest.approx(20.0 * min(rates), abs=2)
    assert poses.unbroken(1.0, 19.0)
    assert_allclose(motion.speed, SPEED_MPS, rtol=6e-3)
    assert_allclose(motion.yaw_rate, SPEED_MPS / RADIUS_M, rtol=1e-3)
    assert_allclose(np.hypot(motion.x, motion.y), RADIUS_M, atol=1e-3)


def test_a_gap_in_the_faster_channel_is_not_bridged() -> None:
    recording = at_rates(12, 12, 90)
    yaw = recording.channel("pose.yaw")
    recording.channels["pose.yaw"] = without(yaw, slice(720, 765))  # 8.0 s to 8.5 s
    poses = Poses(recording)
    assert not poses.unbroken(7.0, 9.0)
    assert poses.unbroken(9.0, 12.0)


def test_poses_of_three_a_second_are_slow_and_not_gaps() -> None:
    assert Poses(circle(np.arange(0.0, 20.0, 1.0 / 3.0))).unbroken(1.0, 19.0)


def test_pose_channels_that_never_meet_in_time_are_refused() -> None:
    recording = circle(np.arange(0.0, 20.0, 0.01))
    yaw = recording.channel("pose.yaw")
    recording.channels["pose.yaw"] = replace(yaw, t=yaw.t + 100.0)
    with pytest.raises(RecordingError, match=r"no time in common.*pose\.yaw from 100\.000 s"):
        Poses(recording)


def test_late_stamps_are_no_jumps() -> None:
    t = np.arange(0.0, 20.0, 0.02)
    recording = circle(t)
    late = t.copy()
    late[500] += 0.0195  # handed over just before the next one
    for name, channel in recording.channels.items():
        recording.channels[name] = replace(channel, t=late, values=40.0 * channel.values)
    assert Poses(recording).unbroken(1.0, 19.0)


@pytest.mark.parametrize("keeps", ["pose.x", "pose.y", "pose.yaw"])
def test_the_point_may_stand_on_any_pose_channel(keeps: str) -> None:
    recording = circle(np.arange(0.0, 20.0, 0.01))
    for name in {"pose.x", "pose.y", "pose.yaw"} - {keeps}:
        recording.channels[name] = replace(recording.channels[name], point=(0.0, 0.0))
    motion = Poses(recording).motion(np.array([5.0]))
    assert_allclose(np.hypot(motion.x, motion.y), RADIUS_M, rtol=1e-4)


def test_two_points_for_one_pose_are_refused() -> None:
    recording = circle(np.arange(0.0, 20.0, 0.01))
    recording.channels["pose.y"] = replace(recording.channels["pose.y"], point=(0.1, 0.0))
    with pytest.raises(RecordingError, match="point: expected the same"):
        Poses(recording)


def test_a_full_size_car_is_fast_and_does_not_jump() -> None:
    t = np.arange(200) / 25.0
    channels = {
        name: Channel(t, values, None, (0.0, 0.0), "length")
        for name, values in (("pose.x", 60.0 * t), ("pose.y", 0.0 * t), ("pose.yaw", 0.0 * t))
    }
    poses = Poses(Recording(Path("made"), "car", channels))
    assert poses.unbroken(0.0, 7.0)
    channels["pose.x"].values[100] += 30.0
    assert not Poses(Recording(Path("made"), "car", channels)).unbroken(3.5, 4.5)
