"""Compares a recording's sensors with each other, before any model of the car."""

from collections.abc import Iterable, Sequence

import numpy as np

from scm.data_quality import suspected_faults
from scm.data_quality.clipped_channels import clipped_rows, wrapped_rows
from scm.data_quality.commands import command_problems, repair_command_units
from scm.data_quality.distance import DistanceSensor, distance_sensors, travel_against, uncounted
from scm.data_quality.expected_motion import ANOTHER, OTHER_CAR, other_car
from scm.data_quality.frozen_channels import frozen_problems, standing_problem, stands
from scm.data_quality.pose_comparison import push_of, sideways_of, yaw_against
from scm.data_quality.pose_track import FEWEST, POSE, Series, Track, clean, series, track
from scm.data_quality.quality import DataProblem, Quality, Relation, Span, Suspicion, Usable
from scm.data_quality.repairs import (
    GYROS,
    Repairs,
    forward_speed,
    repair_heading,
    repair_pairs,
    repair_unsigned_speed,
)
from scm.data_quality.row_spacing import gaps_of, row_problems
from scm.data_quality.signal_pairs import MotionSignal, compare
from scm.data_quality.suspected_faults import from_repairs
from scm.recording.read import Recording
from scm.vehicles.car import Car
from scm.vehicles.drive_channel import drive_name

SLOWEST_WITNESS_S = 0.3  # poses that come later do not see a car stop
SHORTEST_SPAN_S = 0.5
SHORTEST_DRIVE_S = 5.0
COMMANDS = ("command.throttle", "command.steering")
UNUSABLE = ("frozen", "jump")
MOST = 3
WORDS = {"imu.gyro_z": "gyro", "encoder.*": "encoders", "imu.accel_x": "accelerometer"}
RECORD = (
    "One drive of 60 s or more: poses at 20 Hz or more, throttle and steering as they are sent to "
    "the car, with starts, stops, both turns and several speeds."
)
NO_WITNESS = ("derived", "copied", "unrelated")
AROUND_S = 0.1
ACCELEROMETER = ("imu.accel_x", "imu.accel_y")


def check(recording: Recording, car: Car | None = None) -> Quality:
    """Return what is wrong with a screened recording, or with its sensors against each other.

    Without a car its wheels are not compared.
    """
    state = Repairs(recording)
    problems = list(row_problems(recording))
    problems += repair_heading(state)
    problems += repair_unsigned_speed(state)
    problems += [*wrapped_rows(state), *clipped_rows(state)]
    problems += repair_pairs(state, car)
    problems += repair_command_units(state, car)
    now = state.recording
    poses, found = track(now), distance_sensors(now, car)
    if poses is not None and stands(poses, found):
        problems.append(standing_problem())
        poses = None
    movement = forward_speed(poses)
    sees_stops = poses is not None and poses.period_s < SLOWEST_WITNESS_S
    clipped = [span for p in problems if p.name == "clipped" for span in p.when_s or ()]
    problems += frozen_problems(now, found, movement if sees_stops else None, clipped)
    not_own = no_witnesses(problems)
    found = [way for way in found if not not_own.intersection((*way.channels, way.name))]
    problems += command_problems(now, movement, poses, car)
    relations: list[Relation] = []
    suspicions: list[Suspicion] = []
    if poses is not None:
        relations, suspicions = compare_all(now, car, poses, found, problems)
    suspicions += from_repairs(state.repairs)
    if car is not None:
        problems += uncounted(now, car)
    if car is not None and movement is not None and poses is not None:
        others = list(other_car(now, car, movement, poses, relations))
        if others:  # its wheels count otherwise, no unit is wrong
            problems = [p for p in problems if not (p.name == "unit" and p.channel == "encoder.*")]
        problems += others
    suspicions.sort(key=lambda s: -s.sigma)
    backwards = mirrored(problems)
    if backwards is not None:
        problems.append(backwards)
    can_use = usable(now, problems, car)
    if not can_use.can_diagnose:
        problems.insert(0, no_verdict(can_use.lacks, relations, suspicions))
    return Quality(
        problems=tuple(problems),
        suspicions=tuple(suspicions),
        usable=can_use,
        repairs=tuple(state.repairs),
        relations=tuple(relations),
    )


