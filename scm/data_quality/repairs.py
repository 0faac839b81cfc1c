"""Gross faults repaired one after the other, and no others: units, signs, clocks."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np

from scm.arrays import Floats
from scm.data_quality.distance import distance_sensors, travel_against
from scm.data_quality.expected_motion import (
    MIN_CORRELATION,
    share_of_expected_speed,
    steady_speed,
    steered_in_wheel_angles,
    top_speed,
)
from scm.data_quality.frozen_channels import moves
from scm.data_quality.pose_comparison import push_of, yaw_against
from scm.data_quality.pose_track import (
    POSE,
    Series,
    Track,
    grid,
    inside,
    long_gaps,
    recorded_s,
    series,
    track,
)
from scm.data_quality.quality import DataProblem, Quality, Repair, Span, called
from scm.data_quality.signal_pairs import (
    MIN_CLOCK_OFFSET_S,
    RELATED,
    UNLIKE,
    MotionSignal,
    Pair,
    compare,
    heading_fault,
    nearest_factor,
    unit_of,
)
from scm.data_quality.timestamps import same_stamps
from scm.recording.read import Channel, Recording
from scm.vehicles.car import Car

GYROS = ("imu.gyro_z", "yaw_rate")
SHORTEST_S = 4.0
SHOWN = 50  # spans of a problem
DESCRIBE = "Give the unit and sign of the column in the recording's description."
WIDTH_S = 0.1
STEP_S = 0.02
SHARED = 0.6  # of the stamps, where x, y and yaw are columns of one table with empty cells
LENGTHS = (1e-3, 1e-2, 1e-1, 1e1, 1e2, 1e3)
CERTAIN, LARGEST_LEAK = 12.0, 3.0
BELIEVABLE = (0.03, 1.4)  # of the car's top speed


@dataclass
class Repairs:
    """The recording as repaired so far."""

    recording: Recording
    repairs: list[Repair] = field(default_factory=list)
    _tracked: tuple[Recording, Track | None] | None = field(default=None, init=False, repr=False)

    def repair(
        self, repair: Repair, name: str, text: str, corrected: str, instead: str = DESCRIBE,
        channel: str = "",
    ) -> DataProblem:  # fmt: skip
        """Apply one more, and return the problem that it repairs."""
        self.recording = repaired(self.recording, [repair])
        self.repairs.append(repair)
        return DataProblem(
            channel=channel or called(repair.channels), name=name, text=text, corrected=corrected,
            record_instead=instead, when_s=repair.out_s[:SHOWN] or None,
        )  # fmt: skip

    def left_out_s(self, channels: Iterable[str]) -> list[Span]:
        """Return the spans whose rows are left out of any of these channels."""
        names = set(channels)
        return [span for one in self.repairs if names & {*one.channels} for span in one.out_s]

    @property
    def poses(self) -> Track | None:
        """The poses, None where there are too few to compare; computed once for each repair."""
        if self._tracked is None or self._tracked[0] is not self.recording:
            found = track(self.recording)
            long = found is not None and recorded_s(found.t) > SHORTEST_S
            usable = found if found is not None and long and moves(found) else None
            self._tracked = self.recording, usable
        return self._tracked[1]


def repair_heading(now: Repairs) -> Iterator[DataProblem]:
    """Repair a heading in degrees, or one that turns the other way than the pose moves."""
    poses, raw = now.poses, series(now.recording, "pose.yaw")
    if poses is None or raw is None:
        return
    at = np.clip(np.searchsorted(raw.t, poses.t), 0, len(raw.t) - 1)
    factor = heading_fault(poses, raw.values[at])
    if factor == 1.0:
        return
    mirrored = factor == -1.0 and _turns_with_gyro(now.recording, poses)
    channel = "pose.y" if mirrored else "pose.yaw"
    text = "The heading turns the other way than the pose moves: one axis is mirrored."
    if abs(factor) != 1.0:
        text = f"The heading is {abs(factor):.3g} times too large for the way the pose moves."
    yield now.repair(
        Repair(channels=(channel,), factor=1.0 / factor),
        "sign" if abs(factor) == 1.0 else "unit",
        text,
        f"Multiplied by {1.0 / factor:.4g}.",
        "Record yaw counter-clockwise, x and y on a right-handed floor.",
    )


def repair_unsigned_speed(now: Repairs) -> Iterator[DataProblem]:
    """Give a speed that is never negative the sign of the pose's motion."""
    speed, movement = series(now.recording, "speed"), forward_speed(now.poses)
    if speed is None or movement is None or speed.values.min() < 0.0:
        return
    fast = float(np.percentile(np.abs(movement.values), 90))
    inside = (movement.t > speed.t[0]) & (movement.t < speed.t[-1])
    back = (movement.values < -0.2 * fast) & inside
    ahead = (movement.values > 0.2 * fast) & inside
    if min(back.mean(), ahead.mean()) < 0.05 or fast < 0.02:
        return
    if np.median(speed.at(movement.t)[back]) > 0.2 * fast:
        yield now.repair(
            Repair(channels=("speed",), signed=True),
            "sign",
            f"Stays positive while the pose drives backwards ({100.0 * back.mean():.0f} % of the "
            "time).",
            "Takes the sign of the pose's motion.",
            "Record speed with its sign.",
        )


