"""The measured motion of a car: its rear axle's pose and velocities at any time, from its poses."""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.errors import RecordingError
from scm.recording.read import Channel, Recording

HALF_WIDTH_S = 0.1
LONGEST_GAP_S = 0.25
FASTEST_MPS = 20.0


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

    Raises:
        RecordingError: when x, y and yaw are not of one table, or time does not go forward.
    """

    def __init__(self, recording: Recording) -> None:
        x, y, yaw = (recording.channel(f"pose.{axis}") for axis in ("x", "y", "yaw"))
        if not (np.array_equal(x.t, y.t) and np.array_equal(x.t, yaw.t)):
            msg = f"{recording.path}: pose.x, pose.y and pose.yaw must have the same times"
            raise RecordingError(msg)
        first = _forward(x.t, recording)
        self.t = x.t[first]
        self.yaw = np.unwrap(yaw.values[first])
        self.x, self.y = _at_rear_axle(x, y, first, self.yaw)
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


def _forward(t: Floats, recording: Recording) -> Bools:
    """Return which rows to keep so that time strictly increases; refuse a clock that was reset."""
    newest = np.maximum.accumulate(t)
    if np.any(newest - t > 1.0):
        row = int(np.argmax(newest - t > 1.0))
        msg = f"{recording.path}: pose times jump back by {newest[row] - t[row]:.3f} s at row {row}"
        raise RecordingError(msg)
    return np.concatenate(([True], newest[1:] > newest[:-1]))


def _at_rear_axle(x: Channel, y: Channel, keep: Bools, yaw: Floats) -> tuple[Floats, Floats]:
    """Return the rear axle's positions from those of the measured point on the body."""
    px, py = x.point
    c, s = np.cos(yaw), np.sin(yaw)
    return x.values[keep] - c * px + s * py, y.values[keep] - s * px - c * py


def _broken_intervals(t: Floats, x: Floats, y: Floats) -> Bools:
    """Return which steps from pose to pose are a gap or a jump, shape `(n - 1,)`."""
    dt = np.diff(t)
    broken: Bools = (dt > LONGEST_GAP_S) | (np.hypot(np.diff(x), np.diff(y)) > FASTEST_MPS * dt)
    return broken
