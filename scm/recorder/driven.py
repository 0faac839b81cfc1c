"""Turns the messages of a run about one car into a recording: commands, poses, measurements.

Commands are those that the car reports, whoever sent them: its own driver, a person, a script. They
have passed its guard and have the time of the motion that they caused. Where reports lack the
steering, as in older runs and from other programs, the commands sent over the bus are used, as far
as the guard would have let them through.

Poses count while the commands in force are known and the car obeys them. After each reported
collision no car's poses count for at least a second, and until the car is away from it.
"""

import math
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RecordingError
from scm.recording.columns import LeftOut
from scm.recording.read import Channel, Recording
from scm.v2x.message import Message
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.guard import COMMAND_TIMEOUT_NS, FULL_STOP_NS, Guard

REPORTED_M, REPORTED_RAD, GYRO_RAD_S = 0.002, 0.005, 0.002
MAX_COMMAND_AGE_NS = NS_PER_S // 4  # of a report, for its command to be known
TICK_NS, RUN_IN_NS = 20 * NS_PER_MS, NS_PER_S
HIT, BEFORE_HIT_NS, AFTER_HIT_NS, AWAY_M = "contact", NS_PER_S // 10, NS_PER_S, 0.3
SIMULATED = "simulated"
LOST_FRAMES = 3.0  # without the car: another camera may have it
# Reasons for not counting rows, printed after their number.
HIT_LATELY = "until a second after a hit and 0.3 m away"
STOPPED = "while its guard stopped it"
PLACED = "in the first second after it was placed"
NO_COMMAND = "without a command that it is known to obey"
STANDS, STILL_M = "while it stood and nobody drove it", 0.002
NO_REPORT = "without a report of the car"
OBEYED, MOVED = ("drive", "hold"), ("drive", "hold", "idle")
Row = tuple[int, float, float]
Span = tuple[int, int]


class Report(NamedTuple):
    """A car's pose as reported by itself or the world, whom it obeyed, and its commands.

    `throttle` and `steering` were in force until `t_ns`; steering None: not reported.
    """

    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    source: str
    mode: str
    epoch: int
    car: str
    seq: int = 0
    throttle: float = 0.0
    steering: float | None = None


@dataclass(slots=True)
class CarMessages:
    """All messages of a run about one car; `hit_ns`: times of its reported collisions."""

    commands: list[DriveCommand] = field(default_factory=list)
    reports: list[Report] = field(default_factory=list)
    sensors: list[VehicleSensors] = field(default_factory=list)
    seen: dict[str, list[EyePose]] = field(default_factory=dict)
    hit_ns: list[int] = field(default_factory=list)

    def add(self, message: Message) -> None:
        """Add a message about this car."""
        match message:
            case DriveCommand():
                self.commands.append(message)
            case VehicleSensors():
                self.sensors.append(message)
            case EyePose():
                self.seen.setdefault(message.camera, []).append(message)
            case CityEvent(name=event, t_ns=t_ns) if event == HIT:
                self.hit_ns.append(t_ns)
            case VehicleState():
                at = (message.t_ns, message.x_m, message.y_m, message.yaw_rad, message.source)
                whom = (message.mode, message.epoch, message.car, message.seq)
                self.reports.append(Report(*at, *whom, message.throttle, message.steering))

    def forget(self, before_ns: int) -> None:
        """Remove what the car sent before a time, and what was seen of it; commands stay."""
        self.reports = [one for one in self.reports if one.t_ns >= before_ns]
        self.sensors = [one for one in self.sensors if one.t_ns >= before_ns]
        self.seen = {
            camera: [one for one in poses if one.t_ns >= before_ns]
            for camera, poses in self.seen.items()
        }
        self.hit_ns = [t_ns for t_ns in self.hit_ns if t_ns >= before_ns]

    @property
    def lost(self) -> int:
        """Number of the car's reports missing between the first and the last."""
        steps = (now.seq - before.seq for before, now in pairwise(self.reports))
        return sum(step - 1 for step in steps if step > 1)


class Stretch(NamedTuple):
    """From an owner's first command until the guard stops the car after the last."""

    start_ns: int
    end_ns: int
    epoch: int