def _turns_with_gyro(recording: Recording, poses: Track) -> bool:
    gyro = series(recording, GYROS[0]) or series(recording, GYROS[1])
    if gyro is None:
        return False
    turn = MotionSignal(("pose.yaw",), "angular speed", Series(poses.t, poses.yaw), 1)
    pair = compare(turn, MotionSignal(GYROS[:1], "angular speed", gyro))
    return pair is not None and pair.lag.correlation > RELATED


def corrected(recording: Recording, quality: Quality) -> Recording:
    """Return the recording in right units and signs, its clocks together.

    Small offsets, scales and biases stay: they are for a fit to find.
    """
    return _whole_poses(repaired(recording, quality.repairs))


def _whole_poses(recording: Recording) -> Recording:
    """Return a recording whose poses are whole: without the rows that lack x, y or yaw.

    Where each comes at a rate of its own they stay as they are.
    """
    poses = {name: recording.channels[name] for name in POSE if name in recording.channels}
    if len(poses) < len(POSE):
        return recording
    common = reduce(np.intersect1d, (channel.t for channel in poses.values()))
    rows = [len(channel.t) for channel in poses.values()]
    if min(rows) == max(rows) == len(common) or len(common) < SHARED * max(rows):
        return recording
    cut = dict[str, Channel]()
    for name, channel in poses.items():
        keep = np.isin(channel.t, common)
        cut[name] = replace(channel, t=channel.t[keep], values=channel.values[keep])
    return replace(recording, channels={**recording.channels, **cut})


def repaired(recording: Recording, repairs: Iterable[Repair]) -> Recording:
    """Return the recording with repairs applied one after the other."""
    channels = dict(recording.channels)
    for repair in repairs:
        signs = (
            forward_speed(track(replace(recording, channels=channels))) if repair.signed else None
        )
        for name in repair.channels:
            if name in channels:
                channels[name] = _repaired(channels[name], repair, signs)
    return replace(recording, channels=channels)


def forward_speed(poses: Track | None) -> Series | None:
    """Return how fast the pose moves along its heading, backwards negative [m/s]."""
    if poses is None or len(poses.t) < 8:
        return None
    width = max(WIDTH_S, 1.5 * poses.period_s)
    step_s = max(STEP_S, 0.25 * poses.period_s)
    on = grid(poses.t[0], poses.t[-1], step_s, width, long_gaps(poses.t))
    if len(on.t) < 8:
        return None
    vx, vy = (on.smooth(Series(poses.t, values), 1) for values in (poses.x, poses.y))
    yaw = on.smooth(Series(poses.t, poses.yaw))
    return Series(on.t, np.cos(yaw) * vx + np.sin(yaw) * vy)


def _repaired(channel: Channel, repair: Repair, signs: Series | None) -> Channel:
    values: Floats = repair.factor * channel.values + repair.offset
    t = channel.t + repair.shift_s
    if signs is not None:
        values = np.abs(values) * np.where(signs.at(t) < 0.0, -1.0, 1.0)
    # Nobody knows in which unit a std beside a wrong unit was meant: the values tell it instead.
    std = channel.std if abs(repair.factor) == 1.0 else None
    changed = replace(channel, t=t, values=values, std=std)
    return changed.at(~inside(t, repair.out_s)) if repair.out_s else changed


def repair_pairs(now: Repairs, car: Car | None) -> Iterator[DataProblem]:
    """Repair lengths, directions, units, signs and clocks, in this order."""
    pairs = _pairs(now, car)
    for step in (_lengths, _backwards, _sizes):
        repaired = len(now.repairs)
        yield from step(now, car, pairs)
        if len(now.repairs) > repaired:
            pairs = _pairs(now, car)
    yield from _offsets(now, car, [pair for pair in pairs if pair.is_related])
    yield from _accelerometer(now)


