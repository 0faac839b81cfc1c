"""Ask a recording's sensors about each other, before any model of the car."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from scm.mismatch.doubt import gross, suspect
from scm.mismatch.doubt.corrected import forward_speed, repaired
from scm.mismatch.doubt.driven import command_problems
from scm.mismatch.doubt.gross import Pair, Sensed, compare
from scm.mismatch.doubt.other_car import other_car
from scm.mismatch.doubt.pushing import push_against
from scm.mismatch.doubt.rows import called, row_problems, tables
from scm.mismatch.doubt.sideways import sideways_of
from scm.mismatch.doubt.stuck import stuck_problems
from scm.mismatch.doubt.suspicion import Doubts, Relation, Repair, Suspicion
from scm.mismatch.doubt.track import Series, Track, clean, series, track
from scm.mismatch.doubt.travel import travel_against
from scm.mismatch.doubt.turning import yaw_against
from scm.mismatch.doubt.usable import usable
from scm.mismatch.doubt.way import Way, ways
from scm.mismatch.findings import DataProblem
from scm.recording.read import Recording
from scm.vehicles.car import Car

CHECKS = 16
GYROS = ("imu.gyro_z", "yaw_rate")


def doubt(recording: Recording, car: Car | None = None) -> Doubts:
    """Return what is wrong with a recording, or with its sensors against each other.

    Args:
        car: Gives wheel radius, counts a turn and track; without it wheels are not compared.
    """
    state = _State(recording)
    problems = list(row_problems(recording))
    problems += _gross(state, car)
    now = state.recording
    poses = track(now)
    movement = forward_speed(poses)
    found = ways(now, car)
    problems += stuck_problems(now, found)
    derived = {p.channel for p in problems if p.name in ("derived", "copied")}
    found = [way for way in found if not derived.intersection(way.channels)]
    problems += command_problems(now, movement, poses)
    relations, suspicions = _compare(now, car, poses, found, derived)
    if car is not None and movement is not None and poses is not None:
        travel = next(
            (r for r in relations if r.pair[0] == "pose.x" and "scale" in r.numbers), None
        )
        problems += other_car(now, car, movement, poses, travel)
    return Doubts(
        problems=tuple(problems),
        suspicions=tuple(sorted(suspicions, key=lambda s: -s.sigma)),
        usable=usable(now, problems),
        repairs=tuple(state.repairs),
        relations=tuple(relations),
    )


@dataclass
class _State:
    """The recording as repaired so far."""

    recording: Recording
    repairs: list[Repair] = field(default_factory=list)

    def repair(self, repair: Repair) -> None:
        self.recording = repaired(self.recording, [repair])
        self.repairs.append(repair)


def _compare(
    recording: Recording, car: Car | None, poses: Track | None, found: list[Way], derived: set[str]
) -> tuple[list[Relation], list[Suspicion]]:
    if poses is None:
        return [], []
    relations: list[Relation] = []
    suspicions: list[Suspicion] = []
    wheelbase = car.value("body.wheelbase_m") if car else suspect.DEFAULT_WHEELBASE_M
    start, heading = (0.0, 0.0), None
    for name in GYROS:
        gyro = None if name in derived else series(recording, name)
        turned = yaw_against(poses, gyro.integral(), name, start) if gyro else None
        if turned is not None and gyro is not None:
            relations.append(turned)
            suspicions += suspect.from_gyro(turned, CHECKS)
            start = _late(turned)
    for way in found:
        relation = travel_against(poses, way.distance, way.name, start, heading)
        if relation is not None:
            relations.append(relation)
            suspicions += suspect.from_travel(relation, way, wheelbase, CHECKS)
    if not found:
        sideways = sideways_of(poses)
        if sideways is not None:
            relations.append(sideways)
            suspicions += suspect.from_sideways(sideways, wheelbase, CHECKS)
    suspicions += suspect.from_clocks(relations, CHECKS)
    push = _push(recording, poses, start)
    if push is not None:
        relations.append(push)
        suspicions += suspect.from_push(push, CHECKS)
    return relations, suspicions


def _late(found: Relation) -> tuple[float, float]:
    rate = found.numbers.get("rate")
    certain = rate is not None and abs(rate.value) > 3.0 * rate.std
    return found.numbers["delay"].value, rate.value if rate is not None and certain else 0.0


def _push(recording: Recording, poses: Track, late: tuple[float, float]) -> Relation | None:
    along, across = (series(recording, f"imu.accel_{axis}") for axis in "xy")
    if along is None or across is None or min(np.ptp(along.values), np.ptp(across.values)) == 0.0:
        return None
    return push_against(poses, along, across, late)


def _gross(state: _State, car: Car | None) -> Iterator[DataProblem]:
    """Find and repair, one after the other, what would spoil every comparison after it."""
    yield from _time_units(state)
    yield from _heading(state)
    yield from _unsigned(state)
    yield from _pairs(state, car)
    yield from _accelerometer(state)


def _time_units(state: _State) -> Iterator[DataProblem]:
    spans = {}
    for names in tables(state.recording):
        t = clean(state.recording.channels[names[0]]).t
        if len(t) > 2:
            spans[names] = float(np.ptp(t)), float(np.median(np.diff(t)))
    if not spans:
        return
    for names, factor in list(gross.time_factors(spans)):
        state.repair(Repair(channels=names, time_factor=factor))
        yield DataProblem(
            channel=called(names),
            name="unit",
            said=f"Stamps are {1.0 / factor:g} times too large for seconds.",
            corrected=f"Multiplied by {factor:g}.",
            record_instead="Give the unit of the time column in the recording's description.",
        )


def _heading(state: _State) -> Iterator[DataProblem]:
    poses = track(state.recording)
    if poses is None or poses.t[-1] - poses.t[0] < 4.0:
        return
    raw = series(state.recording, "pose.yaw")
    if raw is None:
        return
    at = np.clip(np.searchsorted(raw.t, poses.t), 0, len(raw.t) - 1)
    factor = gross.heading_fault(poses, raw.values[at])
    if factor == 1.0:
        return
    mirrored = factor == -1.0 and _turns_with_gyro(state.recording, poses)
    channel = "pose.y" if mirrored else "pose.yaw"
    state.repair(Repair(channels=(channel,), factor=1.0 / factor))
    said = "The pose turns the other way than it moves: one axis is mirrored."
    if abs(factor) != 1.0:
        said = f"The heading is {abs(factor):.3g} times too large for the way the pose moves."
    yield DataProblem(
        channel=channel,
        name="sign" if abs(factor) == 1.0 else "unit",
        said=said,
        corrected=f"Multiplied by {1.0 / factor:.4g}.",
        record_instead="Yaw in the unit of the description, counter-clockwise, x and y on a "
        "right-handed floor.",
    )


def _turns_with_gyro(recording: Recording, poses: Track) -> bool:
    gyro = series(recording, GYROS[0]) or series(recording, GYROS[1])
    if gyro is None:
        return False
    pair = compare(Sensed(("pose.yaw",), "angular speed", Series(poses.t, poses.yaw), 1),
                   Sensed(GYROS[:1], "angular speed", gyro))  # fmt: skip
    return pair is not None and pair.alike and pair.lag.alike > 0.0


def _unsigned(state: _State) -> Iterator[DataProblem]:
    speed, movement = series(state.recording, "speed"), forward_speed(track(state.recording))
    if speed is None or movement is None or speed.values.min() < 0.0:
        return
    fast = float(np.percentile(np.abs(movement.values), 90))
    back = movement.values < -0.2 * fast
    inside = (movement.t > speed.t[0]) & (movement.t < speed.t[-1])
    if (back & inside).mean() < 0.02 or fast < 0.02:
        return
    said = speed.at(movement.t)[back & inside]
    if np.median(said) > 0.2 * fast and (~back & inside).mean() > 0.02:
        state.repair(Repair(channels=("speed",), signed=True))
        yield DataProblem(
            channel="speed",
            name="sign",
            said="Stays positive while the pose drives backwards.",
            corrected="Takes the sign of the pose's motion.",
        )


def _pairs(state: _State, car: Car | None) -> Iterator[DataProblem]:
    poses = track(state.recording)
    movement = forward_speed(poses)
    if poses is None or movement is None or poses.t[-1] - poses.t[0] < 4.0:
        return
    turn = Sensed(("pose.x", "pose.y", "pose.yaw"), "angular speed", Series(poses.t, poses.yaw), 1)
    go = Sensed(("pose.x", "pose.y", "pose.yaw"), "speed", movement)
    others = [
        (turn, Sensed((n,), "angular speed", s)) for n in GYROS if (s := series(state.recording, n))
    ]
    others += [(go, Sensed(w.channels, "speed", w.distance, 1)) for w in ways(state.recording, car)]
    pairs = [pair for pair in (compare(a, b) for a, b in others) if pair is not None]
    for pair in pairs:
        yield from _size(state, pair)
    yield from _offsets(state, [pair for pair in pairs if pair.alike])


def _size(state: _State, pair: Pair) -> Iterator[DataProblem]:
    at = called(pair.second)
    if not pair.alike:
        if abs(pair.lag.alike) < gross.UNLIKE:
            yield DataProblem(
                channel=at,
                name="unrelated",
                said=f"Does not follow the pose's {pair.what}: correlation {pair.lag.alike:.2f}.",
                record_instead="Check that all channels are of one drive.",
            )
        return
    if pair.factor == 1.0:
        return
    unit = gross.unit_of(pair.factor, pair.what)
    state.repair(Repair(channels=pair.second, factor=1.0 / pair.factor))
    turned = pair.factor < 0.0
    said = f"Shows {pair.factor:.4g} times the pose's {pair.what}"
    said += (
        f": it looks like {unit}."
        if unit
        else (": its sign is turned." if pair.factor == -1.0 else ".")
    )
    yield DataProblem(
        channel=at,
        name="sign" if turned and abs(pair.factor) == 1.0 else "unit",
        said=said,
        corrected=f"Divided by {pair.factor:.4g}.",
        record_instead="Give the unit and sign of the column in the recording's description.",
    )


def _offsets(state: _State, pairs: list[Pair]) -> Iterator[DataProblem]:
    """Bring clocks together that are far apart: the pose's where all say so, else the odd one's."""
    far = [pair for pair in pairs if pair.far_s]
    if not far:
        return
    spread = max(p.far_s for p in far) - min(p.far_s for p in far)
    if len(far) == len(pairs) and spread < gross.FAR_S:
        shift = -float(np.median([pair.far_s for pair in far]))
        names = tuple(n for n in state.recording.channels if n.startswith("pose."))
        repairs = [(names, shift)]
    else:
        repairs = [(_clocked_with(state.recording, pair.second), pair.far_s) for pair in far]
    done: set[str] = set()
    for names, shift in repairs:
        fresh = tuple(name for name in names if name not in done)
        done.update(fresh)
        if not fresh:
            continue
        state.repair(Repair(channels=fresh, shift_s=shift))
        yield DataProblem(
            channel=called(fresh),
            name="clock",
            said=f"The clock is {abs(shift):.3f} s {'ahead of' if shift < 0.0 else 'behind'} the "
            "other sensors'.",
            corrected=f"Stamps moved by {shift:+.3f} s.",
            record_instead="Stamp all sensors with one clock, or with clocks kept together.",
        )


def _clocked_with(recording: Recording, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return all channels that share their stamps with these, but never the commands' alone."""
    table = next(t for t in tables(recording) if names[0] in t)
    return tuple(dict.fromkeys((*names, *table)))


