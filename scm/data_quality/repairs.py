"""Gross faults repaired one after the other, and no others: units, signs, clocks."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np

from scm.arrays import Floats
from scm.data_quality import unit_errors
from scm.data_quality.frozen_channels import moves
from scm.data_quality.pose_track import (
    POSE,
    Series,
    Track,
    grid,
    inside,
    long_gaps,
    recorded_s,
    series,
    track,
)
from scm.data_quality.problem import DataProblem, Span
from scm.data_quality.quality import Quality, Repair
from scm.data_quality.unit_errors import MotionSignal, compare
from scm.recording.read import Channel, Recording

GYROS = ("imu.gyro_z", "yaw_rate")
SHORTEST_S = 4.0
DESCRIBE = "Give the unit and sign of the column in the recording's description."
WIDTH_S = 0.1
STEP_S = 0.02
SHARED = 0.6  # of the stamps, where x, y and yaw are columns of one table with empty cells


@dataclass
class Repairs:
    """The recording as repaired so far."""

    recording: Recording
    repairs: list[Repair] = field(default_factory=list)

    def repair(self, repair: Repair) -> None:
        """Apply one more."""
        self.recording = repaired(self.recording, [repair])
        self.repairs.append(repair)

    def left_out_s(self, channels: Iterable[str]) -> list[Span]:
        """Return the spans whose rows are left out of any of these channels."""
        names = set(channels)
        return [span for one in self.repairs if names & {*one.channels} for span in one.out_s]

    @property
    def poses(self) -> Track | None:
        """The poses, None where there are too few to compare."""
        found = track(self.recording)
        long = found is not None and recorded_s(found.t) > SHORTEST_S
        return found if found is not None and long and moves(found) else None


def repair_heading(now: Repairs) -> Iterator[DataProblem]:
    """Repair a heading in degrees, or one that turns the other way than the pose moves."""
    poses, raw = now.poses, series(now.recording, "pose.yaw")
    if poses is None or raw is None:
        return
    at = np.clip(np.searchsorted(raw.t, poses.t), 0, len(raw.t) - 1)
    factor = unit_errors.heading_fault(poses, raw.values[at])
    if factor == 1.0:
        return
    mirrored = factor == -1.0 and _turns_with_gyro(now.recording, poses)
    channel = "pose.y" if mirrored else "pose.yaw"
    now.repair(Repair(channels=(channel,), factor=1.0 / factor))
    text = "The heading turns the other way than the pose moves: one axis is mirrored."
    if abs(factor) != 1.0:
        text = f"The heading is {abs(factor):.3g} times too large for the way the pose moves."
    yield DataProblem(
        channel=channel,
        name="sign" if abs(factor) == 1.0 else "unit",
        text=text,
        corrected=f"Multiplied by {1.0 / factor:.4g}.",
        record_instead="Record yaw counter-clockwise, x and y on a right-handed floor.",
    )


def repair_unsigned_speed(now: Repairs) -> Iterator[DataProblem]:
    """Give a speed that is never negative the sign of the pose's motion."""
    speed, movement = series(now.recording, "speed"), forward_speed(now.poses)
    if speed is None or movement is None or speed.values.min() < 0.0:
        return
    fast = float(np.percentile(np.abs(movement.values), 90))
    inside = (movement.t > speed.t[0]) & (movement.t < speed.t[-1])
    back = (movement.values < -0.2 * fast) & inside
    ahead = (movement.values > 0.2 * fast) & inside
    if min(back.mean(), ahead.mean()) < 0.05 or fast < 0.02:
        return
    if np.median(speed.at(movement.t)[back]) > 0.2 * fast:
        now.repair(Repair(channels=("speed",), signed=True))
        yield DataProblem(
            channel="speed",
            name="sign",
            text=f"Stays positive while the pose drives backwards ({100.0 * back.mean():.0f} % of "
            "the time).",
            corrected="Takes the sign of the pose's motion.",
            record_instead="Record speed with its sign.",
        )


def _turns_with_gyro(recording: Recording, poses: Track) -> bool:
    gyro = series(recording, GYROS[0]) or series(recording, GYROS[1])
    if gyro is None:
        return False
    turn = MotionSignal(("pose.yaw",), "angular speed", Series(poses.t, poses.yaw), 1)
    pair = compare(turn, MotionSignal(GYROS[:1], "angular speed", gyro))
    return pair is not None and pair.lag.correlation > unit_errors.RELATED


def corrected(recording: Recording, quality: Quality) -> Recording:
    """Return the recording in right units and signs, its clocks together.

    Small offsets, scales and biases stay: they are for a fit to find.
    """
    return _whole_poses(repaired(recording, quality.repairs))


def _whole_poses(recording: Recording) -> Recording:
    """Return a recording whose poses are whole: without the rows that lack x, y or yaw.

    Where each comes at a rate of its own they stay as they are.
    """
    poses = {name: recording.channels[name] for name in POSE if name in recording.channels}
    if len(poses) < len(POSE):
        return recording
    common = reduce(np.intersect1d, (channel.t for channel in poses.values()))
    rows = [len(channel.t) for channel in poses.values()]
    if min(rows) == max(rows) == len(common) or len(common) < SHARED * max(rows):
        return recording
    cut = dict[str, Channel]()
    for name, channel in poses.items():
        keep = np.isin(channel.t, common)
        cut[name] = replace(channel, t=channel.t[keep], values=channel.values[keep])
    return replace(recording, channels={**recording.channels, **cut})


def repaired(recording: Recording, repairs: Iterable[Repair]) -> Recording:
    """Return the recording with repairs applied one after the other."""
    channels = dict(recording.channels)
    for repair in repairs:
        signs = (
            forward_speed(track(replace(recording, channels=channels))) if repair.signed else None
        )
        for name in repair.channels:
            if name in channels:
                channels[name] = _repaired(channels[name], repair, signs)
    return replace(recording, channels=channels)


def forward_speed(poses: Track | None) -> Series | None:
    """Return how fast the pose moves along its heading, backwards negative [m/s]."""
    if poses is None or len(poses.t) < 8:
        return None
    width = max(WIDTH_S, 1.5 * poses.period_s)
    step_s = max(STEP_S, 0.25 * poses.period_s)
    on = grid(poses.t[0], poses.t[-1], step_s, width, long_gaps(poses.t))
    if len(on.t) < 8:
        return None
    vx, vy = (on.smooth(Series(poses.t, values), 1) for values in (poses.x, poses.y))
    yaw = on.smooth(Series(poses.t, poses.yaw))
    return Series(on.t, np.cos(yaw) * vx + np.sin(yaw) * vy)


def _repaired(channel: Channel, repair: Repair, signs: Series | None) -> Channel:
    values: Floats = repair.factor * channel.values + repair.offset
    t = channel.t + repair.shift_s
    if signs is not None:
        values = np.abs(values) * np.where(signs.at(t) < 0.0, -1.0, 1.0)
    # Nobody knows in which unit a std beside a wrong unit was meant: the values tell it instead.
    std = channel.std if abs(repair.factor) == 1.0 else None
    changed = replace(channel, t=t, values=values, std=std)
    return changed.at(~inside(t, repair.out_s)) if repair.out_s else changed
