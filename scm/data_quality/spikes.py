"""Single rows that no motion of the car explains: spikes of poses and rates, and where poses jump.

A row is out where the car can be neither there and back in time, nor accelerate so, but can drive
from the row before to the row after. Places from which it does not come back are jumps.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from msgspec import structs

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.expected_motion import GENEROUS, Limits
from scm.data_quality.quality import DataProblem, Span
from scm.data_quality.timestamps import left_out, problem, rows_named, times, usual_step
from scm.recording.read import Channel, Recording

SHORT_S = 0.5  # what lies elsewhere for less is a row or a few, not a place where the car was
JUMP_S = 0.25  # a jump costs as much as that much of the rows left out, see `chained`
HELD_S = 0.5  # a value that stays as it is may be so old
NOISES = 8.0
SMALL = 0.05  # of the wheelbase: a smaller spike does no harm
SMALL_RAD = 0.02
BEYOND = 0.35  # of a spike: what its neighbours may be off where it is the only one
FEW, SHARE = 3, 0.01  # rows beyond a limit; more are no glitch but another unit, or another car
WIDE_SHARE = 0.1  # of steps too far for the car: then it is another car, not a glitch
LOOK_BACK = 200
LARGEST_COMMAND = 1.5
RATES = {
    "speed": "speed", "velocity.x": "speed", "velocity.y": "speed",
    "yaw_rate": "turning", "imu.gyro_z": "turning",
    **{f"wheel_speed.{wheel}": "wheels" for wheel in ("fl", "fr", "rl", "rr")},
}  # fmt: skip
YAW = ("pose.yaw",)
Distance = Callable[[Ints, Ints], Floats]


def without_spikes(
    recording: Recording, limits: Limits
) -> tuple[Recording, list[DataProblem], tuple[Span, ...]]:
    """Return a recording without rows that its car cannot explain, and where its poses jump.

    Its stamps go forward.
    """
    channels, problems, jumps = _screened_poses(recording, limits)
    for name, channel in channels.items():
        limit = _limit(name, channel, limits)
        if limit is None:
            continue
        out = _beyond(channel.values, limit)
        if out.any():
            problems.append(_too_large(name, channel, out, limit))
            channels[name] = channel.at(~out)
    return replace(recording, channels=channels), problems, jumps


def _screened_poses(
    recording: Recording, limits: Limits
) -> tuple[dict[str, Channel], list[DataProblem], tuple[Span, ...]]:
    """Return the channels with poses that are whole and possible, and where these jump."""
    channels, problems = dict(recording.channels), list[DataProblem]()
    jumps, gone, far = set[Span](), [np.empty(0)], list[str]()
    groups = _pose_groups(recording)
    for names in groups:
        keep, jumped, size = _screened_pose([channels[name] for name in names], names, limits)
        t = channels[names[0]].t
        jumps |= {(float(t[keep][i]), float(t[keep][i + 1])) for i in jumped}
        if not keep.all():
            gone.append(t[~keep])
            far.append(f"{size:.3g} {'rad' if names == YAW else 'm'}")
    lost = np.unique(np.concatenate(gone))
    posed = [name for names in groups for name in names]
    if len(lost):
        rows = max((channels[n] for n in posed), key=lambda c: int(np.isin(c.t, lost).sum()))
        problems.append(_spikes(posed, rows, np.isin(rows.t, lost), " and ".join(far)))
    for name in posed:
        channels[name] = channels[name].at(~np.isin(channels[name].t, lost))
    if jumps:
        problems.append(_jumps(posed, sorted(jumps)))
    return channels, problems, tuple(sorted(jumps))


def chained(
    t: Floats, since: Floats, period: float, far: Distance, rate: float, slack: float
) -> tuple[Bools, Ints]:
    """Return which rows a car can have come along, `(n,)`, and after which kept rows it jumps.

    Of all ways to leave rows out, the one that leaves out the least time; a jump counts as
    `JUMP_S`.

    Args:
        t: Stamps, rising, `(n,)` [s].
        since: From when each value is, `(n,)`: a value that is repeated is as old as its first row.
        period: Usual step [s].
        far: How far rows are from other rows.
        rate: How fast the car is at most.
        slack: What noise adds.
    """
    n = len(t)
    keep = np.ones(n, dtype=np.bool_)
    i = np.arange(n - 1)

    def reachable(a: Ints, b: Ints) -> Bools:
        passed = np.maximum(t[b] - since[a], (b - a) * period)
        return np.asarray(far(a, b) <= rate * passed + slack)

    breaks = i[~reachable(i, i + 1)]
    if len(breaks) == 0 or len(breaks) > WIDE_SHARE * n:
        return keep, np.empty(0, dtype=np.int64)
    starts, ends = np.append(0, breaks + 1), np.append(breaks, n - 1)
    weight = (ends - starts + 1) * period
    best, came = weight.copy(), np.full(len(starts), -1)
    for k in range(1, len(starts)):
        first = int(np.searchsorted(t[ends[:k]], t[starts[k]] - SHORT_S - period))
        j = np.arange(max(min(first, k - 1), k - LOOK_BACK), k)
        score = best[j] - np.where(reachable(ends[j], np.full(len(j), starts[k])), 0.0, JUMP_S)
        top = int(np.argmax(score))
        if score[top] > 0.0:
            best[k], came[k] = weight[k] + score[top], j[top]
    keep[:] = False
    jumps, last = list[int](), int(np.argmax(best))
    while last >= 0:
        keep[starts[last] : ends[last] + 1] = True
        before = int(came[last])
        if before >= 0 and not reachable(ends[[before]], starts[[last]])[0]:
            jumps.append(int(ends[before]))
        last = before
    number = np.cumsum(keep) - 1
    return keep, number[np.array(jumps[::-1], dtype=np.int64)]


def held_since(t: Floats, *columns: Floats) -> Floats:
    """Return from when each row's values are: those that repeat are as old as their first row."""
    changed = np.ones(len(t), dtype=np.bool_)
    changed[1:] = np.any([np.diff(values) != 0.0 for values in columns], axis=0)
    first = np.maximum.accumulate(np.where(changed, np.arange(len(t)), 0))
    return np.maximum(t[first], t - HELD_S)