def by_one_camera(seen: Mapping[str, Sequence[EyePose]]) -> list[EyePose]:
    """Return poses of a car in their order, by one camera at a time.

    The first camera goes on until it has lost the car: no two cameras agree exactly, and poses that
    jumped to and fro between them would look like noise.

    Args:
        seen: By each camera.
    """
    lost_ns = {
        camera: LOST_FRAMES * float(np.median(np.diff(sorted(one.t_ns for one in poses))))
        for camera, poses in seen.items()
        if len(poses) > 1
    }
    chosen = list[EyePose]()
    for pose in sorted(chain(*seen.values()), key=lambda one: one.t_ns):
        last = chosen[-1] if chosen else pose
        if pose.camera == last.camera or pose.t_ns - last.t_ns > lost_ns.get(last.camera, 0.0):
            chosen.append(pose)
    return chosen


def reports_commands(messages: CarMessages) -> bool:
    """Return whether a car's reports include the steering."""
    return any(report.steering is not None for report in messages.reports)


def recording_of(
    messages: CarMessages, path: Path, name: str, start_ns: int = 0, *, sent_only: bool = False
) -> Recording:
    """Return the messages about a car as a recording, with times since `start_ns`.

    Poses of a simulated car are those it reports, of a real one those of the overhead cameras.

    Args:
        messages: All of them.
        path: Of the run, for messages.
        name: Of the car.
        start_ns: Time zero of the recording.
        sent_only: Leave out times when the car obeyed commands that are not in `messages`.

    Raises:
        RecordingError: naming `path` and the car, when there are no poses or no obeyed commands.
    """
    return _Drive(path, name, messages, start_ns, sent_only=sent_only).recording()


