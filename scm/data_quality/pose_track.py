"""Channels made clean enough to compare: time goes forward, no bad rows, yaw is continuous."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.quality import Span
from scm.recording.read import Channel, Recording

RESET_S = 1.0
GAP_S = 0.25
GAP_STEPS = 5.0
LONG_GAP_S = 2.0  # nothing says what a car did for so long: a smoothed pose bridges less than that
USUAL = 95  # percentile of the steps; of commands that are written when they change many are long
FEWEST = 8
SHORTEST_ISLAND_S = 0.5
HELD_SHARE = 0.6
LONGEST_RUN = 50
SLOWER = 1.5  # times the rows' usual step: a sensor of its own
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
        """Return what it adds up to since its first row, nothing over long gaps."""
        areas = 0.5 * (self.values[1:] + self.values[:-1]) * np.diff(self.t)
        areas[_after_gaps(self.t) - 1] = 0.0
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
    def longest_step_s(self) -> float:
        """Longest time between two rows that is no gap."""
        return max(GAP_S, GAP_STEPS * self.period_s)

    @property
    def starts(self) -> tuple[int, ...]:
        """First row of each stretch without gap or jump."""
        gap = np.diff(self.t) > self.longest_step_s
        return (0, *(int(i) + 1 for i in np.flatnonzero(gap | jumped(self))))

    @property
    def since(self) -> Floats:
        """Time since the first row without long gaps: a clock's drift over a pause is a delay."""
        return without_pauses(self.t, float(self.t[0]), long_gaps(self.t))

    def cut(self, keep: Bools) -> "Track":
        """Return the rows that are kept."""
        return Track(self.t[keep], self.x[keep], self.y[keep], self.yaw[keep])


def long_gaps(*times: Floats) -> list[Span]:
    """Return the spans without rows that are too long to be bridged, those that overlap as one.

    The stamps of each channel rise.
    """
    gaps = sorted((float(t[i - 1]), float(t[i])) for t in times for i in _after_gaps(t))
    merged: list[Span] = []
    for first, last in gaps:
        if merged and first <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(merged[-1][1], last)
        else:
            merged.append((first, last))
    return merged


def recorded_s(t: Floats) -> float:
    """Return how long a channel lasts without its long gaps [s]."""
    return float(t[-1] - t[0]) - sum(last - first for first, last in long_gaps(t))


def without_pauses(t: Floats, start: float, gaps: Iterable[Span]) -> Floats:
    """Return how long it is from a start to some times, gaps left out [s]."""
    since: Floats = t - start
    for first, last in gaps:
        since = since - np.clip(t - first, 0.0, last - first)
    return since


def between_gaps_s(start: float, end: float, gaps: Iterable[Span]) -> float:
    """Return how long a span lasts without what lies in gaps [s]."""
    return (end - start) - sum(max(0.0, min(b, end) - max(a, start)) for a, b in gaps)


def cut_at_gaps(starts: Sequence[int], t: Floats, other: Floats) -> tuple[int, ...]:
    """Return the first rows of stretches of `t`, which another channel's long gaps end too."""
    gaps = long_gaps(other)
    rows = np.searchsorted(t, [moment for gap in gaps for moment in gap])
    return tuple(sorted({*starts, *(int(row) for row in rows if row < len(t))}))


def _after_gaps(t: Floats) -> Ints:
    """Return the first row after each long gap."""
    step = np.diff(t)
    if len(step) == 0 or step.max() <= LONG_GAP_S:
        return np.empty(0, dtype=np.int64)
    longest = max(LONG_GAP_S, GAP_STEPS * float(np.percentile(step, USUAL)))
    return np.flatnonzero(step > longest) + 1


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


def inside(t: Floats, spans: Iterable[Span]) -> Bools:
    """Return which times lie in any of some spans."""
    begins, ends = np.array(sorted(spans)).T
    i = np.searchsorted(begins, t, side="right") - 1
    return np.asarray((i >= 0) & (t <= np.maximum.accumulate(ends)[i]))