def single(t: Floats, off: Callable[[Ints, Ints, Ints], Floats], bound: Floats) -> Bools:
    """Return which rows alone are off the way between their neighbours, `(n,)`.

    `off` gives how far rows are off the line between two others each; motion and noise explain
    `bound`, `(n - 2,)`.
    """
    n, found = len(t), np.zeros(len(t), dtype=np.bool_)
    i = np.arange(1, n - 1)
    residual = np.zeros(n)
    residual[1:-1] = off(i, i - 1, i + 1)
    noise = NOISES * float(np.percentile(residual[1:-1], 75))
    suspect = i[residual[1:-1] > np.maximum(bound, noise)]
    for row in suspect:
        near = residual[max(row - 2, 0) : row + 3]
        if residual[row] < near.max():
            continue
        beside = [(row - 1, row - 2, row + 1), (row + 1, row - 1, row + 2)]
        inside = np.array([b for b in beside if min(b) >= 0 and max(b) < n])
        found[row] = off(*inside.T).max() < BEYOND * residual[row]
    return found


def _pose_groups(recording: Recording) -> list[tuple[str, ...]]:
    """Return the pose channels that are screened together: x and y where they share their rows."""
    have = [name for name in ("pose.x", "pose.y", "pose.yaw") if name in recording.channels]
    have = [name for name in have if len(recording.channels[name].t) > 8]
    x, y = (recording.channels.get(name) for name in ("pose.x", "pose.y"))
    both = x is not None and y is not None and {"pose.x", "pose.y"} <= set(have)
    if both and x is not None and y is not None and np.array_equal(x.t, y.t):
        return [("pose.x", "pose.y"), *[(name,) for name in have if name == "pose.yaw"]]
    return [(name,) for name in have]