def _pairs(now: Repairs, car: Car | None) -> list[Pair]:
    """Return the pose's turning and speed, each against every sensor that knows it."""
    poses = now.poses
    movement = forward_speed(poses)
    if poses is None or movement is None:
        return []
    turn = MotionSignal(POSE, "angular speed", Series(poses.t, poses.yaw), 1)
    go = MotionSignal(POSE, "speed", movement)
    found = [(turn, MotionSignal((name,), "angular speed", signal))
             for name in GYROS if (signal := series(now.recording, name)) is not None]  # fmt: skip
    found += [
        (go, MotionSignal(w.channels, "speed", w.distance, 1))
        for w in distance_sensors(now.recording, car)
    ]
    pairs = (compare(first, second, now.left_out_s(second.channels)) for first, second in found)
    return [pair for pair in pairs if pair is not None]


def _lengths(now: Repairs, car: Car | None, pairs: Sequence[Pair]) -> Iterator[DataProblem]:
    """Blame the pose's metre where accelerometer or top speed say so, not only one way."""
    going = [p for p in pairs if p.what == "speed" and p.is_related]
    movement, poses = forward_speed(now.poses), now.poses
    if movement is None or poses is None:
        return
    if not going:
        yield from _length_by_commands(now, car, movement, poses)
        return
    factor = float(np.median([abs(pair.factor) for pair in going]))
    length = next((f for f in LENGTHS if abs(math.log(factor / f)) < 0.2), None)
    if length is None or any(abs(math.log(abs(p.factor) / length)) > 0.2 for p in going):
        return
    push = push_of(now.recording, poses)
    known = [abs(push.numbers[n].value) for n in ("along", "across")] if push else []
    shared = any(abs(math.log(value / length)) < 0.4 for value in known)
    top = top_speed(car) if car else None
    fast = float(np.percentile(np.abs(movement.values), 98))
    if not (shared or _only_then(top, fast, length)):
        return
    yield _length(now, length, "every other sensor says")


def _length_by_commands(
    now: Repairs, car: Car | None, movement: Series, poses: Track
) -> Iterator[DataProblem]:
    """Blame the pose's metre where only with another both speed and turning are as commanded.

    Another car would be faster too, but would turn as its own wheelbase lets it.
    """
    steady = None if car is None else steady_speed(car)
    if car is None or steady is None:
        return
    share = share_of_expected_speed(now.recording, movement, steady)
    for length in LENGTHS:
        if share is None or abs(math.log(share * length)) > math.log(2.0):
            continue
        slower = Series(movement.t, length * movement.values)
        nearer = Track(poses.t, length * poses.x, length * poses.y, poses.yaw)
        turns = steered_in_wheel_angles(now.recording, car, slower, nearer)
        if (
            turns
            and turns.correlation > MIN_CORRELATION
            and abs(math.log(turns.gain)) < math.log(2.0)
        ):
            yield _length(now, length, "its commands ask for")
            return


def _length(now: Repairs, length: float, than: str) -> DataProblem:
    """Repair the pose's metre and say so."""
    repair = Repair(channels=("pose.x", "pose.y"), factor=length)
    text = f"The pose moves {1.0 / length:g} times as far as {than}."
    corrected = f"Multiplied by {length:g}."
    return now.repair(repair, "unit", text, corrected, channel="pose.x, pose.y")


def _only_then(top: float | None, fast: float, factor: float) -> bool:
    """Return whether a speed is believable times the factor, and is not without."""
    if top is None:
        return False
    low, high = BELIEVABLE[0] * top, BELIEVABLE[1] * top
    return not low < fast < high and low < fast * factor < high


def _backwards(now: Repairs, car: Car | None, pairs: Sequence[Pair]) -> Iterator[DataProblem]:
    """Turn a heading round that points to the back of the car."""
    poses, movement = now.poses, forward_speed(now.poses)
    going = [p for p in pairs if p.what == "speed" and p.is_related]
    if poses is None or movement is None or any(p.factor > 0.0 for p in going):
        return
    push = push_of(now.recording, poses)
    known = [push.numbers[name] for name in ("along", "across")] if push else []
    against = [m for m in known if m.value < -4.0 * m.std]
    sent = series(now.recording, "command.throttle")
    throttle = 0.0 if sent is None else float(np.mean(sent.at(movement.t) * movement.values))
    sizes = float(np.mean(np.abs(movement.values))) * (
        1e-9 if sent is None else float(np.mean(np.abs(sent.values)))
    )
    driven_back = throttle < -0.3 * sizes
    if not (driven_back and (going or len(against) == 2)) and not (going and len(against) == 2):
        return
    yield now.repair(
        Repair(channels=("pose.yaw",), offset=math.pi),
        "sign",
        "The heading points to the back of the car: it drives backwards all the time.",
        "Half a turn added.",
        "Fix the marker with its x axis ahead.",
    )