def mirrored(problems: Iterable[DataProblem]) -> DataProblem | None:
    """Return that time runs backwards, where both gyro and throttle had to be turned round.

    Stamps that count down make a car drive backwards at positive throttle and turn against its
    gyro, while its encoders, which go back too, agree with its way.
    """
    turned = {problem.channel for problem in problems if problem.name == "sign"}
    if "command.throttle" not in turned or not turned.intersection(GYROS):
        return None
    return DataProblem(
        channel="*",
        name="time_backwards",
        text="Gyro and throttle both have the wrong sign against the motion, as in a recording "
        "that runs backwards in time: causes would come after what they cause.",
        record_instead="Write stamps that count up, and rows as they come.",
    )


def usable(recording: Recording, problems: Iterable[DataProblem], car: Car | None = None) -> Usable:
    """Return the usable spans of each channel, and what keeps the recording from being used.

    The recording is repaired, the problems were found in it; without a car a throttle drives it.
    """
    known = list(problems)
    driver = drive_name(recording, car) if car else COMMANDS[0]
    spans: dict[str, tuple[Span, ...]] = {}
    for name, channel in recording.channels.items():
        t = clean(channel).t
        if len(t) < 2:
            spans[name] = ()
            continue
        bad = list(gaps_of(t, name.startswith("command.")))
        for problem in known:
            if problem.name in UNUSABLE and problem.when_s and _concerns(problem.channel, name):
                bad += problem.when_s
        spans[name] = _between((float(t[0]), float(t[-1])), bad)
    return Usable(spans=spans, lacks=tuple(_lacks(spans, known, driver)))


def _concerns(pattern: str, name: str) -> bool:
    return pattern in (name, "*") or (pattern.endswith(".*") and name.startswith(pattern[:-1]))


def _between(whole: Span, bad: Iterable[Span]) -> tuple[Span, ...]:
    """Return what of a span is left between bad ones."""
    start, left = whole[0], []
    for begin, end in sorted(bad):
        if begin - start >= SHORTEST_SPAN_S:
            left.append((start, begin))
        start = max(start, end)
    if whole[1] - start >= SHORTEST_SPAN_S:
        left.append((start, whole[1]))
    return tuple(left)


def _lacks(
    spans: dict[str, tuple[Span, ...]], problems: list[DataProblem], driver: str
) -> Iterable[str]:
    driven = (driver, COMMANDS[1])
    missing = [name for name in (*driven, *POSE) if not spans.get(name)]
    if missing:
        yield f"missing: {', '.join(missing)}"
        return
    if any(p.name == "time_backwards" and p.channel == "*" for p in problems):
        yield "time runs backwards"
    if any(p.name == "standing" for p in problems):
        yield "the car does not move"
    if any(p.name == "other_car" for p in problems):
        yield OTHER_CAR
    unrelated = [p.channel for p in problems if p.name == "without_effect"]
    if unrelated:
        yield f"commands without effect: {', '.join(unrelated)}"
    pose = sum(end - start for start, end in spans["pose.x"])
    if pose < SHORTEST_DRIVE_S:
        yield f"only {pose:.1f} s of poses without gaps; {SHORTEST_DRIVE_S:.0f} s are needed"
    together = [spans[name] for name in (*driven, *POSE)]
    start = max(part[0][0] for part in together)
    end = min(part[-1][1] for part in together)
    if end - start < SHORTEST_DRIVE_S <= pose:
        yield f"poses and commands overlap for {max(0.0, end - start):.1f} s only"


def no_verdict(
    lacks: Sequence[str], relations: Sequence[Relation], suspicions: Sequence[Suspicion]
) -> DataProblem:
    """Return why there is no verdict, what the sensors show nevertheless, and what to record.

    Suspicions come with the most certain first.
    """
    return DataProblem(
        channel="*",
        name="no_verdict",
        text=f"The car cannot be judged: {'; '.join(lacks)}. {_still(relations, suspicions)}",
        record_instead=ANOTHER if list(lacks) == [OTHER_CAR] else RECORD,
    )


