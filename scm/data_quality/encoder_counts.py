"""Cumulative counters: glitches left out, wraps of their integers undone, restarts joined."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.expected_motion import GENEROUS, Limits
from scm.data_quality.quality import DataProblem
from scm.data_quality.spikes import chained, held_since, single
from scm.data_quality.timestamps import left_out, problem, rows_named, times, usual_step
from scm.recording.read import Channel, Recording

COUNTERS = ("encoder.left", "encoder.right")
BITS = (8, 10, 12, 14, 16, 20, 24, 32)
DIGITS = (2, 3, 4, 5, 6)  # of counters that are decimal
FULL = 0.9  # of its range a counter has passed where it wrapped
SMALL_COUNTS = 4.0  # a pulse more or less, read a moment earlier or later
FEW = 5  # rows of a glitch
INSTEAD = "Write the counts as they add up, in an integer that is wide enough."


def repaired_counters(recording: Recording, limits: Limits) -> tuple[Recording, list[DataProblem]]:
    """Return a recording whose encoders add up from the first row to the last.

    Its stamps go forward.
    """
    channels, problems = dict(recording.channels), list[DataProblem]()
    for name in COUNTERS:
        if name in channels and len(channels[name].t) > 8:
            channel, found = _repaired(name, channels[name], limits)
            problems += found
            if channel is None:
                del channels[name]
            else:
                channels[name] = channel
    return replace(recording, channels=channels), problems


def _repaired(
    name: str, channel: Channel, limits: Limits
) -> tuple[Channel | None, list[DataProblem]]:
    """Return a counter in order, and what was done; None where it wraps too often to be read."""
    rate, slack = _reach(channel, limits)
    problems = []
    wrapped = _unwrapped(channel, rate, slack, limits.turn)
    if wrapped is not None:
        most = (limits.counts or 0.0) / GENEROUS * usual_step(channel.t)
        channel, modulus, at = wrapped
        is_clear = most < 0.5 * modulus
        problems.append(problem((name,), "wrap", (
            f"Wraps {times(len(at))}, by {modulus:.0f} counts, at {rows_named(at).lower()}"
            + ("." if is_clear else f"; at full speed it makes {most:.0f} from row to row, so that "
               "nobody knows which way."),
            "Unwrapped." if is_clear else "Not used.", INSTEAD,
        )))  # fmt: skip
        if not is_clear:
            return None, problems
    out = _glitches(channel, rate, slack)
    if out.any():
        worst, rows = _worst(channel, out), rows_named(channel.row_numbers[out])
        verb = "is" if out.sum() == 1 else "are up to"
        problems.append(problem((name,), "spike", (
            f"{rows} {verb} {worst:.0f} counts off the rows around, "
            "farther than the wheels can turn.",
            left_out(int(out.sum())),
            "Check the link for damaged messages.",
        )))  # fmt: skip
        channel = channel.at(~out)
    channel, found = _joined(name, channel, rate, slack)
    return channel, [*problems, *found]


def _reach(channel: Channel, limits: Limits) -> tuple[float, float]:
    """Return how many counts a second, and how many more at once, the wheels can make."""
    t, values = channel.t, channel.values
    period = usual_step(t)
    step = np.abs(np.diff(values))
    passed = np.maximum(t[1:] - held_since(t, values)[:-1], period)
    usual = GENEROUS * float(np.percentile(step / passed, 90))
    return max(limits.counts or 0.0, usual), SMALL_COUNTS


def _unwrapped(
    channel: Channel, rate: float, slack: float, turn: float | None
) -> tuple[Channel, float, Ints] | None:
    """Return the channel unwrapped, by how much it wraps, and the rows; None where it does not."""
    values = channel.values
    step = np.diff(values)
    best: tuple[float, Channel, float, Ints] | None = None
    for modulus in _moduli(values, step, turn):
        turns = np.rint(step / modulus)
        at = np.flatnonzero(turns)
        if len(at) == 0:
            continue
        reach = np.minimum(rate * np.diff(channel.t)[at] + slack, 0.5 * modulus)
        true = step - turns * modulus
        # An integer wraps from one end of its range to the other.
        low, high = float(values.min()), float(values.max())
        ends = (np.minimum(values[at], values[at + 1]) - low <= reach) & (
            high - np.maximum(values[at], values[at + 1]) <= reach
        )
        if not np.all((np.abs(true[at]) <= reach) & ends):
            continue
        beside = 0.5 * (true[np.maximum(at - 1, 0)] + true[np.minimum(at + 1, len(true) - 1)])
        misfit = float(np.median(np.abs(true[at] - beside)))
        if best is None or misfit < best[0] - slack:
            added = np.concatenate(([0.0], np.cumsum(-modulus * turns)))
            unwrapped = replace(channel, values=values + added)
            best = misfit, unwrapped, modulus, channel.row_numbers[at + 1]
    return None if best is None else best[1:]


def _moduli(values: Floats, step: Floats, turn: float | None) -> Iterator[float]:
    """Yield by how much a counter may wrap, likely ones first: its range is passed nearly whole."""
    reach = float(np.ptp(values))
    for bits in BITS:
        if FULL * 2.0**bits <= reach < 2.0**bits:
            yield 2.0**bits
    at = np.flatnonzero(np.abs(step) > FULL * reach)
    if len(at) > 1 and np.diff(at).min() > FEW:  # an angle, or scaled counts; not there and back
        usual = float(np.median(np.abs(step[step != 0.0])))
        found = float(np.rint(np.median(np.abs(step[at])) + usual))
        known = [10.0**digits for digits in DIGITS] + ([] if turn is None else [turn])
        yield from (m for m in known if abs(m - found) <= 2.0 * usual + SMALL_COUNTS)
        yield found


def _glitches(channel: Channel, rate: float, slack: float) -> Bools:
    """Return the rows that count what the wheels cannot have turned, and turned back."""
    t, values = channel.t, channel.values
    period = usual_step(t)

    def off(row: Ints, a: Ints, b: Ints) -> Floats:
        low, high = np.minimum(values[a], values[b]), np.maximum(values[a], values[b])
        return np.abs(values[row] - np.clip(values[row], low, high))

    half = 0.5 * np.maximum(t[2:] - t[:-2], 2.0 * period)
    alone = single(t, off, rate * half + slack)
    rows = np.flatnonzero(~alone)
    held = held_since(t, values)

    def apart(a: Ints, b: Ints) -> Floats:
        return np.abs(values[rows[b]] - values[rows[a]])

    keep, _ = chained(t[rows], held[rows], period, apart, rate, slack)
    out = np.ones(len(t), dtype=np.bool_)
    out[rows[keep]] = False
    return out


def _worst(channel: Channel, out: Bools) -> float:
    good = ~out
    between = np.interp(channel.t[out], channel.t[good], channel.values[good])
    return float(np.abs(channel.values[out] - between).max())


def _joined(
    name: str, channel: Channel, rate: float, slack: float
) -> tuple[Channel, list[DataProblem]]:
    """Return a counter whose restarts and jumps are joined: it goes on as fast as around them."""
    t, values = channel.t, channel.values
    period = usual_step(t)
    step, passed = np.diff(values), np.maximum(np.diff(t), period)
    held = t[1:] - held_since(t, values)[:-1]
    at = np.flatnonzero(np.abs(step) > rate * np.maximum(passed, held) + slack)
    if len(at) == 0 or len(at) > 0.1 * len(t):
        return channel, []
    speed = step / passed
    added = np.zeros(len(t))
    for i in at:
        near = [j for j in (i - 2, i - 1, i + 1, i + 2) if 0 <= j < len(step) and j not in at]
        on = float(np.median(speed[near])) * passed[i] if near else 0.0
        added[i + 1 :] += np.rint(on) - step[i]
    anew = [bool(abs(values[i + 1]) < 0.1 * abs(values[i])) for i in at]
    does = "Begins anew" if all(anew) else "Jumps"
    first = "; ".join(
        f"row {channel.row_numbers[i + 1]} from {values[i]:.0f} to {values[i + 1]:.0f}"
        for i in at[:3]
    )
    return replace(channel, values=values + added), [problem((name,), "restart", (
        f"{does} {times(len(at))}: {first}.",
        "Joined: it counts on as fast as in the rows around.", INSTEAD,
    ))]  # fmt: skip
