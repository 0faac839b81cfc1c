"""The measured motion of a car: its rear axle's pose and velocities at any time, from its poses."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path

import numpy as np

from scm.arrays import Bools, Floats
from scm.errors import RecordingError
from scm.recording.read import Channel, Recording

HALF_WIDTH_S = 0.1
LONGEST_GAP_S = 0.25
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

    A pose counts where all three channels have a row of the same time.

    Raises:
        RecordingError: when x, y and yaw share no times, name different points of the body, or
            time does not go forward.
    """

    def __init__(self, recording: Recording) -> None:
        channels = {name: forward(recording, name) for name in ("pose.x", "pose.y", "pose.yaw")}
        common = reduce(np.intersect1d, (channel.t for channel in channels.values()))
        if len(common) < 0.5 * max(len(channel.t) for channel in channels.values()):
            msg = f"{recording.path}: pose.x, pose.y and pose.yaw must have the same times"
            raise RecordingError(msg)
        self.t: Floats = common
        x, y, yaw = (c.values[np.isin(c.t, common)] for c in channels.values())
        self.yaw = np.unwrap(yaw)
        self.x, self.y = _at_rear_axle(x, y, self.yaw, _point(recording.path, channels))
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


def _point(path: Path, channels: Mapping[str, Channel]) -> tuple[float, float]:
    """Return the measured point of the body: it may stand on any one of the pose channels."""
    named = {name: channel.point for name, channel in channels.items() if any(channel.point)}
    if len(set(named.values())) > 1:
        msg = f"{path}: point: expected the same on all pose channels, got {named}"
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
    usual = float(np.percentile(step / dt, 95)) if len(dt) else 0.0
    broken: Bools = (dt > LONGEST_GAP_S) | (
        step > max(FASTEST_MPS, FASTEST_OVER_USUAL * usual) * dt
    )
    return broken
