"""Channels made clean enough to compare: time goes forward, no bad rows, yaw is continuous."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.recording.read import Channel, Recording

RESET_S = 1.0
GAP_S = 0.25
GAP_STEPS = 5.0
FEWEST = 8
SHORTEST_ISLAND_S = 0.5
HELD_SHARE = 0.6
LONGEST_RUN = 50
POSE = ("pose.x", "pose.y", "pose.yaw")


@dataclass(frozen=True, slots=True)
class Series:
    """One channel with ascending stamps, shapes `(n,)`."""

    t: Floats
    values: Floats

    @property
    def period_s(self) -> float:
        """Median time between rows."""
        return float(np.median(np.diff(self.t)))

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

    @property
    def starts(self) -> tuple[int, ...]:
        """First row of each stretch without gap or jump."""
        gap = np.diff(self.t) > max(GAP_S, GAP_STEPS * self.period_s)
        return (0, *(int(i) + 1 for i in np.flatnonzero(gap | jumped(self))))

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


def series(recording: Recording, name: str) -> Series | None:
    """Return a channel made clean, None where it is missing or has next to no rows.

    Of a sensor that is slower than its rows only those with a new value are kept.
    """
    channel = recording.channels.get(name)
    if channel is None:
        return None
    cleaned = clean(channel)
    if not name.startswith("command.") and len(cleaned.t) > LONGEST_RUN:
        cleaned = fresh(cleaned)
    return cleaned if len(cleaned.t) >= FEWEST else None


def held(channel: Series, t: Floats) -> Floats:
    """Return the value of the last row at or before each time, as commands are held."""
    row = np.searchsorted(channel.t, t, side="right") - 1
    return channel.values[np.maximum(row, 0)]


def runs(values: Floats) -> tuple[Ints, Ints]:
    """Return where runs of equal values start, and where they end."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    return np.concatenate(([0], edges)), np.concatenate((edges, [len(values)]))


def rows_a_value(channel: Series) -> int:
    """Return how many rows each value is repeated for, 1 where each is new."""
    starts, ends = runs(channel.values)
    lengths = ends - starts
    short = lengths[lengths < LONGEST_RUN]
    if len(short) < 20 or (lengths > 1).sum() < HELD_SHARE * len(lengths):
        return 1
    distinct = len(np.unique(channel.values)) > 0.3 * len(lengths)
    return max(1, round(float(np.median(short)))) if distinct else 1


def fresh(channel: Series) -> Series:
    """Return the rows that hold a new value, and of a long standstill one in so many."""
    every = rows_a_value(channel)
    if every == 1:
        return channel
    starts, ends = runs(channel.values)
    age = np.arange(len(channel.t)) - np.repeat(starts, ends - starts)
    long = np.repeat(ends - starts, ends - starts) > 1.5 * every
    keep = (age == 0) | (long & (age % every == 0))
    return Series(channel.t[keep], channel.values[keep])


def track(recording: Recording) -> Track | None:
    """Return the poses at the rear axle without islands between jumps; None where too few."""
    found = track_with_jumps(recording)
    kept = None if found is None else found.cut(_mainland(found))
    return kept if kept is not None and len(kept.t) >= FEWEST else None


def track_with_jumps(recording: Recording) -> Track | None:
    """Return the poses at the rear axle, every one of them; None where too few."""
    x, y, yaw = (series(recording, name) for name in POSE)
    if x is None or y is None or yaw is None:
        return None
    turned = Series(yaw.t, np.unwrap(yaw.values))
    inside = (x.t >= max(y.t[0], yaw.t[0])) & (x.t <= min(y.t[-1], yaw.t[-1]))
    t = x.t[inside]
    if len(t) < FEWEST:
        return None
    px, py = next((p for p in (recording.channels[n].point for n in POSE) if any(p)), (0.0, 0.0))
    heading = turned.at(t)
    c, s = np.cos(heading), np.sin(heading)
    return Track(t, x.at(t) - c * px + s * py, y.at(t) - s * px - c * py, heading)


def jumped(poses: Track) -> Bools:
    """Return which steps from pose to pose are farther than the car can have moved, `(n - 1,)`."""
    dt = np.diff(poses.t)
    far = np.hypot(np.diff(poses.x), np.diff(poses.y))
    return _too_far(far, dt, 0.01) | _too_far(np.abs(np.diff(poses.yaw)), dt, 0.15)


def _too_far(step: Floats, dt: Floats, least: float) -> Bools:
    fast = float(np.percentile(step / dt, 95))
    noise = float(1.4826 * np.median(np.abs(step - np.median(step))))
    result: Bools = step > 3.0 * fast * dt + 6.0 * noise + least
    return result


def _mainland(poses: Track) -> Bools:
    """Return which poses do not lie on a short island between two jumps."""
    edges = np.concatenate(([0], np.flatnonzero(jumped(poses)) + 1, [len(poses.t)]))
    keep = np.ones(len(poses.t), dtype=np.bool_)
    for start, end in pairwise(edges):
        if poses.t[end - 1] - poses.t[start] < SHORTEST_ISLAND_S and len(edges) > 2:
            keep[start:end] = False
    return keep


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
        padded = np.concatenate((before, values, after))
        return np.asarray(np.convolve(padded, kernel, mode="valid"), dtype=np.float64)


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
        slope: Floats = -k * bell / (k**2 * bell).sum()
        return slope
    curve: Floats = (k**2 - (k**2 * bell).sum()) * bell
    curve /= 0.5 * (curve * k**2).sum()
    return curve
