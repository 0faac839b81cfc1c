"""How the rows of a recording are spaced: gaps, jitter, too slow, too short; bursts.

A link that stalls, or a driver that reads a whole buffer, writes several readings at one moment
after a pause as long as they took: a burst. Their stamps are late, each by another time.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.quality import DataProblem, Span, called
from scm.data_quality.timestamps import HELD, Table, problem, same_stamps, tables_of, usual_step
from scm.recording.read import Recording

MIN_LENGTH_S = 5.0  # of a table
MIN_GAP_S = 0.25  # a longer pause between rows is a gap, if it is also longer than
MIN_GAP_STEPS = 5.0  # usual steps
MIN_COMMAND_GAP_S = 1.0  # a command is held, so it may pause longer
MAX_POSE_STEP_S = 0.1  # slower poses do not show how driving starts
MAX_JITTER = 2.0  # of the 95th percentile of steps, in usual steps
MAX_BURST_SHARE = 0.1  # of rows right after another
MIN_BURST_SHARE = 0.005  # of rows; fewer are not mentioned
TOGETHER = 0.2  # of the usual step, as which rows are handed over together at most
LATE = 0.6  # of the usual step that each row of a burst takes of the pause before it, at least
LONGEST_STEP = 1.25  # usual steps between rows that are spread: a longer pause was a gap as well
IN_BURSTS = 0.05  # of a table's rows; below, a row is late now and then
MOST_IN_BURSTS = 0.4  # of a table's rows: all come so
LONG_BURST = 4  # rows of one stall, which needs no other
CHANGING = 0.5  # of the usual share of rows that change: below, a burst is copies of one row
INFORMS = 1.15  # times the bends of rows that are not late: motion shows beside the noise
STEADIER = (1.2, 0.7)  # bends that are left of a motion, of those before, at most


def row_problems(recording: Recording) -> Iterator[DataProblem]:
    """Yield what is wrong with the spacing of the rows of each table."""
    for names in same_stamps(recording):
        channel = recording.channels[names[0]]
        if len(channel.t) >= 2:
            yield from _spacing(channel.t, called(names), names)


def _spacing(t: Floats, at: str, names: Sequence[str]) -> Iterator[DataProblem]:
    step = np.diff(t)
    step = step[step > 0.0]
    if len(step) == 0:
        return
    period, span = float(np.median(step)), float(np.ptp(t))
    command = all(name.startswith("command.") for name in names)
    if span < MIN_LENGTH_S and not command:
        yield DataProblem(
            channel=at,
            name="too_short",
            text=f"Holds {span:.1f} s, less than {MIN_LENGTH_S:.0f} s.",
            record_instead="Drive for 60 s or more: straights, both turns, starts and stops.",
        )
    gaps = gaps_of(t, command)
    if gaps:
        lost = sum(end - start for start, end in gaps)
        yield DataProblem(
            channel=at,
            name="gap",
            text=_gaps_text(gaps, lost, span),
            when_s=gaps,
            corrected="Nothing is compared across a gap.",
        )
    if any(name.startswith("pose.") for name in names) and period > MAX_POSE_STEP_S:
        yield DataProblem(
            channel=at,
            name="slow",
            text=f"A pose every {period:.2f} s shows steady driving, not how it starts or steers.",
            record_instead="Record poses at 20 Hz or more.",
        )
    yield from _jitter(step, period, at, command=command)


def _gaps_text(gaps: Sequence[Span], lost_s: float, span_s: float) -> str:
    if len(gaps) == 1:
        return f"One gap of {lost_s:.2f} s in {span_s:.1f} s."
    longest_s = max(end - start for start, end in gaps)
    lost = f"{len(gaps)} gaps, {lost_s:.1f} s of {span_s:.1f} s"
    return f"{lost}; the longest lasts {longest_s:.2f} s."


def _jitter(step: Floats, period: float, at: str, *, command: bool) -> Iterator[DataProblem]:
    high = float(np.percentile(step, 95))
    bursts = float((step < 0.1 * period).mean())
    if not command and (high > MAX_JITTER * period or bursts > MAX_BURST_SHARE):
        text = f"Rows come every {1e3 * period:.1f} ms as a rule, but one in twenty "
        text += f"only after {1e3 * high:.0f} ms or more"
        if bursts > MIN_BURST_SHARE:
            text += f", and {100.0 * bursts:.0f} % right after another"
        yield DataProblem(
            channel=at,
            name="jitter",
            text=f"{text}.",
            record_instead="Stamp a value where it is measured, not where it arrives.",
        )


def gaps_of(t: Floats, command: bool = False) -> tuple[Span, ...]:
    """Return the spans in which nothing was recorded; a command is held, so it may pause longer."""
    step = np.diff(t)
    forward = step[step > 0.0]
    if len(forward) == 0:
        return ()
    longest = max(
        MIN_COMMAND_GAP_S if command else MIN_GAP_S, MIN_GAP_STEPS * float(np.median(forward))
    )
    return tuple((float(t[i]), float(t[i + 1])) for i in np.flatnonzero(step > longest))


def without_bursts(recording: Recording) -> tuple[Recording, list[DataProblem]]:
    """Return a sorted recording in which rows of one moment are spread over the pause before."""
    channels, problems = dict(recording.channels), list[DataProblem]()
    for table in tables_of(recording):
        order = np.lexsort((table.numbers, table.t))
        t = table.t[order]
        _, size = bursts(t)
        few = size.sum() < IN_BURSTS * len(t) and size.max(initial=0) < LONG_BURST
        if table.is_held or len(size) == 0 or few:
            continue
        even = np.empty_like(t)
        even[order] = spread(t)
        if not _are_late(recording, table, even, usual=size.sum() > MOST_IN_BURSTS * len(t)):
            continue
        for name in table.names:
            channel = channels[name]
            at = np.searchsorted(table.numbers, channel.row_numbers)
            channels[name] = replace(channel, t=even[at])
        late_ms, step_ms = 1e3 * float(np.abs(even - table.t).max()), 1e3 * usual_step(t)
        problems.append(problem(table.names, "bursts", (
            f"{int(size.sum())} of {len(t)} rows were handed over up to {int(size.max())} at one "
            f"moment: their stamps are late by up to {late_ms:.0f} ms.",
            f"Their stamps are spread evenly, {step_ms:.3g} ms apart.",
            "Stamp a value where it is measured, not where it arrives.",
        )))  # fmt: skip
    return replace(recording, channels=channels), problems


def bursts(t: Floats) -> tuple[Ints, Ints]:
    """Return the first row of each burst, and of how many rows it is; `t` does not fall.

    A burst follows a pause that is long enough for all its rows.
    """
    usual_s = usual_step(t)
    same = np.concatenate(([False], _together(t, usual_s), [False]))
    first = np.flatnonzero(~same[:-1] & same[1:])
    size = np.flatnonzero(same[:-1] & ~same[1:]) - first + 1
    pause = np.where(first > 0, t[first] - t[first - 1], np.inf)
    late = pause >= LATE * usual_s * size
    return first[late], size[late]


def spread(t: Floats) -> Floats:
    """Return stamps with the rows of each burst even; the last row of each is right."""
    usual_s, spread_t = usual_step(t), t.copy()
    for first, size in zip(*bursts(t), strict=True):
        end = t[first + size - 1]
        step = usual_s
        if first > 0:
            step = min(LONGEST_STEP * usual_s, (end - t[first - 1]) / size)
        spread_t[first : first + size] = end - step * np.arange(size - 1, -1, -1)
    return spread_t


def _together(t: Floats, usual_s: float) -> Bools:
    """Return which steps are so short that both rows were handed over together, `(n - 1,)`."""
    return np.asarray(np.diff(t) < TOGETHER * usual_s)


def _are_late(recording: Recording, table: Table, even: Floats, *, usual: bool) -> bool:
    """Return whether rows of one moment are late, by the motion that they show.

    Copies of a row are not, nor is what is sent: it holds from when it is sent. Where most rows
    come so (`usual`), noise may hide what the motion says. `even` are the stamps, spread.
    """
    changing, left = list[tuple[float, float]](), list[float]()
    for name in table.names:
        channel = recording.channels[name]
        if name.startswith(HELD) or len(channel.t) < 3:
            continue
        t, spread_t = channel.t, even[np.searchsorted(table.numbers, channel.row_numbers)]
        values = np.unwrap(channel.values) if name == "pose.yaw" else channel.values
        moved, at_once = spread_t != t, _together(t, usual_step(t))
        if at_once.any() and not at_once.all():
            change = np.diff(values) != 0.0
            changing.append((float(change[at_once].mean()), float(change[~at_once].mean())))
        undisturbed = ~np.convolve(moved, np.ones(5), mode="same").astype(np.bool_)
        before, after = (_bends(stamps, values, moved) for stamps in (t, spread_t))
        noise = 0.0 if usual else _bends(t, values, undisturbed)
        if before > INFORMS * noise:
            left.append((after - noise) / (before - noise))
    if not any(together >= CHANGING * apart for together, apart in changing):
        return False
    return float(np.median(left or [1.0])) < (STEADIER[0] if usual else STEADIER[1])


def _bends(t: Floats, values: Floats, rows: Bools) -> float:
    """Return how far values of some rows are off the line between their neighbours, on average."""
    share = (t[1:-1] - t[:-2]) / np.maximum(t[2:] - t[:-2], 1e-9)
    off = values[1:-1] - values[:-2] - share * (values[2:] - values[:-2])
    some = np.abs(off[rows[1:-1]])
    return float(some.mean()) if len(some) else 0.0