class _Drive:
    """Builds the recording of one car."""

    def __init__(
        self, path: Path, name: str, messages: CarMessages, start_ns: int, *, sent_only: bool
    ) -> None:
        self._at, self._path, self._name = f"{path}: {name}", path, name
        self._messages, self._start_ns = messages, start_ns
        messages.reports.sort(key=lambda report: report.t_ns)
        sent, self._sent = _obeyed(messages.commands)
        self._lives = [] if sent_only and self._sent else _lives(messages.reports)
        self._rows = self._clipped(_commands(messages.reports, sent))
        self._reported = _Reported(messages.reports)
        hits = messages.hit_ns if messages.reports else []
        self._hits = [_about_hit(hit_ns, messages.reports) for hit_ns in hits]
        self._left_out: tuple[LeftOut, ...] = ()

    def recording(self) -> Recording:
        """Return the recording of this car.

        Raises:
            RecordingError: when there are no poses or no obeyed commands.
        """
        if not self._messages.reports:
            msg = f"{self._at}: neither it nor the world reports which car it is"
            raise RecordingError(msg)
        if not self._rows:
            msg = f"{self._at}: no command that it obeyed is known: nothing can be driven again"
            raise RecordingError(msg)
        channels = self._poses()
        t = np.array([row[0] for row in self._rows], np.int64)
        for i, name in enumerate(("command.throttle", "command.steering"), 1):
            values = np.array([row[i] for row in self._rows], np.float64)
            channels[name] = self._channel(t, values, None, "ratio")
        channels |= self._sensors()
        car = self._messages.reports[-1].car
        return Recording(self._path, car, channels, self._name, left_out=self._left_out)

    def _poses(self) -> dict[str, Channel]:
        """Return the poses that count; record how many do not, and why."""
        rows: list[tuple[float, ...]] = [
            report[:4] for report in self._messages.reports if report.source == SIMULATED
        ]
        std = REPORTED_M, REPORTED_M, REPORTED_RAD
        if not rows:
            seen = by_one_camera(self._messages.seen)
            rows = [(pose.t_ns, pose.x_m, pose.y_m, pose.yaw_rad) for pose in seen]
            variances = [pose.covariance[::4] for pose in seen] or [(np.nan,) * 3]
            std = tuple(np.sqrt(np.maximum(np.median(variances, axis=0), 1e-12)))
        t = np.array([row[0] for row in rows], np.int64)
        reasons = self._reasons(t)
        if not (reasons == "").any():
            why = f" ({_counted(reasons)})" if rows else ""
            msg = f"{self._at}: no pose while it obeyed commands{why}: nothing can be driven again"
            raise RecordingError(msg)
        if (reasons != "").any():
            left_out = np.count_nonzero(reasons)
            why = f"{self._name}: {left_out} of {len(rows)} poses left out: {_counted(reasons)}"
            self._left_out = (LeftOut(self._path.name, None, why),)
        columns = np.array(rows, np.float64).T[1:, reasons == ""]
        kinds = zip(("pose.x", "pose.y", "pose.yaw"), ("length", "length", "angle"), strict=True)
        return {
            name: self._channel(t[reasons == ""], column, float(noise), kind)
            for (name, kind), column, noise in zip(kinds, columns, std, strict=True)
        }

    def _sensors(self) -> dict[str, Channel]:
        """Return encoders and yaw gyro if the car has them."""
        t = np.array([one.t_ns for one in self._messages.sensors], np.int64)
        counts = self._reasons(t) == ""
        if not counts.any():
            return {}
        of: dict[str, tuple[Callable[[VehicleSensors], float], float | None, str]] = {
            "encoder.left": (lambda one: one.encoder_left, None, "count"),
            "encoder.right": (lambda one: one.encoder_right, None, "count"),
            "imu.gyro_z": (lambda one: one.gyro_radps[2], GYRO_RAD_S, "angular speed"),
        }
        every = {
            name: (np.array([value(one) for one in self._messages.sensors], np.float64), std, kind)
            for name, (value, std, kind) in of.items()
        }
        return {
            name: self._channel(t[counts], values[counts], std, kind)
            for name, (values, std, kind) in every.items()
        }

    def _channel(self, t_ns: Ints, values: Floats, std: float | None, kind: str) -> Channel:
        fit: Bools = np.isfinite(values)
        t: Floats = (t_ns - self._start_ns) / NS_PER_S
        return Channel(t[fit], values[fit], std, (0.0, 0.0), kind)

    def _clipped(self, rows: list[Row]) -> list[Row]:
        """Return the commands from shortly before poses count, so the servo starts right."""
        spans = [*self._lives, *(stretch[:2] for stretch in self._sent)]
        first_ns = min((start_ns for start_ns, _ in spans), default=0) - RUN_IN_NS
        last_ns = max((end_ns for _, end_ns in spans), default=0)
        return [row for row in rows if first_ns <= row[0] <= last_ns]

    def _reasons(self, t_ns: Ints) -> NDArray[np.object_]:
        """Return for each time the reason not to count it, empty if it counts, shape `(n,)`."""
        reasons = np.full(len(t_ns), NO_COMMAND, object)
        reported, k = self._reported, self._reported.at(t_ns)
        lives = np.zeros(len(t_ns), np.bool_)
        for start_ns, end_ns in self._lives:
            reasons[(t_ns >= start_ns - RUN_IN_NS) & (t_ns < start_ns)] = PLACED
            lives |= (t_ns >= start_ns) & (t_ns <= end_ns)
        known = lives & reported.has_command[k] & reported.moves[k]
        reasons[lives & reported.has_command[k] & ~reported.moves[k]] = STOPPED
        for stretch in self._sent:
            inside = (t_ns >= stretch.start_ns) & (t_ns <= stretch.end_ns)
            own = reported.epoch[k] == stretch.epoch
            reasons[inside & own & ~reported.obeys[k]] = STOPPED
            known |= inside & own & reported.obeys[k]
        reasons[known] = ""
        reasons[known & reported.stands[k]] = STANDS
        reasons[(t_ns - reported.t_ns[k] > MAX_COMMAND_AGE_NS) | (t_ns < reported.t_ns[k])] = (
            NO_REPORT
        )
        for start_ns, end_ns in self._hits:
            reasons[(t_ns >= start_ns) & (t_ns <= end_ns)] = HIT_LATELY
        for car in np.unique(reported.car)[reported.car[-1] != np.unique(reported.car)]:
            reasons[reported.car[k] == car] = f"of a car that was a {car}"
        return reasons


class _Reported:
    """The reports of a car, by column."""

    def __init__(self, reports: Sequence[Report]) -> None:
        self.t_ns: Ints = np.array([report.t_ns for report in reports], np.int64)
        self.has_command: Bools = np.array(
            [report.steering is not None for report in reports], np.bool_
        )
        self.moves: Bools = np.array([report.mode in MOVED for report in reports], np.bool_)
        self.obeys: Bools = np.array([report.mode in OBEYED for report in reports], np.bool_)
        self.epoch: Ints = np.array([report.epoch for report in reports], np.int64)
        self.car = np.array([report.car for report in reports])
        self.stands: Bools = self._stands(reports)

    def _stands(self, reports: Sequence[Report]) -> Bools:
        """Return whether nobody drives the car and it has not moved for a second."""
        idle: Bools = np.array([report.mode == "idle" for report in reports], np.bool_)
        x, y = np.array([(report.x_m, report.y_m) for report in reports]).reshape(-1, 2).T
        before = self.at(self.t_ns - NS_PER_S)
        long_enough = self.t_ns - self.t_ns[before] >= NS_PER_S
        still: Bools = np.hypot(x - x[before], y - y[before]) < STILL_M
        return idle & long_enough & still

    def at(self, t_ns: Ints) -> Ints:
        """Return the index of the newest report at each time; before the first, 0."""
        return np.maximum(np.searchsorted(self.t_ns, t_ns, side="right") - 1, 0)


