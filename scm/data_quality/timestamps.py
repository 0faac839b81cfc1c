"""Stamps of a recording's rows: their unit, strays, their order, clocks that were set, repeats."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.expected_motion import Limits
from scm.data_quality.quality import DataProblem, called
from scm.recording.read import Channel, Recording, Source
from scm.recording.units import UNITS

FACTORS = (1e-3, 1e-6, 1e-9, 1e3, 1e6, 1e9, 1.0 / 60.0, 60.0)
POSE_STEP_S = (2e-4, 2.0)  # no camera is faster, and slower poses show no driving
USUAL_STEP_S = 0.02
LONGEST_STEPS = 5.0  # times what hardly any step exceeds: what is longer is a gap
OFF = 5.0  # times what the car can do: no other car explains that, but another unit of time does
CREEPS = 0.01  # of what the car can do: no drive is so slow all the time
ALIKE = math.log(3.0)  # two tables of one drive last about as long
OTHERWISE = math.log(30.0)
EPOCH = 100.0  # times its own length from zero: a clock that counts from 1970
PAUSE_S, PAUSE_STEPS = 1.0, 50.0  # what is farther from the row before is another block of rows
STRAY_ROWS = 5  # a block of more rows is a part of the drive
MOST = 0.5  # of the rows are in such blocks, or no block says what is stray
ALONE_S, ALONE_SPANS = 60.0, 10.0  # a first or last row so far from all others
HOLE = 1.5  # usual steps: a row that was written late is missing where it belongs
JITTER = 0.5  # of the usual step: the stamps are wrong, not the order
RESET_S = 1.0
BETWEEN_S = 10.0  # a pause in which nothing is compared, and in which a delay cannot hide
ROUGHER = 1.5  # values that move so much more in the order of their stamps are of two drives
HELD = ("command.", "light.")  # signals that hold until their next row
MOTION = ("pose.x", "pose.y")


@dataclass(frozen=True, slots=True)
class Table:
    """The rows of one table, in the order of the file.

    Attributes:
        names: Of its channels.
        numbers: Of its rows, from 1, shape `(n,)`; `t`: their stamps [s].
        source: Where they were read; None where no file tells.
    """

    names: tuple[str, ...]
    numbers: Ints
    t: Floats
    source: Source | None

    @property
    def label(self) -> str:
        """What to call it in a message."""
        return called(self.names) if self.source is None else self.source.table

    @property
    def is_held(self) -> bool:
        """Return whether no channel of it is measured: rows may come only when they change."""
        return all(name.startswith(HELD) for name in self.names)

    @property
    def step_s(self) -> float:
        """Usual time between two rows; NaN of one row [s]."""
        return usual_step(np.sort(self.t)) or math.nan

    @property
    def span_s(self) -> tuple[float, float]:
        """Stamps between which nine tenths of the rows lie [s]."""
        low, high = np.percentile(self.t, (5.0, 95.0))
        return float(low), float(high)


def usual_step(t: Floats) -> float:
    """Return the mean time between rows without gaps; in bursts most steps are next to none [s]."""
    steps = np.diff(t)
    if len(steps) == 0:
        return 0.0
    return float(steps[steps <= LONGEST_STEPS * np.percentile(steps, 98)].mean())


def tables_of(recording: Recording) -> list[Table]:
    """Return the tables of a recording; channels that no file tells apart, by equal stamps."""
    return [_table(recording, names) for names in _grouped(recording, _of_one_file)]


def same_stamps(recording: Recording) -> list[tuple[str, ...]]:
    """Return channels grouped by their stamps: those of one table, as far as can be seen."""
    return _grouped(recording, _of_one_clock)


def _grouped(
    recording: Recording, together: Callable[[Channel, Channel], bool]
) -> list[tuple[str, ...]]:
    groups: list[list[str]] = []
    for name, channel in recording.channels.items():
        group = next((g for g in groups if together(recording.channels[g[0]], channel)), None)
        if group is None:
            groups.append([name])
        else:
            group.append(name)
    return [tuple(group) for group in groups]


def _of_one_clock(one: Channel, other: Channel) -> bool:
    return np.array_equal(one.t, other.t, equal_nan=True)


def _of_one_file(one: Channel, other: Channel) -> bool:
    if one.source is not None and other.source is not None:
        return one.source.index == other.source.index
    return _of_one_clock(one, other)


def _table(recording: Recording, names: tuple[str, ...]) -> Table:
    channels = [recording.channels[name] for name in names]
    source = channels[0].source
    every = [channel.row_numbers for channel in channels]
    rising = len(every[0]) < 2 or bool(np.diff(every[0]).min() > 0)  # sorted rows may stand anyhow
    if rising and all(np.array_equal(numbers, every[0]) for numbers in every[1:]):
        return Table(names, every[0], channels[0].t, source)
    numbers, first = np.unique(np.concatenate(every), return_index=True)
    t = np.concatenate([channel.t for channel in channels])[first]
    return Table(names, numbers, t, source)


def with_numbers(recording: Recording) -> tuple[Recording, list[DataProblem]]:
    """Return a recording without rows that hold no number, and how many there were, as read."""
    channels, problems = dict(recording.channels), list[DataProblem]()
    for name, channel in recording.channels.items():
        good = np.isfinite(channel.t) & np.isfinite(channel.values)
        channels[name] = channel if good.all() else channel.at(good)
        source, rows = channel.source, len(good)
        if source is not None and len(source.numbers) == rows:
            rows = source.rows - source.excluded
        lost = rows - int(good.sum())
        if lost:
            problems.append(problem((name,), "not_finite", (
                f"{lost} of {rows} rows {'holds' if lost == 1 else 'hold'} no number.",
                left_out(lost),
                "Write nothing where a sensor has nothing to say.",
            )))  # fmt: skip
    return replace(recording, channels=channels), problems


def in_seconds(recording: Recording, limits: Limits) -> tuple[Recording, list[DataProblem]]:
    """Return a recording whose stamps are seconds, judged by what the car can do meanwhile."""
    every = [table for table in tables_of(recording) if len(table.t) > 2]
    if not every:
        return recording, []
    posed = next((t for t in every if "pose.x" in t.names), None)
    reference = posed or min(every, key=lambda t: abs(math.log(_step(t) / USUAL_STEP_S)))
    motion = _motion(recording) if posed else None
    factor = _own_factor(_step(reference), motion, limits)
    low, high = (factor * at for at in reference.span_s)
    factors = {reference.names: factor}
    for table in every:
        if table is not reference:
            factors[table.names] = _factor_beside(table, low, high)
    channels, problems = dict(recording.channels), list[DataProblem]()
    for table in every:
        factor = factors[table.names]
        if factor == 1.0:
            continue
        for name in table.names:
            channels[name] = replace(channels[name], t=factor * channels[name].t)
        problems.append(_unit_problem(table, factor))
    return replace(recording, channels=channels), problems


def _step(table: Table) -> float:
    step = table.step_s
    return step if step > 0.0 else USUAL_STEP_S


def _motion(recording: Recording) -> tuple[float, float] | None:
    """Return the speed and turning that poses hardly exceed; None where they hardly move."""
    channels = [recording.channels.get(name) for name in (*MOTION, "pose.yaw")]
    if any(c is None or len(c.t) < 3 for c in channels):
        return None
    rates = []
    for channel in channels:
        if channel is None:
            return None
        order = np.argsort(channel.t, kind="stable")
        # In which order the rows belong is not known yet: in the one in which they move less.
        orders = (channel.values, channel.values[order])
        moved = min(float(np.percentile(np.abs(np.diff(values)), 90)) for values in orders)
        step = usual_step(channel.t[order])
        rates.append(moved / step if step > 0.0 else 0.0)
    speed = math.hypot(rates[0], rates[1])
    return (speed, rates[2]) if speed > 0.0 else None


def _own_factor(step: float, motion: tuple[float, float] | None, limits: Limits) -> float:
    """Return what turns the poses' stamps into seconds, 1 where they are."""
    low, high = POSE_STEP_S
    speed, turning = motion or (0.0, 0.0)

    def fits(factor: float) -> bool:
        fast = speed > OFF * factor * limits.speed and turning > OFF * factor * limits.turning
        slow = motion is not None and speed < CREEPS * factor * limits.speed
        return low <= step * factor <= high and not fast and not (slow and step * factor > 0.5)

    if fits(1.0):
        return 1.0
    known = [factor for factor in FACTORS if fits(factor)]
    return min(known, key=lambda f: abs(math.log(f * step / USUAL_STEP_S)), default=1.0)


