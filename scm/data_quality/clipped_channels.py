"""Rows that are no measurements: values at a sensor's limit, and spikes where an angle wraps."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.pose_track import Series, clean, grid, long_gaps, rows_a_value, runs
from scm.data_quality.quality import DataProblem, Repair, Span
from scm.data_quality.repairs import GYROS, Repairs, forward_speed
from scm.recording.units import DIMENSIONS, UNITS, G

LIMITED = ("imu.", "yaw_rate", "speed", "velocity.", "wheel_speed.", "motor.current")
FEWEST, LONG_RUN = 8, 3  # rows at a limit, and of one run of them
DISTINCT = 8  # values beside the limit: a channel of fewer is a switch, not a sensor
CROWDED = 4.0  # times as many rows as any value next to the limit has
NOISY = 2e-3  # of the limit, and twice the last digit: no such sensor shows one value for long
BEYOND = 1.04  # times the limit: what another sensor shows there at the same moments
NEAR = 0.4  # of the limit: from there on rows tell one sensor's scale against the other's
SAME = 1e-6
WIDTH_S, STEP_S = 0.1, 0.02
SPIKE, SPIKE_RAD_S = 8.0, 3.0  # times the usual difference, and at least
TAIL, TAIL_RAD_S = 4.0, 0.05  # a filter lets a spike die away: rows that still belong to it
TOGETHER_ROWS = 5
LONGEST_SPIKE_S = 1.5  # where nothing but the sensor's own usual value tells a spike
WHOLE_TURN = 0.35  # of a turn, by which the area of spikes may differ from whole ones
AROUND_ROWS = 51


@dataclass(frozen=True, slots=True)
class _Limit:
    """One end of a sensor's range.

    Attributes:
        value: That the rows hold; `rows`: which.
    """

    value: float
    rows: Bools


def clipped_rows(now: Repairs) -> Iterator[DataProblem]:
    """Leave out rows in which a sensor shows the end of its range, not what it measures.

    Until all is compared they stay: lines drawn over them would be worse.
    """
    others = _others(now)
    for name in now.recording.channels:
        if not name.startswith(LIMITED):
            continue
        channel = clean(now.recording.channels[name])
        limits = [
            limit for sign in (1.0, -1.0) if (limit := _limit(channel, sign, others.get(name)))
        ]
        if not limits:
            continue
        rows = np.logical_or.reduce([limit.rows for limit in limits])
        spans = _spans(channel.t, rows)
        now.repairs.append(Repair(channels=(name,), out_s=spans))
        yield DataProblem(
            channel=name,
            name="clipped",
            text=f"Stops at {_values_text(name, limits)}: {int(rows.sum())} of {len(rows)} rows "
            "hold just that, the end of the sensor's range.",
            when_s=spans,
            corrected="These rows are left out.",
            record_instead="Give the sensor a range that the car does not leave.",
        )


def wrapped_rows(now: Repairs) -> Iterator[DataProblem]:
    """Leave out the spikes of a rate that somebody took from an angle in (-pi, pi]."""
    others = _others(now)
    for name in now.recording.channels:
        if name not in GYROS and not name.startswith("wheel_speed."):
            continue
        channel = clean(now.recording.channels[name])
        spikes = _whole_turns(channel, others.get(name))
        if not spikes:
            continue
        rows = np.zeros(len(channel.t), dtype=np.bool_)
        for first, last in spikes:
            rows[first : last + 1] = True
        spans = _spans(channel.t, rows)
        largest = float(np.abs(channel.values[rows]).max())
        yield now.repair(
            Repair(channels=(name,), out_s=spans),
            "wrapped",
            f"{int(rows.sum())} of {len(rows)} rows in {len(spikes)} spikes of up to "
            f"{largest:.3g} rad/s: it is the slope of an angle that wraps there by a whole turn.",
            "These rows are left out.",
            "Unwrap an angle before taking its slope.",
        )


def _others(now: Repairs) -> Mapping[str, Series]:
    """Return what the poses show of each sensor's quantity, smoothed."""
    poses, forward = now.poses, forward_speed(now.poses)
    if poses is None or forward is None:
        return {}
    width = max(WIDTH_S, 1.5 * poses.period_s)
    step_s = max(STEP_S, 0.25 * poses.period_s)
    on = grid(poses.t[0], poses.t[-1], step_s, width, long_gaps(poses.t))
    speed, turning = on.smooth(forward), on.smooth(Series(poses.t, poses.yaw), 1)
    shown = {
        "speed": speed,
        "yaw_rate": turning,
        "imu.accel_x": on.smooth(forward, 1),
        "imu.accel_y": speed * turning,
    }
    same = {"velocity.x": "speed", "imu.gyro_z": "yaw_rate"}
    same |= {name: "speed" for name in now.recording.channels if name.startswith("wheel_speed.")}
    shown |= {name: shown[like] for name, like in same.items()}
    return {name: Series(on.t, values) for name, values in shown.items()}


def _limit(channel: Series, sign: float, other: Series | None) -> _Limit | None:
    """Return the end of the range on one side, where a sensor shows that it has one."""
    values = sign * channel.values
    if len(values) < FEWEST or (limit := float(values.max())) <= 0.0:
        return None
    rows = values >= limit * (1.0 - SAME)
    distinct, count = np.unique(values[~rows], return_counts=True)
    starts, ends = runs(rows.astype(np.float64))
    at = rows[starts]
    lengths = (ends - starts)[at] / rows_a_value(channel)
    if len(distinct) < DISTINCT or rows.sum() < max(FEWEST, CROWDED * np.median(count[-DISTINCT:])):
        return None
    if _is_noisy(values, rows, limit, distinct):
        shown = True
    elif lengths.max(initial=0.0) < LONG_RUN:
        shown = False
    elif other is not None:
        shown = _goes_on(values, rows, limit, sign, channel.t, other)
    else:
        shown = _is_cut(values, starts[at], ends[at])
    return _Limit(sign * limit, rows) if shown else None