def _counted(reasons: NDArray[np.object_]) -> str:
    """Return how many rows are left out for each reason."""
    counts = Counter(reason for reason in reasons if reason)
    return ", ".join(f"{count} {reason}" for reason, count in counts.most_common())


def _about_hit(hit_ns: int, reports: Sequence[Report]) -> Span:
    """Return the span in which a collision may move the car: until it is away [ns]."""
    k = min(bisect_right(reports, hit_ns, key=lambda report: report.t_ns), len(reports) - 1)
    at = reports[k]
    away = (r for r in reports[k:] if math.hypot(r.x_m - at.x_m, r.y_m - at.y_m) > AWAY_M)
    left = next(away, reports[-1])
    return hit_ns - BEFORE_HIT_NS, max(hit_ns + AFTER_HIT_NS, left.t_ns)


def _commands(reports: Sequence[Report], sent: Sequence[Row]) -> list[Row]:
    """Return the commands that a car reports, or those sent to it where it reports none.

    A reported command begins at the previous report. If a car reports less often than it decides,
    the new command began on average half way between the reports.
    """
    spans = [now.t_ns - before.t_ns for before, now in pairwise(reports)] or [TICK_NS]
    unknown_ns = max(0, int(np.median(spans)) - TICK_NS) // 2
    rows = []
    for before, now in pairwise(reports):
        if now.steering is not None:
            follows = now.seq == before.seq + 1
            since_ns = before.t_ns + unknown_ns if follows else now.t_ns - TICK_NS
            rows.append((since_ns, now.throttle, now.steering))
    for row in sent:
        k = min(bisect_left(reports, row[0], key=lambda report: report.t_ns), len(reports) - 1)
        if k < 0 or reports[k].steering is None:
            rows.append(row)
    return sorted(rows, key=lambda row: row[0])


def _lives(reports: Sequence[Report]) -> list[Span]:
    """Return the spans in which a car reports its commands without being moved by hand [ns].

    Each begins after the servo has followed reported commands for `RUN_IN_NS`.
    """

    def goes_on(before: Report, now: Report) -> bool:
        alike = (before.steering is None) == (now.steering is None) and before.car == now.car
        return alike and now.seq > before.seq

    ends = [i for i, two in enumerate(pairwise(reports), start=1) if not goes_on(*two)]
    return [
        (reports[i].t_ns + RUN_IN_NS, reports[j - 1].t_ns)
        for i, j in pairwise([0, *ends, len(reports)])
        if j > i and reports[i].steering is not None
    ]


def _obeyed(commands: Iterable[DriveCommand]) -> tuple[list[Row], list[Stretch]]:
    """Return what the guard lets through, time [ns], throttle, steering, and owners' stretches.

    Where the next command is late the throttle is zero, as the guard sets it.
    """
    guard = Guard()
    rows: list[Row] = []
    stretches: list[Stretch] = []

    def let_go(until_ns: int | None) -> None:
        if not stretches:
            return
        last = stretches[-1].end_ns - FULL_STOP_NS
        for late in (COMMAND_TIMEOUT_NS, FULL_STOP_NS):
            if until_ns is None or until_ns > last + late:
                rows.append((last + late, 0.0, rows[-1][2]))

    for command in commands:
        t_ns = command.t_ns
        if not guard.accept(command, t_ns):
            continue
        let_go(t_ns)
        allowed = guard.output(t_ns)
        rows.append((t_ns, allowed.throttle, allowed.steering))
        goes_on = stretches and t_ns <= stretches[-1].end_ns
        if goes_on and stretches[-1].epoch == command.epoch:
            stretches[-1] = stretches[-1]._replace(end_ns=t_ns + FULL_STOP_NS)
        else:
            stretches.append(Stretch(t_ns, t_ns + FULL_STOP_NS, command.epoch))
    let_go(None)
    return rows, stretches