def runs(values: Floats, t: Floats | None = None) -> tuple[Ints, Ints]:
    """Return where runs of equal values start, and where they end: at long gaps of `t` too."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    if t is not None:
        edges = np.union1d(edges, _after_gaps(t))
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
    largest = None if found is None else found.cut(_mainland(found))
    return largest if largest is not None and len(largest.t) >= FEWEST else None


def track_with_jumps(recording: Recording) -> Track | None:
    """Return the poses at the rear axle, every one of them; None where too few.

    A pose stands at each row of the slowest of its channels; the others are interpolated.
    """
    x, y, yaw = (series(recording, name) for name in POSE)
    if x is None or y is None or yaw is None:
        return None
    turned = Series(yaw.t, np.unwrap(yaw.values))
    slowest = max((x, y, yaw), key=lambda one: one.period_s)
    t = slowest.t if slowest.period_s > SLOWER * x.period_s else x.t
    t = t[(t >= max(x.t[0], y.t[0], yaw.t[0])) & (t <= min(x.t[-1], y.t[-1], yaw.t[-1]))]
    if len(t) < FEWEST:
        return None
    px, py = next((p for p in (recording.channels[n].point for n in POSE) if any(p)), (0.0, 0.0))
    heading = turned.at(t)
    c, s = np.cos(heading), np.sin(heading)
    return Track(t, x.at(t) - c * px + s * py, y.at(t) - s * px - c * py, heading)


def jumped(poses: Track) -> Bools:
    """Return which steps from pose to pose are farther than the car can have moved, `(n - 1,)`."""
    dt = np.maximum(np.diff(poses.t), poses.period_s)  # the row after a late one comes too soon
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
    """Even times in pieces between long gaps, and a Gaussian that smooths what is put on them.

    Attributes:
        starts: First point of each piece.
    """

    t: Floats
    step_s: float
    width_s: float
    starts: tuple[int, ...] = (0,)

    @property
    def length_s(self) -> float:
        """How long the pieces are together."""
        return sum(float(self.t[j - 1] - self.t[i]) for i, j in self._pieces)

    def inner(self, margin: int) -> Ints:
        """Return every `margin`-th point that is not so near to an end of its piece."""
        return np.concatenate([np.arange(i + margin, j - margin, margin) for i, j in self._pieces])

    def starts_of(self, points: Ints) -> tuple[int, ...]:
        """Return which of some rising points are the first of their piece."""
        return tuple(sorted({int(i) for i in np.searchsorted(points, self.starts)} - {len(points)}))

    def smooth(self, source: Series, order: int = 0) -> Floats:
        """Return a series, or its first or second derivative, smoothed on the grid."""
        return self.smooth_even(source.at(self.t), order)

    def smooth_even(self, values: Floats, order: int = 0) -> Floats:
        """Return even values, or their derivative, smoothed, each piece alone."""
        parts = [self._smooth_piece(values[i:j], order) for i, j in self._pieces]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    @property
    def _pieces(self) -> list[tuple[int, int]]:
        return list(pairwise((*self.starts, len(self.t))))

    def _smooth_piece(self, values: Floats, order: int) -> Floats:
        kernel = _gaussian(self.width_s / self.step_s, order) / self.step_s**order
        half = min(len(kernel) // 2, len(values) - 2)
        kernel = kernel[len(kernel) // 2 - half : len(kernel) // 2 + half + 1]
        before = 2.0 * values[0] - values[half:0:-1]
        after = 2.0 * values[-1] - values[-2 : -half - 2 : -1]
        padded = np.concatenate((before, values, after))
        return np.asarray(np.convolve(padded, kernel, mode="valid"), dtype=np.float64)


def grid(
    start: float, end: float, step_s: float, width_s: float, gaps: Iterable[Span] = ()
) -> Grid:
    """Return a grid from start to end, without what lies in gaps or in tiny pieces between them."""
    inside = [gap for gap in gaps if gap[1] > start and gap[0] < end]
    if not inside:
        return Grid(np.arange(start, end, step_s), step_s, width_s)
    edges = [start, *(moment for gap in inside for moment in gap), end]
    pieces = [
        np.arange(first, last, step_s)
        for first, last in zip(edges[::2], edges[1::2], strict=True)
        if last - first >= FEWEST * step_s
    ] or [np.empty(0)]
    lengths = [len(piece) for piece in pieces]
    starts = (0, *(int(n) for n in np.cumsum(lengths[:-1])))
    return Grid(np.concatenate(pieces), step_s, width_s, starts)


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