def _sizes(now: Repairs, car: Car | None, pairs: Sequence[Pair]) -> Iterator[DataProblem]:
    """Blame the other sensor of each pair for its unit and sign."""
    del car
    for pair in pairs:
        yield from _size(now, pair)


def _size(now: Repairs, pair: Pair) -> Iterator[DataProblem]:
    at = called(pair.second)
    if not pair.is_related:
        if abs(pair.lag.correlation) < UNLIKE:
            yield DataProblem(
                channel=at,
                name="unrelated",
                text=f"Does not follow the pose's {pair.what}: correlation "
                f"{pair.lag.correlation:.2f}.",
                record_instead="Check that all channels are of one drive.",
            )
        return
    if pair.factor != 1.0:
        yield _divided(now, pair.second, pair.factor, pair.what)


def _divided(now: Repairs, channels: tuple[str, ...], factor: float, what: str) -> DataProblem:
    """Repair channels by a factor and say so."""
    unit = unit_of(factor, what)
    if channels[0].startswith("encoder.") != ("counts" in unit):
        unit = ""
    text = "Its sign is turned" if factor == -1.0 else f"Shows {factor:.4g} times the pose's {what}"
    text += f": it looks like {unit}." if unit else "."
    repair = Repair(channels=channels, factor=1.0 / factor)
    name = "sign" if factor == -1.0 else "unit"
    return now.repair(repair, name, text, f"Divided by {factor:.4g}.")


def _offsets(now: Repairs, car: Car | None, pairs: list[Pair]) -> Iterator[DataProblem]:
    """Bring clocks together that are far apart: the pose's where all say so, else the odd one's."""
    far = [pair for pair in pairs if pair.far_s]
    if not far:
        return
    spread = max(p.far_s for p in far) - min(p.far_s for p in far)
    moves: list[tuple[tuple[str, ...], float]]
    if len(far) == len(pairs) and spread < MIN_CLOCK_OFFSET_S:
        names = tuple(n for n in now.recording.channels if n.startswith("pose."))
        best = min(far, key=lambda p: p.what)  # heading tells a clock better than speed
        moves = [(names, -_refined(now, best, car))]
    else:
        moves = [
            (_clocked_with(now.recording, pair.second), _refined(now, pair, car)) for pair in far
        ]
    done: set[str] = set()
    for names, shift in moves:
        fresh = tuple(name for name in names if name not in done)
        done.update(fresh)
        if not fresh:
            continue
        yield now.repair(
            Repair(channels=fresh, shift_s=shift),
            "clock",
            f"Stamped {abs(shift):.3f} s {'later' if shift < 0.0 else 'earlier'} than the other "
            "sensors stamp the same moment.",
            f"Stamps moved by {shift:+.3f} s.",
            "Stamp all sensors with one clock, or with clocks kept together.",
        )


def _refined(now: Repairs, pair: Pair, car: Car | None) -> float:
    """Return how far the pose's clock is ahead, from the heading where a gyro takes part [s]."""
    poses = now.poses
    found = None
    if poses is not None and pair.what == "angular speed":
        signal = series(now.recording, pair.second[0])
        if signal is not None:
            moved = Series(signal.t + pair.far_s, signal.values).integral()
            found = yaw_against(poses, moved, pair.second[0], (0.0, pair.lag.rate))
    elif poses is not None:
        way = next(
            way for way in distance_sensors(now.recording, car) if way.channels == pair.second
        )
        moved = Series(way.distance.t + pair.far_s, way.distance.values)
        found = travel_against(poses, moved, way.name, (0.0, pair.lag.rate))
    left = found.numbers["delay"].value if found else 0.0
    return pair.far_s + (left if abs(left) < 0.5 * MIN_CLOCK_OFFSET_S else 0.0)


def _clocked_with(recording: Recording, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the channels on the clock of these: their table's, unless it holds more than them."""
    table = next(t for t in same_stamps(recording) if names[0] in t)
    shared = any(name.startswith(("pose.", "command.")) for name in table)
    return names if shared else tuple(dict.fromkeys((*names, *table)))


def _accelerometer(now: Repairs) -> Iterator[DataProblem]:
    poses = now.poses
    found = None if poses is None else push_of(now.recording, poses)
    if found is None:
        return
    factors: dict[float, list[str]] = {}
    for axis, name in (("x", "along"), ("y", "across")):
        scale = found.numbers[name]
        if abs(scale.value) > CERTAIN * scale.std and scale.leak < LARGEST_LEAK:
            near = nearest_factor(scale.value, "acceleration")
            if near == -1.0 or unit_of(near, "acceleration"):
                factors.setdefault(near, []).append(f"imu.accel_{axis}")
    for factor, names in factors.items():
        yield _divided(now, tuple(names), factor, "acceleration")