def _accelerometer(state: _State) -> Iterator[DataProblem]:
    poses = track(state.recording)
    found = None if poses is None else _push(state.recording, poses, (0.0, 0.0))
    if found is None:
        return
    sizes = {}
    for axis, name in (("x", "along"), ("y", "across")):
        scale = found.numbers[name]
        if abs(scale.value) > 4.0 * scale.std:
            near = gross.nearest_factor(scale.value, "acceleration")
            known = abs(near) == 1.0 or bool(gross.unit_of(near, "acceleration"))
            sizes[axis] = near if known else 1.0
    for axis, factor in sizes.items():
        if factor == 1.0:
            continue
        both = len(set(sizes.values())) == 1 and len(sizes) == 2
        at = f"imu.accel_{axis}"
        state.repair(Repair(channels=(at,), factor=1.0 / factor))
        unit = gross.unit_of(factor, "acceleration")
        yield DataProblem(
            channel=at,
            name="unit" if unit else "sign",
            said=f"Shows {factor:.4g} times the pose's acceleration"
            + (f": it looks like {unit}." if unit else ": its sign is turned."),
            corrected=f"Divided by {factor:.4g}.",
            record_instead="Give unit and sign of the accelerometer in the description."
            + (" Both axes alike." if both else ""),
        )
