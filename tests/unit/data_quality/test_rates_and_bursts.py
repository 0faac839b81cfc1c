"""Poses of two rates, and rows that a receiver handed over together, are no faults of the car."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from scm.data_quality.check import check
from scm.data_quality.pose_track import track
from scm.data_quality.prepare import prepare
from scm.data_quality.repairs import corrected
from scm.data_quality.row_spacing import spread
from scm.recording.motion import Poses
from scm.recording.read import Channel, Recording
from scm.replay.drive import Drive
from scm.vehicles.car import Car

Make = Callable[[int], Recording]
POSE = ("pose.x", "pose.y", "pose.yaw")


def at(channel: Channel, t: np.ndarray) -> Channel:
    """A channel as a sensor of another rate would have recorded it."""
    values = np.interp(t, channel.t, np.unwrap(channel.values))
    return replace(channel, t=t, values=values)


def of_rates(recording: Recording, xy_hz: float, yaw_hz: float, offset_s: float) -> Recording:
    """Positions and headings of two sensors."""
    xy, yaw = (np.arange(0.1, 74.9, 1.0 / hz) for hz in (xy_hz, yaw_hz))
    times = {"pose.x": xy, "pose.y": xy, "pose.yaw": yaw + offset_s}
    changed = {name: at(recording.channels[name], times[name]) for name in POSE}
    return replace(recording, channels={**recording.channels, **changed})


@pytest.mark.parametrize("rates", [(12, 90), (30, 12), (15, 30), (15, 45)])
@pytest.mark.parametrize("offset_s", [0.004, 0.0])
def test_beacons_and_a_compass_of_another_rate_are_one_pose(
    drive: Make, nigel: Car, rates: tuple[int, int], offset_s: float
) -> None:
    recording = of_rates(drive(0), *rates, offset_s)
    found = check(recording, nigel)
    ready = corrected(recording, found)
    assert found.problems == ()
    assert {name: len(ready.channels[name].t) for name in POSE} == {
        name: len(recording.channels[name].t) for name in POSE
    }
    poses = track(ready)
    assert poses is not None
    assert 1.0 / poses.period_s == pytest.approx(min(rates), rel=0.01)
    assert Poses(ready).unbroken(1.0, 74.0)


def test_a_drive_begins_and_ends_where_position_and_heading_are_known(
    drive: Make, nigel: Car
) -> None:
    recording = of_rates(drive(0), 12, 90, 0.004)
    yaw = recording.channels["pose.yaw"]
    inside = (yaw.t > 5.0) & (yaw.t < 40.0)
    late = replace(yaw, t=yaw.t[inside], values=yaw.values[inside])
    edges = Drive(
        replace(recording, channels={**recording.channels, "pose.yaw": late}), nigel
    ).edges
    assert (edges[0], edges[-1]) == pytest.approx((5.0, 40.0), abs=0.1)


def handed_over(t: np.ndarray, together: int, apart_s: float = 0.0) -> np.ndarray:
    """Stamps of rows that a receiver hands over so many at a time, at the last one's moment."""
    number = np.arange(len(t))
    last = np.minimum(number // together * together + together - 1, len(t) - 1)
    return np.asarray(t[last] + apart_s * (number % together))


@pytest.mark.parametrize(("together", "apart_s"), [(5, 0.0), (5, 2e-4), (3, 0.0), (2, 0.0)])
def test_rows_handed_over_together_are_late_and_no_jumps(
    drive: Make, nigel: Car, together: int, apart_s: float
) -> None:
    def late(name: str, c: Channel) -> Channel:
        return replace(c, t=handed_over(c.t, together, apart_s)) if name in POSE else c

    recording = drive(0)
    recording = replace(recording, channels={n: late(n, c) for n, c in recording.channels.items()})
    found = prepare(recording, nigel)
    (problem,) = found.problems
    assert (problem.channel, problem.name) == ("pose.*", "bursts")
    assert f"up to {together} at one moment" in problem.text
    (ready,) = found.recordings
    for name in POSE:
        channel, true = ready.channels[name], drive(0).channels[name]
        np.testing.assert_allclose(channel.t, true.t, atol=0.6 / 30.0)
        np.testing.assert_allclose(
            channel.t[together:-together], true.t[together:-together], atol=2e-3
        )
    assert found.quality.suspicions == ()


def test_a_stall_now_and_then_is_spread_and_nothing_else_is_moved() -> None:
    true = np.arange(0.0, 20.0, 0.02)
    t = true.copy()
    t[500:515] = t[515] - 1e-4
    right = spread(t)
    np.testing.assert_allclose(right, true, atol=0.021)
    assert np.array_equal(right[:500], true[:500])
    assert np.all(np.diff(right) > 0.0)


def test_copies_of_a_row_are_no_burst(drive: Make, nigel: Car) -> None:
    def twice(name: str, c: Channel) -> Channel:
        return replace(c, t=np.repeat(c.t, 2), values=np.repeat(c.values, 2)) if name in POSE else c

    recording = drive(0)
    recording = replace(recording, channels={n: twice(n, c) for n, c in recording.channels.items()})
    assert "bursts" not in {p.name for p in prepare(recording, nigel).problems}


@pytest.mark.parametrize("rows", [5, 12])
def test_poses_of_a_link_that_stalls_are_late_and_no_jumps(
    drive: Make, nigel: Car, rows: int
) -> None:
    def stalls(name: str, c: Channel) -> Channel:
        t = c.t.copy()
        for first in range(300, 2000, 400) if name in POSE else ():
            t[first : first + rows] = t[first + rows] - 1e-3
        return replace(c, t=t)

    true = drive(0)
    late = replace(true, channels={n: stalls(n, c) for n, c in true.channels.items()})
    found = prepare(late, nigel)
    assert [p.name for p in found.problems] == ["bursts"]
    (ready,) = found.recordings
    np.testing.assert_allclose(ready.channels["pose.x"].t, true.channels["pose.x"].t, atol=0.035)


def test_commands_of_one_moment_stay_where_they_are(drive: Make, nigel: Car) -> None:
    def late(name: str, c: Channel) -> Channel:
        return replace(c, t=handed_over(c.t, 5)) if name.startswith("command.") else c

    recording = drive(0)
    recording = replace(recording, channels={n: late(n, c) for n, c in recording.channels.items()})
    assert "bursts" not in {p.name for p in prepare(recording, nigel).problems}