def _factor_beside(table: Table, low: float, high: float) -> float:
    """Return what turns a table's stamps into seconds, beside poses that are."""
    span = high - low
    first, last = table.span_s
    middle, here = 0.5 * (low + high), 0.5 * (first + last)
    if abs(middle) > EPOCH * span > 0.0 and here > 0.0 and middle > 0.0:
        near = [f for f in FACTORS if abs(f * here - middle) < ALONE_SPANS * span]
        return near[0] if near and abs(here - middle) > EPOCH * span else 1.0
    own = last - first
    if own <= 0.0 or span <= 0.0 or abs(math.log(own / span)) < OTHERWISE:
        return 1.0
    return next((f for f in FACTORS[:6] if abs(math.log(own * f / span)) < ALIKE), 1.0)


def _unit_problem(table: Table, factor: float) -> DataProblem:
    given = "s" if table.source is None else table.source.time_unit
    per_unit = UNITS[given][1] * factor
    unit = next((u for u in ("ns", "us", "ms", "s", "min")
                 if abs(math.log(UNITS[u][1] / per_unit)) < 0.01), "")  # fmt: skip
    return problem(table.names, "unit", (
        f"Rows stand {table.step_s:.3g} s apart with stamps in {given}: is the unit "
        f"{unit or f'{per_unit:g} s'}?",
        f"Stamps are read as {unit}." if unit else f"Stamps are multiplied by {factor:g}.",
        "Give the unit of the time column in the recording's description.",
    ))  # fmt: skip


