"""Channels that are frozen, copied, derived or coarse, and cars that do not move at all."""

from collections.abc import Collection, Iterable, Iterator
from itertools import combinations

import numpy as np

from scm.arrays import Floats
from scm.data_quality.distance import DistanceSensor
from scm.data_quality.pose_track import (
    Series,
    Track,
    clean,
    rows_a_value,
    runs,
    series,
)
from scm.data_quality.quality import DataProblem, Span, called
from scm.recording.read import Recording

MIN_FROZEN_S = 1.0  # that a value stays while the car moves
MIN_FROZEN_ROWS = 10  # of one value
OUTLASTS = 10.0  # times what values are usually repeated for
MOVING = 0.2  # of the speed that is hardly ever exceeded
MAX_STEP_SHARE = 0.02  # of a channel's reach; larger steps are coarse
COPY_CORRELATION = 0.999999  # from which on two channels are copies
DERIVED_CORRELATION = 0.99995  # from which on a speed was computed from the poses
MOTION = ("pose.", "velocity.", "speed", "yaw_rate", "wheel_speed.", "encoder.", "imu.")
MIN_REACH_M = 0.05  # of poses that move
MIN_NOISES = 6.0  # of poses that move, in their noise
MIN_COUNTED_M = 0.1  # of distance that wheels count when a car moves


def frozen_problems(
    recording: Recording,
    found: list[DistanceSensor],
    movement: Series | None,
    clipped: Collection[Span] = (),
) -> Iterator[DataProblem]:
    """Yield channels of a repaired recording whose values no sensor of a moving car has.

    `movement` is None where the car stands or nothing shows it; in the spans `clipped` a sensor
    stays at the end of its range.
    """
    yield from _held(recording)
    coarse = list(_coarse(recording))
    for problem in _frozen(recording, movement, found, {problem.channel for problem in coarse}):
        if not set(problem.when_s or ()) <= set(clipped):
            yield problem
    yield from _copied(recording)
    if movement is not None:
        yield from _derived(recording, movement)
    yield from coarse


def _held(recording: Recording) -> Iterator[DataProblem]:
    """Yield sensors that are slower than the rows they are written in."""
    by_rate: dict[tuple[float, float], list[str]] = {}
    for name, channel in recording.channels.items():
        cleaned = clean(channel)
        if name.startswith(MOTION) and len(cleaned.t) > MIN_FROZEN_ROWS:
            every = rows_a_value(cleaned)
            period = float(np.median(np.diff(cleaned.t)))
            if every > 1:
                by_rate.setdefault((every * period, period), []).append(name)
    for (period, rows), names in by_rate.items():
        yield DataProblem(
            channel=called(names),
            name="held",
            text=f"Values change only every {1e3 * period:.0f} ms, though rows come every "
            f"{1e3 * rows:.0f} ms: each is up to that old.",
            corrected="Only rows with a new value are compared.",
            record_instead="Write a row when the sensor has a new value, with its own stamp.",
        )


def _frozen(
    recording: Recording, movement: Series | None, found: list[DistanceSensor], coarse: set[str]
) -> Iterator[DataProblem]:
    """Yield channels that stand still while another sensor sees the car move."""
    counted = Series(found[0].distance.t, _speed(found[0].distance)) if found else None
    spans = {
        name: frozen_spans(clean(channel), counted if name.startswith("pose.") else movement)
        for name, channel in recording.channels.items()
        if name.startswith(MOTION) and name not in coarse
    }
    place = [spans.get(name, ()) for name in ("pose.x", "pose.y")]
    for name, when in spans.items():
        if not when or (name.startswith("pose.") and not all(place)):
            continue  # driving along an axis, or straight, is no fault
        yield DataProblem(
            channel=name,
            name="frozen",
            text=f"Stands still for {sum(b - a for a, b in when):.1f} s while the car moves.",
            when_s=when,
            record_instead="Check the sensor's link: it repeated its last value.",
        )


def frozen_spans(channel: Series, witness: Series | None) -> tuple[Span, ...]:
    """Return spans in which values are equal to the last bit while the witness moves."""
    if witness is None or len(channel.t) < MIN_FROZEN_ROWS:
        return ()
    fast = np.percentile(np.abs(witness.values), 98) * MOVING
    starts, ends = runs(channel.values, channel.t)
    usual = OUTLASTS * float(np.percentile(ends - starts, 95))
    long = ends - starts >= max(MIN_FROZEN_ROWS, usual)
    long &= channel.t[ends - 1] - channel.t[starts] >= MIN_FROZEN_S
    spans = []
    for i, j in zip(starts[long], ends[long], strict=True):
        inside = (witness.t >= channel.t[i]) & (witness.t <= channel.t[j - 1])
        moving = np.abs(witness.values[inside]) > fast
        if fast > 0.0 and moving.size and moving.mean() > 0.5:
            spans.append((float(channel.t[i]), float(channel.t[j - 1])))
    return tuple(spans)


