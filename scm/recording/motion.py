"""The measured motion of a car: pose and velocities of its rear axle at any time."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path

import numpy as np

from scm.arrays import Bools, Floats
from scm.errors import RecordingError
from scm.recording.read import Channel, Recording

POSE = ("pose.x", "pose.y", "pose.yaw")
HALF_WIDTH_S = 0.1
LONGEST_GAP_S, GAP_STEPS = 0.25, 2.5  # without a pose: so long, or so many of its usual steps
ONE_TABLE = 0.5  # of the rows have a stamp in common: x, y and yaw are columns of one table
FASTEST_MPS = 20.0  # of a scaled car
FASTEST_OVER_USUAL = 2.0  # of a full-size one: over the speed that it keeps below nearly always
LARGEST_STEP_BACK_S = 1.0


@dataclass(frozen=True, slots=True)
class Motion:
    """Rear-axle motion at given times, arrays of shape `(n,)`.

    Attributes:
        yaw: Continuous, not wrapped [rad].
        speed, lateral_speed: Body x and y velocity of the rear axle [m/s].
        valid: False where the poses have a gap or a jump close by.
    """

    t: Floats
    x: Floats
    y: Floats
    yaw: Floats
    speed: Floats
    lateral_speed: Floats
    yaw_rate: Floats
    valid: Bools


class Poses:
    """The pose channels of a recording, moved to the rear axle and made continuous.

    Where x, y and yaw are rows of one table, a pose counts where all three have a row. Where each
    comes at a rate of its own, it counts at the rows of the slowest; the others are interpolated.

    Raises:
        RecordingError: when x, y and yaw have no time in common, name different points of the
            body, or time does not go forward.
    """

    def __init__(self, recording: Recording) -> None:
        channels = {name: forward(recording, name) for name in POSE}
        self.t: Floats = _pose_times(recording.path, channels)
        yaw = channels["pose.yaw"]
        channels["pose.yaw"] = replace(yaw, values=np.unwrap(yaw.values))
        x, y, self.yaw = (np.interp(self.t, c.t, c.values) for c in channels.values())
        self.x, self.y = _at_rear_axle(x, y, self.yaw, pose_point(recording))
        self._broken = _broken_intervals(self.t, self.x, self.y)

    def motion(self, t: Floats) -> Motion:
        """Return the motion at times `t`, by a quadratic fitted to the poses within 0.1 s.

        Shorter than that the noise of a differentiated pose dominates; longer, a small car's own
        time constants of about 0.1 s would be smoothed away.
        """
        fitted = np.array([self._fit(at) for at in t]).reshape(len(t), 6)
        x, y, yaw, vx, vy, yaw_rate = fitted.T
        c, s = np.cos(yaw), np.sin(yaw)
        return Motion(
            t,
            x,
            y,
            yaw,
            c * vx + s * vy,
            c * vy - s * vx,
            yaw_rate,
            np.isfinite(fitted).all(axis=1),
        )

    def unbroken(self, start: float, end: float) -> bool:
        """Return whether the poses between two times have neither gap nor jump."""
        i, j = np.searchsorted(self.t, (start, end))
        inside = start >= self.t[0] and end <= self.t[-1]
        return bool(inside and not self._broken[max(i - 1, 0) : j].any())

    def _fit(self, at: float) -> tuple[float, ...]:
        i, j = np.searchsorted(self.t, (at - HALF_WIDTH_S, at + HALF_WIDTH_S))
        if j - i < 4:  # slow recordings: the nearest four poses
            i = max(0, min(int(np.searchsorted(self.t, at)) - 2, len(self.t) - 4))
            j = i + 4
        tau = self.t[i:j] - at
        if len(tau) < 4 or tau[0] > 0.0 or tau[-1] < 0.0 or self._broken[i : j - 1].any():
            return (np.nan,) * 6
        rows = np.stack((np.ones_like(tau), tau, tau * tau), axis=1)
        samples = np.stack((self.x[i:j], self.y[i:j], self.yaw[i:j]), axis=1)
        fit = np.linalg.lstsq(rows, samples, rcond=None)[0]
        return (*fit[0], *fit[1])


def forward(recording: Recording, name: str) -> Channel:
    """Return a channel without the rows that do not move its time forward.

    Raises:
        RecordingError: when the channel is missing, or its clock was reset in between.
    """
    channel = recording.channel(name)
    newest = np.maximum.accumulate(channel.t)
    back = newest - channel.t
    if np.any(back > LARGEST_STEP_BACK_S):
        row = int(np.argmax(back > LARGEST_STEP_BACK_S))
        msg = (
            f"{recording.path}: {name}: time jumps back by {back[row]:.3f} s, from "
            f"{newest[row]:.3f} s to {channel.t[row]:.3f} s: split the recording there"
        )
        raise RecordingError(msg)
    keep = np.concatenate(([True], newest[1:] > newest[:-1]))
    return replace(channel, t=channel.t[keep], values=channel.values[keep])


def _pose_times(path: Path, channels: Mapping[str, Channel]) -> Floats:
    """Return the stamps at which all pose channels are known."""
    stamps = {name: channel.t for name, channel in channels.items()}
    common: Floats = reduce(np.intersect1d, stamps.values())
    if len(common) >= ONE_TABLE * max(len(t) for t in stamps.values()):
        return common
    found = max(stamps.values(), key=_usual_step)
    for t in stamps.values():
        after = np.clip(np.searchsorted(t, found), 1, len(t) - 1)
        near = (t[after] == found) | (t[after] - t[after - 1] <= _longest_step(t))
        found = found[near & (found >= t[0]) & (found <= t[-1])]
    if len(found) == 0:
        spans = ", ".join(
            f"{name} from {t[0]:.3f} s to {t[-1]:.3f} s" for name, t in stamps.items()
        )
        msg = f"{path}: pose channels have no time in common: {spans}"
        raise RecordingError(msg)
    return found


def _usual_step(t: Floats) -> float:
    return float(np.median(np.diff(t))) if len(t) > 1 else np.inf


def _longest_step(t: Floats) -> float:
    """Return the longest time between two rows that is no gap [s]."""
    return max(LONGEST_GAP_S, GAP_STEPS * _usual_step(t))


def pose_point(recording: Recording) -> tuple[float, float]:
    """Return the measured point of the body [m]: it may stand on any one of the pose channels.

    Raises:
        RecordingError: when two channels name different points.
    """
    points = {name: recording.channel(name).point for name in POSE}
    named = {name: point for name, point in points.items() if any(point)}
    if len(set(named.values())) > 1:
        msg = f"{recording.path}: point: expected the same on all pose channels, got {named}"
        raise RecordingError(msg)
    return next(iter(named.values()), (0.0, 0.0))


def _at_rear_axle(
    x: Floats, y: Floats, yaw: Floats, point: tuple[float, float]
) -> tuple[Floats, Floats]:
    """Return the rear axle's positions from those of the measured point on the body."""
    px, py = point
    c, s = np.cos(yaw), np.sin(yaw)
    return x - c * px + s * py, y - s * px - c * py


def _broken_intervals(t: Floats, x: Floats, y: Floats) -> Bools:
    """Return which steps from pose to pose are a gap or a jump, shape `(n - 1,)`."""
    dt, step = np.diff(t), np.hypot(np.diff(x), np.diff(y))
    if len(dt) == 0:
        return np.zeros(0, dtype=np.bool_)
    moved_s = np.maximum(dt, _usual_step(t))  # a row after a late one comes too soon, not too far
    usual = float(np.percentile(step / moved_s, 95))
    broken: Bools = (dt > _longest_step(t)) | (
        step > max(FASTEST_MPS, FASTEST_OVER_USUAL * usual) * moved_s
    )
    return broken