def without_strays(recording: Recording) -> tuple[Recording, list[DataProblem]]:
    """Return a recording without single rows that are stamped far from all others."""
    channels, problems = dict(recording.channels), list[DataProblem]()
    for table in tables_of(recording):
        stray = _strays(table)
        if not stray.any():
            continue
        for name in table.names:
            channel = channels[name]
            channels[name] = channel.at(~np.isin(channel.row_numbers, table.numbers[stray]))
        problems.append(_stray_problem(table, stray))
    return replace(recording, channels=channels), problems


def _strays(table: Table) -> Bools:
    """Return which rows of a table are stamped far from those around them, `(n,)`."""
    t, found = table.t, np.zeros(len(table.t), dtype=np.bool_)
    if len(t) <= 2 * STRAY_ROWS:
        return found
    pause = max(PAUSE_S, PAUSE_STEPS * _step(table))
    edges = np.flatnonzero(np.abs(np.diff(t)) > pause) + 1
    if len(edges) == 0:
        return found
    starts, ends = np.append(0, edges), np.append(edges, len(t))
    large = np.flatnonzero(ends - starts > STRAY_ROWS)
    if (ends - starts)[large].sum() < MOST * len(t):  # sparse, or of rows in any order
        return _alone(table)
    in_order = np.sort(np.concatenate([t[starts[b] : ends[b]] for b in large]))
    for b in np.setdiff1d(np.arange(len(starts)), large):
        rows = slice(int(starts[b]), int(ends[b]))
        before, after = large[large < b], large[large > b]
        last = t[ends[before[-1]] - 1] if len(before) else -np.inf
        first = t[starts[after[0]]] if len(after) else np.inf
        if last > first and min(abs(t[rows][0] - last), abs(first - t[rows][-1])) <= pause:
            continue  # beside a clock that was set
        between = last <= t[rows][0] and t[rows][-1] <= first and last <= first
        if between and math.isfinite(last) and math.isfinite(first):
            continue  # in order, in a pause
        found[rows] = _is_stray(table, t[rows], in_order, pause, between=between)
    return found


def _is_stray(table: Table, rows: Floats, others: Floats, pause: float, *, between: bool) -> bool:
    """Return whether a few rows belong nowhere: not to a hole of the others, nor beside them."""
    to_ends = max(others[0] - rows[-1], rows[0] - others[-1])
    if to_ends > 0.0:
        far = pause
        if between:  # the first or the last of the file: a command may stand long before
            far = max(ALONE_S, ALONE_SPANS * float(others[-1] - others[0]))
        return bool(to_ends > far)
    after = np.searchsorted(others, rows)
    fits = others[np.minimum(after, len(others) - 1)] - others[np.maximum(after - 1, 0)]
    return not table.is_held and bool((fits < HOLE * _step(table)).all())


def _alone(table: Table) -> Bools:
    """Return the first or last rows of a sparse table that are far from all its others."""
    order = np.argsort(table.t, kind="stable")
    t = table.t[order]
    far = max(ALONE_S, ALONE_SPANS * float(np.median(np.diff(t))) * len(t))
    found = np.zeros(len(t), dtype=np.bool_)
    for rows, gap in ((order[:1], t[1] - t[0]), (order[-1:], t[-1] - t[-2])):
        found[rows] = gap > far
    return found