def _is_noisy(values: Floats, rows: Bools, limit: float, distinct: Floats) -> bool:
    """Return whether a sensor's noise would change its last digit from row to row."""
    third = np.abs(np.diff(values, 3))
    free = ~(rows[:-3] | rows[1:-2] | rows[2:-1] | rows[3:])
    if free.sum() < FEWEST:
        return False
    noise = 1.4826 * float(np.median(third[free])) / math.sqrt(20.0)
    digit = float(np.percentile(np.diff(distinct), 10))
    return noise > max(NOISY * limit, 2.0 * digit)


def _goes_on(
    values: Floats, rows: Bools, limit: float, sign: float, t: Floats, other: Series | None
) -> bool:
    """Return whether another sensor shows more, while this one stays at its limit."""
    if other is None:
        return False
    seen = sign * other.at(t)
    beside = ~rows & (values > NEAR * limit)
    if beside.sum() < FEWEST:
        return False
    scale = float(np.median(seen[beside] / values[beside]))
    if scale == 0.0:
        return False
    off = seen / scale - values
    noise = 1.4826 * float(np.median(np.abs(off[beside] - np.median(off[beside]))))
    return float(np.percentile(seen[rows] / scale, 75)) > max(BEYOND * limit, limit + noise)


def _is_cut(values: Floats, starts: Ints, ends: Ints) -> bool:
    """Return whether values run into the limit and out of it at full slope, more than once."""
    inside = (starts >= 2) & (ends <= len(values) - 2)
    starts, ends = starts[inside], ends[inside]
    if len(starts) < 2:
        return False
    limit = values[starts]
    into = 2.0 * values[starts - 1] - values[starts - 2] >= limit
    out = 2.0 * values[ends] - values[ends + 1] >= limit
    return bool(np.mean(into & out) > 0.5)


def _whole_turns(channel: Series, other: Series | None) -> list[tuple[int, int]]:
    """Return first and last row of each spike; none where no area of any is a whole turn."""
    t, values = channel.t, channel.values
    if len(t) < AROUND_ROWS:
        return []
    usual = _running_median(values)
    expected, scale = usual, 1.0
    if other is not None:
        seen = other.at(t)
        large = np.abs(seen) > np.percentile(np.abs(seen), 70)
        ratio = float(np.median(values[large] / seen[large])) if large.any() else 0.0
        if ratio:
            expected, scale = ratio * seen, abs(ratio)
    off = (values - expected) / scale
    noise = 1.4826 * float(np.median(np.abs(off)))
    high = max(SPIKE * noise, SPIKE_RAD_S)
    peaks = np.flatnonzero((np.abs(off) > high) & (np.abs(values - usual) > 0.5 * high * scale))
    near = np.abs(off) > TAIL * noise + TAIL_RAD_S
    starts, ends = runs(_closed(near, TOGETHER_ROWS).astype(np.float64))
    area, found, whole = off * np.gradient(t), list[tuple[int, int]](), False
    for i, j in zip(starts, ends, strict=True):
        short = other is not None or t[j - 1] - t[i] < LONGEST_SPIKE_S
        if not short or not np.any((peaks >= i) & (peaks < j)):
            continue
        turns, size = (float(np.sum(part)) / math.tau for part in (area[i:j], np.abs(area[i:j])))
        if size > 1.0 - WHOLE_TURN:
            found.append((int(i), int(j) - 1))
            whole |= abs(turns - round(turns)) < WHOLE_TURN
    return found if whole else []


def _closed(rows: Bools, most: int) -> Bools:
    """Return rows with the short breaks between them filled: spikes either way follow at once."""
    closed = rows.copy()
    starts, ends = runs(rows.astype(np.float64))
    for i, j in zip(starts[1:-1], ends[1:-1], strict=True):
        if not rows[i] and j - i <= most:
            closed[i:j] = True
    return closed


def _running_median(values: Floats) -> Floats:
    half = AROUND_ROWS // 2
    padded = np.pad(values, half, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, AROUND_ROWS)
    return np.asarray(np.median(windows, axis=1))


def _spans(t: Floats, rows: Bools) -> tuple[Span, ...]:
    """Return the time from the first to the last of each run of rows."""
    starts, ends = runs(rows.astype(np.float64), t)
    at = rows[starts]
    return tuple((float(t[i]), float(t[j - 1])) for i, j in zip(starts[at], ends[at], strict=True))


def _values_text(name: str, limits: Sequence[_Limit]) -> str:
    """Return the limits in words, `±` where they are the same on both sides."""
    dimension = DIMENSIONS[name][0]
    unit = next(
        u for u, (measures, factor) in UNITS.items() if measures == dimension and factor == 1.0
    )
    ends = [f"{limit.value:+.4g}" for limit in limits]
    if len(limits) == 2 and abs(limits[0].value + limits[1].value) < 1e-3 * limits[0].value:
        ends = [f"±{limits[0].value:.4g}"]
    text = f"{' and '.join(ends)} {unit}"
    if dimension == "acceleration":
        text += f" ({max(abs(limit.value) for limit in limits) / G:.3g} g)"
    if dimension == "angular speed":
        text += f" ({math.degrees(max(abs(limit.value) for limit in limits)):.4g} deg/s)"
    return text