def _screened_pose(
    channels: Sequence[Channel], names: Sequence[str], limits: Limits
) -> tuple[Bools, Ints, float]:
    """Return which rows to keep, after which of them the pose jumps, and how far the worst is."""
    t, turns = channels[0].t, tuple(names) == YAW
    values = np.stack([channel.values for channel in channels], axis=1)

    def apart(a: Ints, b: Ints) -> Floats:
        steps = values[b] - values[a]
        size = _wrapped(steps) if turns else steps
        return np.asarray(np.linalg.norm(size, axis=1))

    def off(row: Ints, a: Ints, b: Ints) -> Floats:
        whole, part = values[b] - values[a], values[row] - values[a]
        if turns:
            whole, part = _wrapped(whole), _wrapped(part)
        share = np.sum(part * whole, axis=1) / np.maximum(np.sum(whole**2, axis=1), 1e-30)
        beside = part - np.clip(share, 0.0, 1.0)[:, None] * whole
        return np.asarray(np.linalg.norm(beside, axis=1))

    period = usual_step(t)
    since = held_since(t, *values.T)
    every = np.arange(len(t) - 1)
    step = apart(every, every + 1)
    passed = np.maximum(t[1:] - since[:-1], period)
    usual = GENEROUS * float(np.percentile(step / passed, 90))
    rate = max(limits.turning if turns else limits.speed, usual)
    small = SMALL_RAD if turns else SMALL * limits.length
    half = 0.5 * np.maximum(t[2:] - t[:-2], 2.0 * period)
    bound = rate * half if turns else np.minimum(rate * half, 0.5 * limits.acceleration * half**2)
    alone = single(t, off, np.maximum(bound, small))
    rows = np.flatnonzero(~alone)
    noise = NOISES * float(np.median(np.abs(step - np.median(step))))
    keep, jumps = chained(
        t[rows], since[rows], period, lambda a, b: apart(rows[a], rows[b]), rate, noise + small
    )
    whole = np.zeros(len(t), dtype=np.bool_)
    whole[rows[keep]] = True
    after = np.clip(np.searchsorted(np.flatnonzero(whole), np.flatnonzero(~whole)), 1, None)
    good = np.flatnonzero(whole)
    after = np.minimum(after, len(good) - 1)
    beside = off(np.flatnonzero(~whole), good[after - 1], good[after])
    return whole, jumps, float(beside.max(initial=0.0))


def _wrapped(angles: Floats) -> Floats:
    return np.asarray((angles + np.pi) % (2.0 * np.pi) - np.pi)


def _limit(name: str, channel: Channel, limits: Limits) -> float | None:
    """Return what the values of a rate or a command stay below; None where nothing is known."""
    if name in RATES:
        return float(getattr(limits, RATES[name]))
    if name.startswith("command.") and channel.dimension == "ratio":
        return LARGEST_COMMAND
    return None


def _beyond(values: Floats, limit: float) -> Bools:
    """Return rows beyond a limit where they are few, and few together."""
    large = np.abs(values) > limit
    none = np.zeros(len(values), dtype=np.bool_)
    if not large.any() or large.sum() > max(1.0, SHARE * len(values)):
        return none
    edges = np.flatnonzero(np.diff(np.concatenate(([0], large.astype(np.int8), [0]))))
    longest = int(np.max(edges[1::2] - edges[::2]))
    return large if longest <= FEW else none


def _spikes(names: Sequence[str], channel: Channel, out: Bools, far: str) -> DataProblem:
    t = channel.t[out]
    verb = "lies" if len(t) == 1 else "lie"
    found = problem(names, "spike", (
        f"{rows_named(channel.row_numbers[out])} {verb} up to {far} off the rows around, farther "
        "than the car can move.",
        left_out(len(t)),
        "Check for reflections, swapped markers, and angles interpolated through half a turn.",
    ))  # fmt: skip
    return structs.replace(found, when_s=tuple((float(at), float(at)) for at in t[:50]))


def _jumps(names: Sequence[str], spans: Sequence[Span]) -> DataProblem:
    found = problem(names, "jump", (
        f"The pose jumps {times(len(spans))}, faster than the "
        f"car can move, at {', '.join(f'{first:.2f} s' for first, _ in spans[:5])}.",
        "Cut there: each part is compared on its own.",
        "Check for reflections and swapped markers; record a car that is carried as two drives.",
    ))  # fmt: skip
    return structs.replace(found, when_s=tuple(spans[:50]))


def _too_large(name: str, channel: Channel, out: Bools, limit: float) -> DataProblem:
    worst = float(channel.values[out][np.argmax(np.abs(channel.values[out]))])
    rows = rows_named(channel.row_numbers[out])
    reach = "reaches" if out.sum() == 1 else "reach"
    can = "the car obeys" if name.startswith("command.") else "the car can do"
    return problem((name,), "spike", (
        f"{rows} {reach} {worst:.4g}, beyond the {limit:.3g} that {can}.",
        left_out(int(out.sum())),
        "Check the sensor's link for damaged messages.",
    ))  # fmt: skip