def _stray_problem(table: Table, stray: Bools) -> DataProblem:
    t, others = table.t[stray], table.t[~stray]
    low, high = float(others.min()), float(others.max())
    epoch = abs(low) > EPOCH * (high - low)
    close = epoch and bool(np.all(np.abs(t - low) < abs(low) * 1e-3))
    digits = ".3f" if close else ".6g"
    span = f"near {low:.6g}" if epoch and not close else f"from {low:{digits}} to {high:{digits}}"
    values = ", ".join(dict.fromkeys(f"{value:{digits}}" for value in t[:3]))
    more = " ..." if len(t) > 3 else ""
    verb = "is" if len(t) == 1 else "are"
    return problem(table.names, "stray", (
        f"{rows_named(table.numbers[stray])} {verb} stamped {values}{more} s, the others {span} s.",
        left_out(len(t)),
        "Start to record when the clock is set.",
    ))  # fmt: skip


def in_order(recording: Recording) -> tuple[Recording, list[DataProblem]]:
    """Return a recording with the rows in the order of their stamps.

    Rows that were written late are sorted in. Of neighbours whose stamps are swapped by less than
    half a step the second is left out. Where all clocks were set back, what follows is moved behind
    what came before, with a pause between them; where some were, it goes on beside the others.
    """
    recording, problems = _without_jitter(recording)
    every = tables_of(recording)
    cuts = {table.names: _resets(recording, table) for table in every}
    set_back = [table for table in every if len(cuts[table.names]) == max(map(len, cuts.values()))]
    # a table whose clock alone was set back goes on beside the others, which did not pause
    between_s = BETWEEN_S if len(set_back) == len(every) else max(map(_step, set_back))
    moves = _moves([_parts(table.t, cuts[table.names]) for table in set_back], between_s)
    channels = dict(recording.channels)
    for table in every:
        t = table.t
        if table in set_back:
            parts = _parts(t, cuts[table.names])
            t = np.concatenate([part + move for part, move in zip(parts, moves, strict=True)])
        if np.all(np.diff(t) >= 0.0) and not cuts[table.names]:
            continue
        for name in table.names:
            rows = np.searchsorted(table.numbers, channels[name].row_numbers)
            moved = replace(channels[name], t=t[rows])
            channels[name] = moved.at(np.argsort(moved.t, kind="stable"))
        problems += _order_problems(table, cuts[table.names], moves, t)
    return replace(recording, channels=channels), problems


def _without_jitter(recording: Recording) -> tuple[Recording, list[DataProblem]]:
    """Return a recording without measured rows that stand a little before the row above."""
    channels, problems = dict(recording.channels), list[DataProblem]()
    for table in tables_of(recording):
        back = np.maximum.accumulate(table.t) - table.t
        early = (back > 0.0) & (back < JITTER * _step(table))
        if table.is_held or not early.any():
            continue
        for name in table.names:
            rows = np.searchsorted(table.numbers, channels[name].row_numbers)
            channels[name] = channels[name].at(~early[rows])
        worst_ms = 1e3 * float(back[early].max())
        problems.append(problem(table.names, "time_backwards", (
            f"{rows_named(table.numbers[early])} {'is' if early.sum() == 1 else 'are'} stamped up "
            f"to {worst_ms:.1f} ms before the row above.",
            left_out(int(early.sum())),
            "Stamp a value where it is measured, not where it arrives.",
        )))  # fmt: skip
    return replace(recording, channels=channels), problems


def _parts(t: Floats, cuts: Sequence[int]) -> list[Floats]:
    return np.split(t, np.asarray(cuts, dtype=np.int64))


def _moves(tables: Sequence[Sequence[Floats]], between_s: float) -> list[float]:
    """Return what to add to the stamps of each part, so that it comes after the one before."""
    moves, end = list[float](), -np.inf
    for parts in zip(*tables, strict=True):
        begin = min(float(t.min()) for t in parts)
        moves.append(0.0 if begin > end + between_s or not moves else end + between_s - begin)
        end = max(float(t.max()) for t in parts) + moves[-1]
    return moves


