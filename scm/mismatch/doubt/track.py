"""Channels made clean enough to compare: time goes forward, values are finite, yaw is continuous."""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.recording.read import Channel, Recording

RESET_S = 1.0
POSE = ("pose.x", "pose.y", "pose.yaw")


@dataclass(frozen=True, slots=True)
class Series:
    """One channel with ascending stamps, shapes `(n,)`."""

    t: Floats
    values: Floats

    def at(self, t: Floats) -> Floats:
        """Return values at times, by straight lines between the rows; held beyond the ends."""
        return np.interp(t, self.t, self.values)

    def integral(self) -> "Series":
        """Return what it adds up to since its first row."""
        areas = 0.5 * (self.values[1:] + self.values[:-1]) * np.diff(self.t)
        return Series(self.t, np.concatenate(([0.0], np.cumsum(areas))))


@dataclass(frozen=True, slots=True)
class Track:
    """The pose of the rear axle, yaw continuous, shapes `(n,)`."""

    t: Floats
    x: Floats
    y: Floats
    yaw: Floats

    @property
    def period_s(self) -> float:
        """Median time between rows."""
        return float(np.median(np.diff(self.t)))

    def cut(self, keep: Bools) -> "Track":
        """Return the rows that are kept."""
        return Track(self.t[keep], self.x[keep], self.y[keep], self.yaw[keep])


def clean(channel: Channel) -> Series:
    """Return the longest stretch of a channel between resets of its clock, without bad rows."""
    finite = np.isfinite(channel.t) & np.isfinite(channel.values)
    t, values = channel.t[finite], channel.values[finite]
    if len(t) == 0:
        return Series(t, values)
    edges = np.flatnonzero(np.diff(t) < -RESET_S) + 1
    parts = np.split(np.arange(len(t)), edges)
    longest = max(parts, key=lambda part: float(np.ptp(t[part])))
    t, values = t[longest], values[longest]
    newest = np.maximum.accumulate(t)
    keep = np.concatenate(([True], newest[1:] > newest[:-1]))
    return Series(t[keep], values[keep])


def series(recording: Recording, name: str, fewest: int = 8) -> Series | None:
    """Return a channel made clean, None where it is missing or has next to no rows."""
    channel = recording.channels.get(name)
    if channel is None:
        return None
    cleaned = clean(channel)
    return cleaned if len(cleaned.t) >= fewest else None


def track(recording: Recording) -> Track | None:
    """Return the poses without jumps, at the rear axle; None where there are next to none."""
    found = [series(recording, name) for name in POSE]
    x, y, yaw = found
    if x is None or y is None or yaw is None:
        return None
    turned = Series(yaw.t, np.unwrap(yaw.values))
    inside = (x.t >= max(y.t[0], yaw.t[0])) & (x.t <= min(y.t[-1], yaw.t[-1]))
    t = x.t[inside]
    if len(t) < 8:
        return None
    px, py = next((p for p in (recording.channels[n].point for n in POSE) if any(p)), (0.0, 0.0))
    heading = turned.at(t)
    c, s = np.cos(heading), np.sin(heading)
    return Track(t, x.at(t) - c * px + s * py, y.at(t) - s * px - c * py, heading)


@dataclass(frozen=True, slots=True)
class Grid:
    """Even times, and a Gaussian that smooths whatever is put on them."""

    t: Floats
    step_s: float
    width_s: float

    def smooth(self, source: Series, order: int = 0) -> Floats:
        """Return a series, or its first or second derivative, smoothed on the grid."""
        return self.smooth_even(source.at(self.t), order)

    def smooth_even(self, values: Floats, order: int = 0) -> Floats:
        """Return even values, or their derivative, smoothed."""
        kernel = _gaussian(self.width_s / self.step_s, order) / self.step_s**order
        half = min(len(kernel) // 2, len(values) - 2)
        kernel = kernel[len(kernel) // 2 - half : len(kernel) // 2 + half + 1]
        before = 2.0 * values[0] - values[half:0:-1]
        after = 2.0 * values[-1] - values[-2 : -half - 2 : -1]
        return np.convolve(np.concatenate((before, values, after)), kernel, mode="valid")


def grid(start: float, end: float, step_s: float, width_s: float) -> Grid:
    """Return a grid from start to end."""
    return Grid(np.arange(start, end, step_s), step_s, width_s)


def _gaussian(width: float, order: int) -> Floats:
    """Return the Gaussian kernel, or its derivative, to be convolved with."""
    half = max(2, int(np.ceil(4.0 * width)))
    k = np.arange(-half, half + 1)
    bell = np.exp(-0.5 * (k / width) ** 2)
    bell /= bell.sum()
    if order == 0:
        return bell
    if order == 1:
        return -k * bell / (k**2 * bell).sum()
    curve = (k**2 - (k**2 * bell).sum()) * bell
    return curve / (0.5 * (curve * k**2).sum())