def _still(relations: Sequence[Relation], suspicions: Sequence[Suspicion]) -> str:
    others = [relation.pair[1] for relation in relations if not relation.pair[1].startswith("pose")]
    if not others:
        return "No other sensor shows the poses' motion for long enough to be held against them."
    named = ", ".join(dict.fromkeys(WORDS.get(name, name) for name in others))
    sentences = list(dict.fromkeys(s.text for s in suspicions if s.text and not s.repaired))
    if not sentences:
        return f"What can still be said: the poses agree with {named}."
    return f"What can still be said: {' '.join(sentences[:MOST])}"


def compare_all(
    recording: Recording,
    car: Car | None,
    poses: Track,
    found: Sequence[DistanceSensor],
    problems: Sequence[DataProblem],
) -> tuple[list[Relation], list[Suspicion]]:
    """Return all relations, and the faults that would explain those that are off.

    The recording is repaired. Of the problems found so far, copies are no witnesses, and frozen
    spans witness nothing.
    """
    not_own = no_witnesses(problems)
    wheelbase = car.value("body.wheelbase_m") if car else suspected_faults.DEFAULT_WHEELBASE_M
    timed: list[Relation] = []
    suspicions: list[Suspicion] = []
    for name in GYROS:
        rows = None if name in not_own else _measured(poses, problems, (name,))
        gyro = None if rows is None else _turned(recording, rows, name)
        if gyro is not None:
            timed.append(gyro)
            suspicions += suspected_faults.from_gyro(gyro)
    late = _late(timed[0]) if timed else (0.0, 0.0)
    clipped = {problem.channel for problem in problems if problem.name == "clipped"}
    push = None if clipped.intersection(ACCELEROMETER) else push_of(recording, poses, late)
    for way in found:
        rows = _measured(poses, problems, way.channels)
        travel = None if rows is None else travel_against(rows, way.distance, way.name, late)
        if travel is not None:
            timed.append(travel)
            suspicions += suspected_faults.from_travel(travel, way, wheelbase, push)
    suspicions += suspected_faults.from_clocks(timed)
    relations = list(timed)
    sideways = None if found else sideways_of(poses)
    if sideways is not None:
        relations.append(sideways)
        suspicions += suspected_faults.from_sideways(sideways, wheelbase)
    if push is not None:
        relations.append(push)
        turned = [s.values["offset"] for s in suspicions if s.name == "pose_heading"]
        suspicions += suspected_faults.from_push(push, turned[0] if turned else 0.0)
    return relations, suspicions


def no_witnesses(problems: Sequence[DataProblem]) -> set[str]:
    """Return channels that copy another or belong to another drive."""
    return {problem.channel for problem in problems if problem.name in NO_WITNESS}


def _measured(
    poses: Track, problems: Sequence[DataProblem], channels: tuple[str, ...]
) -> Track | None:
    """Return the poses while these channels, and the pose itself, showed what they measure.

    None where hardly any are left.
    """
    keep = np.ones(len(poses.t), dtype=np.bool_)
    around_s = {"frozen": AROUND_S, "clipped": max(AROUND_S, 0.5 * poses.longest_step_s)}
    for problem in problems:
        concerned = problem.channel in channels or problem.channel.startswith("pose.")
        if problem.name in around_s and concerned:
            for start, end in problem.when_s or ():
                around = around_s[problem.name]
                keep &= (poses.t < start - around) | (poses.t > end + around)
    return poses.cut(keep) if keep.sum() >= FEWEST else None


def _turned(recording: Recording, poses: Track, name: str) -> Relation | None:
    gyro = series(recording, name)
    if gyro is None:
        return None
    turn = MotionSignal(("pose.yaw",), "angular speed", Series(poses.t, poses.yaw), 1)
    pair = compare(turn, MotionSignal((name,), "angular speed", gyro))
    if pair is None or not pair.is_related:
        return None
    start = (pair.lag.delay_s + pair.shift_s, pair.lag.rate)
    return yaw_against(poses, gyro.integral(), name, start)


def _late(found: Relation) -> tuple[float, float]:
    """Return delay and rate to start the other comparisons from."""
    rate = found.numbers.get("rate")
    certain = rate is not None and abs(rate.value) > 3.0 * rate.std
    return found.numbers["delay"].value, rate.value if rate is not None and certain else 0.0
