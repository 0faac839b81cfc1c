"""Values of a recording: frozen, held, copied from another channel, jumping, coarse."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.doubt.corrected import forward_speed
from scm.mismatch.doubt.track import Series, Track, clean, series, track
from scm.mismatch.doubt.way import Way
from scm.mismatch.findings import DataProblem, Span
from scm.recording.read import Recording

FROZEN_S = 1.0
FEWEST_FROZEN = 10
MOVING = 0.2  # of the speed that is exceeded a tenth of the time
HELD_SHARE = 0.6
COARSE = 0.02
SAME = 0.999999
DERIVED = 0.99995
MOTION = ("pose.", "velocity.", "speed", "yaw_rate", "wheel_speed.", "encoder.", "imu.")


def stuck_problems(recording: Recording, found: list[Way]) -> Iterator[DataProblem]:
    """Yield channels whose values cannot be what a sensor of a moving car says."""
    poses = track(recording)
    movement = forward_speed(poses)
    yield from _frozen(recording, movement, found)
    yield from _copied(recording)
    if movement is not None:
        yield from _derived(recording, movement)
    yield from _coarse(recording)
    if poses is not None:
        yield from _jumps(poses)


def _frozen(
    recording: Recording, movement: Series | None, found: list[Way]
) -> Iterator[DataProblem]:
    """Yield channels that stand still while another sensor sees the car move."""
    for name in recording.channels:
        cleaned = clean(recording.channels[name])
        if not name.startswith(MOTION) or len(cleaned.t) < FEWEST_FROZEN:
            continue
        held = _held(cleaned)
        if held is not None:
            period, rows = held
            yield DataProblem(
                channel=name,
                name="held",
                said=f"Values change only every {1e3 * period:.0f} ms, though rows come every "
                f"{1e3 * rows:.0f} ms: each is up to that old.",
                corrected="Only rows with a new value are compared.",
                record_instead="Write a row when the sensor has a new value, with its own stamp.",
            )
        witness = movement
        if name.startswith("pose."):
            others = [w for w in found if w.channels[0] != name]
            witness = Series(others[0].distance.t, _speed(others[0].distance)) if others else None
        spans = frozen_spans(cleaned, witness, name)
        if spans:
            lasted = sum(b - a for a, b in spans)
            yield DataProblem(
                channel=name,
                name="frozen",
                said=f"Stands still for {lasted:.1f} s while the car moves.",
                when_s=spans,
                record_instead="Check the sensor's link: it repeated its last value.",
            )


def frozen_spans(channel: Series, witness: Series | None, name: str = "") -> tuple[Span, ...]:
    """Return spans in which values are equal to the last bit while the witness moves."""
    if witness is None:
        return ()
    fast = np.percentile(np.abs(witness.values), 90) * MOVING
    if fast <= 0.0:
        return ()
    starts, ends = _runs(channel.values)
    spans = []
    for i, j in zip(starts, ends, strict=True):
        if j - i < FEWEST_FROZEN or channel.t[j - 1] - channel.t[i] < FROZEN_S:
            continue
        inside = (witness.t >= channel.t[i]) & (witness.t <= channel.t[j - 1])
        moving = np.abs(witness.values[inside]) > fast
        if moving.size and moving.mean() > 0.5 and channel.values[i] == channel.values[j - 1]:
            spans.append((float(channel.t[i]), float(channel.t[j - 1])))
    return tuple(spans)


def _runs(values: Floats) -> tuple[np.ndarray, np.ndarray]:
    """Return where runs of equal values start, and where they end."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    return np.concatenate(([0], edges)), np.concatenate((edges, [len(values)]))


def _held(channel: Series) -> tuple[float, float] | None:
    """Return period of new values and of rows [s] where most rows repeat, else None."""
    starts, ends = _runs(channel.values)
    lengths = ends - starts
    moving = lengths[lengths < FEWEST_FROZEN * 5]
    if len(moving) < 20 or (lengths > 1).sum() < HELD_SHARE * len(lengths):
        return None
    length = float(np.median(moving))
    period = float(np.median(np.diff(channel.t)))
    steps = len(np.unique(channel.values))
    return (length * period, period) if length >= 2.0 and steps > 0.3 * len(lengths) else None


def _speed(distance: Series) -> Floats:
    return np.gradient(distance.values, distance.t)


def _copied(recording: Recording) -> Iterator[DataProblem]:
    """Yield pairs of channels that hold the same numbers."""
    for one, other in combinations(recording.channels, 2):
        a, b = recording.channels[one], recording.channels[other]
        if len(a.values) != len(b.values) or len(a.values) < FEWEST_FROZEN:
            continue
        same = float((a.values == b.values).mean())
        if same > SAME and np.ptp(a.values) > 0.0 and _both_move(a.values):
            yield DataProblem(
                channel=other,
                name="copied",
                said=f"Holds the same numbers as {one}, to the last digit.",
                corrected="Counts as one sensor, not two.",
                record_instead="Record each sensor's own channel.",
            )


def _both_move(values: Floats) -> bool:
    return len(np.unique(values)) > FEWEST_FROZEN


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
        if noisy and max(noisy) > DERIVED:
            yield DataProblem(
                channel=name,
                name="derived",
                said="Follows the differences of the poses row by row, noise and all: it was "
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
        if len(values) < FEWEST_FROZEN:
            continue
        step = float(np.percentile(np.diff(values), 10))
        middle = channel.values[np.isfinite(channel.values)]
        reach = float(np.percentile(middle, 97.5) - np.percentile(middle, 2.5))
        even = np.abs(np.diff(values) / step - np.rint(np.diff(values) / step)).mean() < 0.02
        if reach > 0.0 and step > COARSE * reach and even:
            yield DataProblem(
                channel=name,
                name="coarse",
                said=f"Comes in steps of {step:.3g}, {100.0 * step / reach:.0f} % of what it shows.",
                record_instead="Record all digits that the sensor has.",
            )


def jumped(poses: Track) -> Bools:
    """Return which steps from pose to pose are farther than the car can have moved, `(n - 1,)`."""
    dt = np.diff(poses.t)
    far = np.hypot(np.diff(poses.x), np.diff(poses.y))
    turn = np.abs(np.diff(poses.yaw))
    return _too_far(far, dt, 0.01) | _too_far(turn, dt, 0.15)


def _too_far(step: Floats, dt: Floats, least: float) -> Bools:
    fast = float(np.percentile(step / dt, 95))
    noise = float(1.4826 * np.median(np.abs(step - np.median(step))))
    result: Bools = step > 3.0 * fast * dt + 6.0 * noise + least
    return result


def _jumps(poses: Track) -> Iterator[DataProblem]:
    at = np.flatnonzero(jumped(poses))
    if len(at) == 0:
        return
    far = np.hypot(np.diff(poses.x), np.diff(poses.y))[at]
    turn = np.abs(np.diff(poses.yaw))[at]
    yield DataProblem(
        channel="pose.*",
        name="jump",
        said=f"The pose jumps {len(at)} times, by up to {far.max():.2f} m and "
        f"{np.degrees(turn.max()):.0f} deg, faster than the car moves.",
        when_s=tuple((float(poses.t[i]), float(poses.t[i + 1])) for i in at[:50]),
        corrected="Short stretches between two jumps are left out.",
        record_instead="Check for reflections and swapped markers.",
    )
