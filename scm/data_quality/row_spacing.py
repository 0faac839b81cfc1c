"""How the rows of a recording are spaced: gaps, jitter, too slow, too short."""

from collections.abc import Iterator, Sequence

import numpy as np

from scm.arrays import Floats
from scm.data_quality.problem import DataProblem, Span
from scm.recording.read import Recording

MIN_LENGTH_S = 5.0  # of a table
MIN_GAP_S = 0.25  # a longer pause between rows is a gap, if it is also longer than
MIN_GAP_STEPS = 5.0  # usual steps
MIN_COMMAND_GAP_S = 1.0  # a command is held, so it may pause longer
MAX_POSE_STEP_S = 0.1  # slower poses do not show how driving starts
MAX_JITTER = 2.0  # of the 95th percentile of steps, in usual steps
MAX_BURST_SHARE = 0.1  # of rows right after another
MIN_BURST_SHARE = 0.005  # of rows; fewer are not mentioned


def tables(recording: Recording) -> list[tuple[str, ...]]:
    """Return channels grouped by their stamps: those of one table, as far as can be seen."""
    groups: list[list[str]] = []
    for name, channel in recording.channels.items():
        for group in groups:
            if np.array_equal(recording.channels[group[0]].t, channel.t, equal_nan=True):
                group.append(name)
                break
        else:
            groups.append([name])
    return [tuple(group) for group in groups]


def called(names: Sequence[str]) -> str:
    """Return one name for several channels: `imu.*`, or all of them."""
    families = {name.partition(".")[0] for name in names}
    if len(names) == 1:
        return names[0]
    return ", ".join(sorted(f"{f}.*" if f"{f}" not in names else f for f in families))


def row_problems(recording: Recording) -> Iterator[DataProblem]:
    """Yield what is wrong with the spacing of the rows of each table."""
    for names in tables(recording):
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