def _speed(distance: Series) -> Floats:
    return np.gradient(distance.values, distance.t)


def _copied(recording: Recording) -> Iterator[DataProblem]:
    """Yield pairs of channels that hold the same numbers."""
    for one, other in combinations(recording.channels, 2):
        a, b = recording.channels[one], recording.channels[other]
        if len(a.values) != len(b.values) or len(a.values) < MIN_FROZEN_ROWS:
            continue
        same = float((a.values == b.values).mean())
        if same > COPY_CORRELATION and np.ptp(a.values) > 0.0 and _both_move(a.values):
            yield DataProblem(
                channel=other,
                name="copied",
                text=f"Holds the same numbers as {one}, to the last digit.",
                corrected="Counts as one sensor, not two.",
                record_instead="Record each sensor's own channel.",
            )


def _both_move(values: Floats) -> bool:
    return len(np.unique(values)) > MIN_FROZEN_ROWS


def _derived(recording: Recording, movement: Series) -> Iterator[DataProblem]:
    """Yield speeds that somebody computed from the poses: they witness nothing."""
    pose = series(recording, "pose.x")
    y, yaw = series(recording, "pose.y"), series(recording, "pose.yaw")
    if pose is None or y is None or yaw is None or len(pose.t) != len(y.t):
        return
    vx, vy = (np.gradient(v, pose.t) for v in (pose.values, y.values))
    turned = np.unwrap(yaw.at(pose.t))
    candidates = {
        "speed": (np.hypot(vx, vy), np.cos(turned) * vx + np.sin(turned) * vy),
        "velocity.x": (np.cos(turned) * vx + np.sin(turned) * vy,),
        "yaw_rate": (np.gradient(turned, pose.t),),
    }
    for name, derived in candidates.items():
        given = series(recording, name)
        if given is None or np.ptp(given.values) == 0.0:
            continue
        inside = (pose.t >= given.t[0]) & (pose.t <= given.t[-1])
        noisy = [_alike(given.at(pose.t[inside]), values[inside]) for values in derived]
        if noisy and max(noisy) > DERIVED_CORRELATION:
            yield DataProblem(
                channel=name,
                name="derived",
                text="Follows the differences of the poses row by row, noise and all: it was "
                "computed from them.",
                corrected="Not counted as a sensor.",
                record_instead="Record a speed that the car itself measures.",
            )


def _alike(a: Floats, b: Floats) -> float:
    """Return the correlation of the row-to-row changes, in which noise shows."""
    da, db = np.diff(a), np.diff(b)
    return float(np.corrcoef(da, db)[0, 1]) if da.std() > 0.0 and db.std() > 0.0 else 0.0


def _coarse(recording: Recording) -> Iterator[DataProblem]:
    """Yield channels whose last digit is a sizable part of what they show."""
    for name, channel in recording.channels.items():
        if not name.startswith(MOTION) or name.startswith("encoder."):
            continue
        values = np.unique(channel.values[np.isfinite(channel.values)])
        if len(values) < MIN_FROZEN_ROWS:
            continue
        step = float(np.percentile(np.diff(values), 10))
        middle = channel.values[np.isfinite(channel.values)]
        reach = float(np.percentile(middle, 97.5) - np.percentile(middle, 2.5))
        even = np.abs(np.diff(values) / step - np.rint(np.diff(values) / step)).mean() < 0.02
        if reach > 0.0 and step > MAX_STEP_SHARE * reach and even:
            yield DataProblem(
                channel=name,
                name="coarse",
                text=f"Comes in steps of {step:.3g}, {100.0 * step / reach:.0f} % of its reach.",
                record_instead="Record all digits that the sensor has.",
            )


def moves(poses: Track) -> bool:
    """Return whether the poses go anywhere, beyond their own noise."""
    reach = np.hypot(_reach(poses.x), _reach(poses.y))
    noise = np.hypot(_noise(poses.x), _noise(poses.y))
    return bool(reach > MIN_REACH_M + MIN_NOISES * noise)


def stands(poses: Track, found: Iterable[DistanceSensor]) -> bool:
    """Return whether neither the poses nor any other sensor see the car move."""
    return not moves(poses) and all(np.ptp(way.distance.values) < MIN_COUNTED_M for way in found)


def standing_problem() -> DataProblem:
    """Return what to say of a recording in which nothing moves."""
    return DataProblem(
        channel="pose.*",
        name="standing",
        text="The car does not move in this recording.",
        record_instead="Drive: straights, both turns, starts and stops.",
    )


def _reach(values: Floats) -> float:
    low, high = np.percentile(values, (1, 99))
    return float(high - low)


def _noise(values: Floats) -> float:
    return float(1.4826 * np.median(np.abs(np.diff(values))) / np.sqrt(2.0))