def _resets(recording: Recording, table: Table) -> list[int]:
    """Return the rows of a table from which on its clock was set back."""
    t = table.t
    newest = np.maximum.accumulate(t)
    back = np.flatnonzero((np.diff(t) < 0.0) & (newest[:-1] - t[1:] > RESET_S)) + 1
    if len(back) == 0:
        return []
    ends = np.concatenate(([0], back, [len(t)]))
    if np.diff(ends).min() <= STRAY_ROWS:  # no clock is set so often: rows were mixed
        return []
    order = np.argsort(t, kind="stable")
    steps = np.diff(t[order])
    crowded = float((steps < 0.2 * np.median(np.diff(t))).mean())
    filed = sorted_ = 0.0
    for name in table.names:
        values = recording.channels[name].values
        is_other = name.startswith(HELD) and not table.is_held
        if is_other or len(values) != len(t):
            continue
        size = float(values.std()) or 1.0
        whole = np.abs(np.diff(values))
        whole[back - 1] = 0.0
        filed += float(whole.sum()) / size
        sorted_ += float(np.abs(np.diff(values[order])).sum()) / size
    mixed = sorted_ > ROUGHER * filed or crowded > 0.3
    return [int(row) for row in back] if mixed else []


def _order_problems(
    table: Table, resets: Sequence[int], moves: Sequence[float], moved: Floats
) -> Iterator[DataProblem]:
    t = table.t
    if resets:
        jumps = ", ".join(
            f"at row {table.numbers[row]} by {t[row - 1] - t[row]:.3f} s" for row in resets[:3]
        )
        by = ", ".join(f"{move:+.3f} s" for move in moves[1:4])
        yield problem(table.names, "time_backwards", (
            f"The clock is set back {times(len(resets))}, {jumps}.",
            f"What follows stands behind what came before, its stamps moved by {by}.",
            "Stamp with a clock that is never set, and write one file a drive.",
        ))  # fmt: skip
    lag = np.maximum.accumulate(moved) - moved
    if np.any(lag > 0.0):
        yield problem(table.names, "time_backwards", (
            f"{count_of(int((lag > 0.0).sum()))} of {len(t)} stand below later ones, by up to "
            f"{lag.max():.3f} s.",
            "Sorted by their stamps.",
            "Write rows as they come, each stamped where it is measured.",
        ))  # fmt: skip


def without_repeats(recording: Recording) -> tuple[Recording, list[DataProblem]]:
    """Return a sorted recording with one row a stamp: the last of a command, the first measured."""
    channels, problems = dict(recording.channels), list[DataProblem]()
    for table in tables_of(recording):
        repeated = 0
        for name in table.names:
            channel = channels[name]
            same = np.diff(channel.t) == 0.0
            if not same.any():
                continue
            no = np.zeros(1, dtype=np.bool_)
            drop = np.concatenate((same, no) if name.startswith(HELD) else (no, same))
            channels[name] = channel.at(~drop)
            repeated = max(repeated, int(drop.sum()))
        if repeated:
            counts = "the last" if table.is_held else "the first"
            if not table.is_held and any(name.startswith(HELD) for name in table.names):
                counts = "of commands the last, of what is measured the first"
            verb = "repeats" if repeated == 1 else "repeat"
            problems.append(problem(table.names, "duplicate", (
                f"{count_of(repeated)} of {len(table.t)} {verb} the stamp of another.",
                f"Of each stamp {counts} row counts.",
                "Write one row a reading, with all digits of its stamp.",
            )))  # fmt: skip
    return replace(recording, channels=channels), problems


def problem(names: Sequence[str], name: str, words: tuple[str, str, str]) -> DataProblem:
    """Return a problem of some channels: what is wrong, what was done, what to record instead."""
    text, corrected, instead = words
    return DataProblem(
        channel=called(names), name=name, text=text, corrected=corrected, record_instead=instead
    )


def rows_named(numbers: Ints) -> str:
    """Return `Row 7`, or `3 rows (7, 9, 12)`."""
    if len(numbers) == 1:
        return f"Row {numbers[0]}"
    first = ", ".join(str(number) for number in numbers[:5])
    return f"{len(numbers)} rows ({first}{', ...' if len(numbers) > 5 else ''})"


def count_of(rows: int) -> str:
    """Return `1 row`, or `3 rows`."""
    return "1 row" if rows == 1 else f"{rows} rows"


def times(number: int) -> str:
    """Return `once`, or `3 times`."""
    return "once" if number == 1 else f"{number} times"


def left_out(rows: int) -> str:
    """Return the sentence that so many rows are left out."""
    return f"{count_of(rows)} left out."
