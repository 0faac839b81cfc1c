"""Every pair of sensors that knows the same motion, compared, and what that makes suspicious."""

from collections.abc import Sequence

import numpy as np

from scm.data_quality import suspected_faults
from scm.data_quality.accelerometer import push_of
from scm.data_quality.distance import DistanceSensor, travel_against
from scm.data_quality.heading import sideways_of, yaw_against
from scm.data_quality.pose_track import FEWEST, Series, Track, series
from scm.data_quality.problem import DataProblem
from scm.data_quality.quality import Relation, Suspicion
from scm.data_quality.repairs import GYROS
from scm.data_quality.unit_errors import MotionSignal, compare
from scm.recording.read import Recording
from scm.vehicles.car import Car

NO_WITNESS = ("derived", "copied", "unrelated")
AROUND_S = 0.1
ACCELEROMETER = ("imu.accel_x", "imu.accel_y")


def compare_all(
    recording: Recording,
    car: Car | None,
    poses: Track,
    found: Sequence[DistanceSensor],
    problems: Sequence[DataProblem],
) -> tuple[list[Relation], list[Suspicion]]:
    """Return all relations, and the faults that would explain those that are off.

    Args:
        recording: Repaired.
        car: Says how long the car is.
        poses: Of the recording.
        found: Sensors of distance.
        problems: Found so far: copies are no witnesses, and frozen spans witness nothing.
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
